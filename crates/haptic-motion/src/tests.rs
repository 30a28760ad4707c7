use super::*;
use parquet::data_type::{DoubleType, FloatType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A file that is gone once it is open.
fn opened(bytes: &[u8], options: &TableOptions) -> Result<Rows, MotionError> {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("motion");
    std::fs::write(&path, bytes).expect("written");
    Rows::open_any(&path, options)
}

fn rows_of(bytes: &[u8]) -> Result<Vec<MotionRow>, MotionError> {
    opened(bytes, &TableOptions::default())?.of_one_axis()?.collect()
}

fn error_of(bytes: &[u8]) -> String {
    rows_of(bytes).expect_err("not a motion").to_string()
}

fn row(k: u32) -> MotionRow {
    MotionRow {
        t_s: f64::from(k) * 1e-3,
        position_m: f64::from(k).sin(),
        velocity_mps: Some(f64::from(k).cos()),
        ..MotionRow::default()
    }
}

/// A recording's channel after one that is something else.
fn mcap(count: u32, schema: &str, cells: fn(MotionRow) -> Vec<u8>) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let options = mcap::WriteOptions::new().use_chunks(false);
    let mut writer = options.create(&mut bytes).expect("begun");
    let text = writer.add_schema("text", "jsonschema", b"{}").expect("a schema");
    let none = BTreeMap::new();
    let events = writer.add_channel(text, "/events", "json", &none).expect("a channel");
    let struct_of = writer.add_schema("Sample", "ros2msg", schema.as_bytes());
    let samples = writer.add_channel(struct_of.expect("a schema"), "/samples", "cdr", &none);
    let samples = samples.expect("a channel");
    for k in 0..count {
        for (channel_id, data) in [(events, b"{}".to_vec()), (samples, cells(row(k)))] {
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence: k,
                log_time: u64::from(k),
                publish_time: u64::from(k),
            };
            writer.write_to_known_channel(&header, &data).expect("written");
        }
    }
    writer.finish().expect("ended");
    drop(writer);
    bytes.into_inner()
}

const SCHEMA: &str = "uint64 tick\nuint8 state\nfloat64 t_s\nfloat64 device_position_m\nfloat32 device_velocity_mps\n";

#[expect(clippy::cast_possible_truncation, reason = "the columns are of this type")]
fn velocity_of(row: &MotionRow) -> f32 {
    row.velocity_mps.unwrap_or_default() as f32
}

fn cdr(row: MotionRow) -> Vec<u8> {
    [
        &[0, 1, 0, 0][..],
        &7_u64.to_le_bytes(),
        &[3, 0, 0, 0, 0, 0, 0, 0],
        &row.t_s.to_le_bytes(),
        &row.position_m.to_le_bytes(),
        &velocity_of(&row).to_le_bytes(),
    ]
    .concat()
}

/// Groups of 1000 rows; positions may be empty, and are every tenth where that is asked for.
fn parquet(count: u32, schema: &str, with_gaps: bool) -> Vec<u8> {
    let schema = Arc::new(parse_message_type(schema).expect("a schema"));
    let mut bytes = Vec::new();
    let properties = Arc::new(WriterProperties::builder().build());
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, properties).expect("begun");
    let all: Vec<MotionRow> = (0..count).map(row).collect();
    for rows in all.chunks(1000) {
        let mut group = writer.next_row_group().expect("a group");
        for place in 0.. {
            let Some(mut column) = group.next_column().expect("a column") else {
                break;
            };
            match place {
                0 => {
                    let ticks: Vec<i64> = (0..).take(rows.len()).collect();
                    column.typed::<Int64Type>().write_batch(&ticks, None, None)
                }
                1 => {
                    let times: Vec<f64> = rows.iter().map(|row| row.t_s).collect();
                    column.typed::<DoubleType>().write_batch(&times, None, None)
                }
                2 => {
                    let is_there = |index: usize| !with_gaps || index % 10 != 9;
                    let levels: Vec<i16> = (0..rows.len()).map(|index| i16::from(is_there(index))).collect();
                    let cells = rows.iter().enumerate().filter(|(index, _)| is_there(*index));
                    let positions: Vec<f64> = cells.map(|(_, row)| row.position_m).collect();
                    let column = column.typed::<DoubleType>();
                    column.write_batch(&positions, Some(&levels), None)
                }
                _ => {
                    let velocities: Vec<f32> = rows.iter().map(velocity_of).collect();
                    column.typed::<FloatType>().write_batch(&velocities, None, None)
                }
            }
            .expect("written");
            column.close().expect("closed");
        }
        group.close().expect("closed");
    }
    writer.close().expect("ended");
    bytes
}

