//! Parquet alone, read by the crate's own reader of rows as well.

use super::*;
use ::parquet::basic::{Compression, Encoding};
use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ::parquet::record::RowAccessor;
use bytes::Bytes;

fn rows(count: u64) -> Vec<Sample> {
    (1..=count).map(sample).collect()
}

#[test]
fn file_has_the_described_columns_encodings_and_keys() {
    let about = Metadata {
        notes: Some("a note".into()),
        ..metadata()
    };
    let (bytes, totals) = written(Format::Parquet, &about, &entries(&rows(5000)));
    assert_eq!(totals.bytes, bytes.len() as u64);
    let file = SerializedFileReader::new(Bytes::from(bytes)).expect("whole");
    let group = file.metadata().row_group(0);
    assert_eq!((file.metadata().num_row_groups(), group.num_rows()), (1, 5000));
    for (column, ours) in group.columns().iter().zip(columns(1)) {
        assert_eq!(column.column_path().string(), ours.name);
        assert_eq!(column.compression(), Compression::LZ4_RAW);
        let encodings: Vec<Encoding> = column.encodings().collect();
        let is_number = ["t_s", "_m", "_N", "_mps"].iter().any(|end| ours.name.ends_with(end));
        let wanted = match ours.name {
            "state" | "device_position_m" | "sample_position_m" => Encoding::RLE_DICTIONARY,
            _ if is_number => Encoding::BYTE_STREAM_SPLIT,
            _ => Encoding::DELTA_BINARY_PACKED,
        };
        assert!(encodings.contains(&wanted), "{}: {encodings:?}", ours.name);
    }
    let keys = file.metadata().file_metadata().key_value_metadata();
    let marks = r#"[[5000,{"mark":"end","rows":5000,"lost":0,"missed":0}]]"#;
    for (key, wanted) in [
        ("hapticd.version", "1"),
        ("hapticd.notes", "a note"),
        ("hapticd.loop_rate_hz", "1000.0"),
        ("hapticd.marks", marks),
    ] {
        let pair = keys.into_iter().flatten().find(|pair| pair.key == key);
        assert_eq!(pair.expect(key).value.as_deref(), Some(wanted));
    }
    let second = file.get_row_iter(None).expect("rows").nth(1).expect("a row");
    let second = second.expect("reads");
    assert_eq!(second.get_ulong(0).expect("the tick"), 2);
    assert_eq!(second.get_string(2).expect("the state"), "engaged");
    assert_eq!(second.get_byte(3).expect("the contact"), -1);
}

#[test]
fn what_is_killed_is_beside_it_and_reads_under_its_name() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("r.parquet");
    let spool = directory.path().join("r.parquet.partial.mcap");
    let mut writer = Writer::create(&path, &metadata(), false).expect("begun");
    assert_eq!(read(&path).expect("it is there at once").ending, Ending::Open);
    writer.rows(&rows(300), &[]).expect("written");
    // As a process that is killed.
    std::mem::forget(writer);
    let found = read(&path).expect("reads");
    assert_eq!((found.rows, found.ending), (rows(300), Ending::Open));
    let error = Writer::create(&path, &metadata(), false)
        .map(drop)
        .expect_err("it is there");
    assert!(error.to_string().contains("r.parquet.partial.mcap"), "{error}");
    let repaired = repair(&path, &path, true).expect("repaired");
    assert_eq!((repaired.totals.rows, repaired.dropped_bytes), (300, 0));
    assert!(!spool.exists());
    let found = read(&path).expect("reads");
    assert_eq!((found.rows.len(), found.ending), (300, Ending::Complete));
    assert_eq!(open(&path).expect("reads").format(), Format::Parquet);
    // One that replaces it begins again.
    let mut writer = Writer::create(&path, &metadata(), true).expect("begun");
    writer.rows(&rows(2), &[]).expect("written");
    assert_eq!(writer.break_off().expect("written").rows, 2);
    assert!(!spool.exists());
    assert_eq!(read(&path).expect("reads").ending, Ending::Open);
}

#[test]
fn what_does_not_go_over_stays_beside_it() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("r.parquet");
    let mut writer = Writer::create(&path, &metadata(), false).expect("begun");
    writer.rows(&rows(300), &[]).expect("written");
    writer.flush().expect("written");
    // The spool is damaged before its end is reached.
    let spool = directory.path().join("r.parquet.partial.mcap");
    let damaged = std::fs::read(&spool).expect("it is there");
    let row = damaged.windows(8).position(|bytes| bytes == 0.1_f64.to_le_bytes());
    let file = std::fs::OpenOptions::new().write(true).open(&spool).expect("opened");
    std::os::unix::fs::FileExt::write_all_at(&file, &[1], row.expect("a row") as u64).expect("written");
    let error = writer.finish().expect_err("it cannot be read").to_string();
    for part in ["checksum", "r.parquet.partial.mcap"] {
        assert!(error.contains(part), "{error}");
    }
    assert!(spool.exists());
    assert_eq!(std::fs::metadata(&path).expect("it is there").len(), 0);
}

#[test]
fn what_is_not_whole_is_refused() {
    let whole = written(Format::Parquet, &metadata(), &entries(&rows(3))).0;
    let error = read_bytes(&whole[..whole.len() - 1]).expect_err("no footer");
    assert!(error.to_string().contains("without its footer"), "{error}");
    let mut other = whole.clone();
    while let Some(place) = other.windows(8).position(|bytes| bytes == b"hapticd.") {
        other[place] = b'H';
    }
    let error = read_bytes(&other).expect_err("another program's").to_string();
    assert!(error.contains("hapticd did not write this Parquet file"), "{error}");
}
