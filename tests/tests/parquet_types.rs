//! Tables in Parquet whose columns say by their types what their numbers stand for: they are not scaled again.

use parquet::basic::{Compression, GzipLevel};
use parquet::data_type::{DoubleType, FixedLenByteArray, FixedLenByteArrayType, Int32Type, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::sync::Arc;
use system_tests::{ctl_offline, plain};

/// The cells of a column, as they are stored.
enum Cells {
    Int32(Vec<i32>),
    Int64(Vec<i64>),
    Double(Vec<f64>),
    Bytes(Vec<FixedLenByteArray>),
}

/// A file of columns, each with its type and name.
fn parquet(compression: Compression, columns: [(&str, &Cells); 2]) -> Vec<u8> {
    let schema = columns.map(|(column, _)| format!("required {column};")).concat();
    let schema = parse_message_type(&format!("message table {{ {schema} }}")).expect("a schema");
    let properties = Arc::new(WriterProperties::builder().set_compression(compression).build());
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, Arc::new(schema), properties).expect("begun");
    let mut group = writer.next_row_group().expect("a group");
    for (_, cells) in columns {
        let mut column = group.next_column().expect("open").expect("as many as there are cells");
        match cells {
            Cells::Int32(cells) => column.typed::<Int32Type>().write_batch(cells, None, None),
            Cells::Int64(cells) => column.typed::<Int64Type>().write_batch(cells, None, None),
            Cells::Double(cells) => column.typed::<DoubleType>().write_batch(cells, None, None),
            Cells::Bytes(cells) => column.typed::<FixedLenByteArrayType>().write_batch(cells, None, None),
        }
        .expect("written");
        column.close().expect("closed");
    }
    group.close().expect("closed");
    writer.close().expect("ended");
    bytes
}

#[test]
fn a_motions_times_and_decimals_are_what_their_types_say() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("out.csv");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/simulated-friction.toml");
    let simulated = |name: &str, bytes: &[u8]| {
        let motion = directory.path().join(name);
        std::fs::write(&motion, bytes).expect("written");
        let simulate = [
            "simulate",
            scene,
            "--force",
            "--motion",
            plain(&motion),
            "--out",
            plain(&out),
        ];
        drop(ctl_offline(&simulate));
        std::fs::read_to_string(&out).expect("rows")
    };
    // Every 5 ms, to and fro by some millimetres, in steps of 0.1 um.
    let rows = || (0..400_i32).map(|k| (5 * k, 1000 * ((k % 40) - 20).abs()));
    let table: String = rows()
        .map(|(t_ms, x)| format!("{},{}\n", f64::from(t_ms) / 1e3, f64::from(x) / 1e7))
        .collect();
    let rows_of_csv = simulated("motion.csv", format!("t_s,position_m\n{table}").as_bytes());
    let times = |a_ms: i64| Cells::Int64(rows().map(|(t_ms, _)| i64::from(t_ms) * a_ms).collect());
    let positions = Cells::Double(rows().map(|(_, x)| f64::from(x) / 1e7).collect());
    let (none, gzip) = (Compression::UNCOMPRESSED, Compression::GZIP(GzipLevel::default()));
    for (compression, time, cells) in [
        (none, "int64 t_s (TIMESTAMP(NANOS,true))", times(1_000_000)),
        // Its type counts, and not its title.
        (
            Compression::SNAPPY,
            "int64 time_ms (TIMESTAMP(MICROS,false))",
            times(1000),
        ),
        (Compression::LZ4_RAW, "int64 t_s (TIMESTAMP_MILLIS)", times(1)),
        (
            none,
            "int32 t_s (TIME(MILLIS,true))",
            Cells::Int32(rows().map(|(t_ms, _)| t_ms).collect()),
        ),
        (gzip, "int64 t_s (DECIMAL(18,4))", times(10)),
    ] {
        let bytes = parquet(compression, [(time, &cells), ("double position_m", &positions)]);
        assert!(simulated("motion.parquet", &bytes) == rows_of_csv, "{time}: other rows");
    }
    // Where its type says nothing, its title does: by a factor, which may round.
    let bytes = parquet(none, [("int64 time_ms", &times(1)), ("double position_m", &positions)]);
    let rows_by_title = simulated("motion.parquet", &bytes);
    let times_of = |rows: &str| -> Vec<f64> {
        let time = |row: &str| row.split(',').next()?.parse().ok();
        rows.lines().filter_map(time).collect()
    };
    let (found, wanted) = (times_of(&rows_by_title), times_of(&rows_of_csv));
    assert_eq!((found.len(), wanted.len()), (400, 400), "rows");
    assert!(found.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-9));
    let bytes = |x: i32| FixedLenByteArray::from(i64::from(x).to_be_bytes().to_vec());
    for (position, cells) in [
        (
            "int64 position_m (DECIMAL(18,7))",
            Cells::Int64(rows().map(|(_, x)| x.into()).collect()),
        ),
        (
            "fixed_len_byte_array(8) position_m (DECIMAL(18,7))",
            Cells::Bytes(rows().map(|(_, x)| bytes(x)).collect()),
        ),
    ] {
        let columns = [("int64 t_s (TIMESTAMP(MILLIS,true))", &times(1)), (position, &cells)];
        let bytes = parquet(Compression::SNAPPY, columns);
        assert!(
            simulated("motion.parquet", &bytes) == rows_of_csv,
            "{position}: other rows"
        );
    }
}