/// The file, whose footer says of the column of times that it is compressed by Zstandard.
fn by_zstandard(mut file: Vec<u8>) -> Vec<u8> {
    // The codec follows the column's name; a field is numbered by its distance from the one before.
    let place = file.windows(5).position(|bytes| bytes == b"t_s\x15\x00");
    file[place.expect("the codec is there") + 4] = 6 << 1;
    file
}

const COLUMNS: &str = "message rows { required int64 tick; required double t_s; optional double position_m; \
                       required float velocity_mps; }";

fn assert_rows(found: &[MotionRow], count: u32) {
    assert_eq!(found.len(), count as usize);
    for (k, found) in (0..).zip(found) {
        let wanted = row(k);
        assert_eq!((found.t_s, found.position_m), (wanted.t_s, wanted.position_m));
        let [found, wanted] = [found, &wanted].map(|row| row.velocity_mps.expect("measured"));
        assert!((found - wanted).abs() < 1e-6, "row {k}: {found} for {wanted}");
    }
}

/// Here the second axis is at the velocity of the first one.
#[test]
fn each_format_gives_the_same_rows_with_their_second_axis() {
    let lines: String = (0..5000)
        .map(row)
        .map(|row| {
            let velocity = row.velocity_mps.unwrap_or_default();
            format!("{},{},{velocity},{velocity},7\n", row.t_s, row.position_m)
        })
        .collect();
    let names = "t_s,device_position_m,device_velocity_mps,device_position_y_m,device_velocity_y_mps";
    let table = format!("{names}\n{lines}");
    let schema = format!("{SCHEMA}float32 device_position_y_m\n");
    let message = |row: MotionRow| {
        let mut message = cdr(row);
        message.extend_from_within(message.len() - 4..);
        message
    };
    let columns = COLUMNS.replace('}', "required float position_y_m; }");
    let recording = format!("# hapticd recording 2\n# from a tracker\n{table}");
    for (bytes, velocity_y_mps) in [
        (recording.into_bytes(), Some(7.0)),
        (table.clone().into_bytes(), Some(7.0)),
        (mcap(5000, &schema, message), None),
        (parquet(5000, &columns, false), None),
    ] {
        let found = opened(&bytes, &TableOptions::default()).expect("a motion");
        assert!(found.has_second_axis());
        let found: Vec<MotionRow> = found.collect::<Result<_, _>>().expect("a motion");
        assert_rows(&found, 5000);
        for row in found {
            assert_eq!(row.position_y_m, row.velocity_mps);
            assert_eq!(row.velocity_y_mps, velocity_y_mps);
        }
        let message = error_of(&bytes);
        for part in ["two axes", "position_y_m"] {
            assert!(message.contains(part), "{message}");
        }
    }
    // A column that is named is the only one.
    let mut named = TableOptions::default();
    named.columns.position = Some("device_position_y_m".to_owned());
    let mut found = opened(table.as_bytes(), &named).expect("a motion");
    assert!(!found.has_second_axis());
    let found = found.nth(3).expect("a row").expect("a motion");
    assert_eq!(Some(found.position_m), row(3).velocity_mps);
}

#[test]
fn a_recording_in_csv_reads_up_to_its_last_newline() {
    let whole = "# hapticd recording 1\n# {\"server\":\"hapticd\"}\nt_s,device_position_m\n0.0,1.0\n# {\"mark\":\"lost\",\"rows\":2}\n0.003,2.0\n";
    assert_eq!(rows_of(whole.as_bytes()).expect("a motion").len(), 2);
    for torn in ["0.004,0.1", "0.004", "0"] {
        let rows = rows_of(format!("{whole}{torn}").as_bytes()).expect("a motion");
        assert_eq!(rows.last().map(|row| row.position_m), Some(2.0), "{torn}");
    }
    // Another program may leave the last newline out.
    assert_eq!(rows_of(b"t_s,position_m\n0,0\n1,1").expect("a motion").len(), 2);
    // Lines are those of the file.
    let error = error_of(format!("{whole}0.004,no\n").as_bytes());
    assert!(error.contains("line 7"), "{error}");
}

#[test]
fn an_mcap_that_was_broken_off_reads_up_to_its_last_whole_row() {
    let whole = mcap(500, SCHEMA, cdr);
    let mut before = 0;
    for length in (400..whole.len()).step_by(97) {
        let rows = rows_of(&whole[..length]).expect("what is there reads");
        assert_rows(&rows, rows.len().try_into().expect("few"));
        assert!(rows.len() >= before);
        before = rows.len();
    }
    assert!(before >= 400, "{before}");
}

#[test]
fn a_column_that_could_be_two_is_refused() {
    for (header, parts) in [
        (
            "t_s,position_m,device_position_m",
            vec!["`position_m`", "`device_position_m`"],
        ),
        (
            "t_s,position_m,velocity_mps,device_velocity_mps",
            vec!["`velocity_mps`", "`device_velocity_mps`"],
        ),
        ("t_s,position_m,position_m", vec!["2 columns `position_m`"]),
        ("t_s,x", vec!["`position_m` is missing", "device_position_m", "`t_s,x`"]),
        ("time,position_m", vec!["`t_s` is missing", "`time,position_m`"]),
        (
            "t_s,position_m,position_y_m,device_position_y_m",
            vec!["`position_y_m`", "`device_position_y_m`"],
        ),
    ] {
        let message = error_of(format!("# hapticd recording 1\n{header}\n0,0,0,0\n").as_bytes());
        for part in parts {
            assert!(message.contains(part), "{message} lacks {part}");
        }
    }
}

/// A recording in CSV with these rows of times and positions.
fn csv(rows: &str) -> Vec<u8> {
    format!("# hapticd recording 1\nt_s,position_m\n{rows}\n").into_bytes()
}

#[test]
fn what_is_not_a_motion_is_refused_by_its_row() {
    let integers = SCHEMA.replace("float64 t_s", "int64 t_s");
    let no_motion = "uint64 tick\nfloat64 x\n";
    let compressed = by_zstandard(parquet(3, COLUMNS, false));
    let at_once = |row| cdr(MotionRow { t_s: 1.0, ..row });
    let nowhere = |mut row: MotionRow| {
        row.position_m = f64::NAN;
        cdr(row)
    };
    for (bytes, parts) in [
        (mcap(3, &integers, cdr), vec!["`t_s`", "int64", "numbers"]),
        (mcap(3, no_motion, cdr), vec!["`t_s` is missing", "`tick,x`"]),
        (mcap(3, SCHEMA, nowhere), vec!["row 1", "device_position_m", "NaN"]),
        (mcap(3, SCHEMA, at_once), vec!["row 2", "t_s = 1 s"]),
        (mcap(3, SCHEMA, |row| cdr(row)[..20].to_vec()), vec!["row 1", "shorter"]),
        (mcap(3, SCHEMA, |_| vec![9]), vec!["row 1", "not in CDR"]),
        (parquet(2000, COLUMNS, true), vec!["row 10", "position_m = `NaN`"]),
        (
            parquet(2000, &COLUMNS.replace("t_s", "clock"), false),
            vec![
                "no time column among `tick,clock,position_m,velocity_mps`",
                "--time-column",
            ],
        ),
        (b"PAR1 and nothing else".to_vec(), vec!["Parquet"]),
        (compressed, vec!["compressed by zstd", "gzip", "pandas.read_parquet"]),
        (csv("0,inf"), vec!["line 3", "inf"]),
        (csv("0,2e12"), vec!["line 3", "2000000000000"]),
        (csv("0,0\n1"), vec!["line 4", "1 of 2 cells", "position_m"]),
        (csv("0,0,7"), vec!["line 3", "3 cells", "2 columns"]),
        (csv("0,0\n0,1"), vec!["line 4", "t_s = 0 s"]),
        (b"t_s,position_m\n0,2e12\n".to_vec(), vec!["line 2", "2000000000000"]),
        (
            b"t_s,position_m\n0,0\n1,one\n".to_vec(),
            vec!["line 3", "position_m = `one`"],
        ),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec(), vec!["not a table"]),
    ] {
        let message = error_of(&bytes);
        for part in parts {
            assert!(message.contains(part), "{message} lacks {part}");
        }
    }
    let missing = Rows::open(Path::new("/nowhere.csv")).err().expect("no file");
    let missing = missing.to_string();
    assert!(missing.contains("/nowhere.csv: No such file"), "{missing}");
}

#[test]
fn foreign_table_is_a_motion_by_its_names_and_units() {
    let line = |k: u8| {
        let block = if k == 7 { "NaN" } else { "0" };
        format!("{};{};{block}\n", 2 * k, f64::from(k) * 0.5).replace('.', ",")
    };
    let rows: String = (0..100).map(line).collect();
    let text = format!("Rig 7\nZeit;device_position;block_position_m\nms;mm;m\n{rows}");
    let found = opened(text.as_bytes(), &TableOptions::default()).expect("a motion");
    assert!(!found.notes().is_empty(), "{:?}", found.notes());
    let found: Vec<MotionRow> = found.collect::<Result<_, _>>().expect("a motion");
    assert!(found.iter().all(|row| row.velocity_mps.is_none()));
    assert_eq!(found.len(), 100);
    assert_eq!((found[3].t_s, found[3].position_m), (0.006, 0.0015));
    let options = TableOptions {
        position_gain: Some(1.0),
        ..TableOptions::default()
    };
    let row = opened(text.as_bytes(), &options).expect("a motion").nth(3);
    assert_eq!(row.expect("a row").expect("a motion").position_m, 1.5);
}

/// A gain of 0 would be a motion that stands still, and names that are not used would be taken for used ones.
#[test]
fn options_on_columns_are_used_or_refused() {
    let positions = |bytes: &[u8], options: &TableOptions| {
        let rows = opened(bytes, options)?.map(|row| row.map(|row| row.position_m));
        rows.collect::<Result<Vec<f64>, _>>()
    };
    let gain = |gain| TableOptions {
        position_gain: Some(gain),
        ..TableOptions::default()
    };
    for value in [0.0, f64::NAN, f64::INFINITY] {
        let error = positions(b"t_s,x\n0,1\n1,2\n", &gain(value)).expect_err("no gain");
        assert!(error.to_string().starts_with("--position-gain = "), "{error}");
    }
    let recording = "# hapticd recording 1\n# {}\nt_s,device_position_m,block_position_m\n0.0,1,5\n0.001,2,6\n0.002,3";
    let found = positions(recording.as_bytes(), &gain(2.0)).expect("a motion");
    assert_eq!(found, [2.0, 4.0]);
    let mut named = TableOptions::default();
    named.columns.position = Some("block_position_m".to_owned());
    let found = positions(recording.as_bytes(), &named).expect("a motion");
    assert_eq!(found, [5.0, 6.0]);
    let error = positions(&mcap(9, SCHEMA, cdr), &named).expect_err("no table");
    assert!(error.to_string().contains("cannot be named"), "{error}");
}

#[test]
fn nothing_follows_an_error() {
    let rows = opened(&csv("0,0\n1,no\n2,0"), &TableOptions::default()).expect("a motion");
    let found: Vec<bool> = rows.map(|row| row.is_ok()).collect();
    assert_eq!(found, [true, false]);
}

proptest! {
    #[test]
    fn no_damage_panics_a_reader(
        format in 0..4_usize,
        places in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        end in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let mut bytes = match format {
            0 => mcap(20, SCHEMA, cdr),
            1 => parquet(20, COLUMNS, false),
            2 => csv("0,0\n1,1\n2,4"),
            _ => b"time (ms);x [mm]\n0;0\n1;1\n2;4\n".to_vec(),
        };
        for (place, byte) in places {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if is_cut {
            bytes.truncate(end.index(bytes.len() + 1));
        }
        drop(rows_of(&bytes));
    }
}
