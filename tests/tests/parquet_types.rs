//! Tables in Parquet whose columns say by their types what their numbers stand for: they are not scaled again.

use crate::other_programs::Base;
use parquet::basic::{Compression, GzipLevel};
use parquet::data_type::{DoubleType, FixedLenByteArray, FixedLenByteArrayType, Int32Type, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::sync::Arc;
use system_tests::ctl_offline;

/// The cells of a column, as they are stored.
enum Cells {
    Int32(Vec<i32>),
    Int64(Vec<i64>),
    Double(Vec<f64>),
    Bytes(Vec<FixedLenByteArray>),
}

impl Cells {
    /// Whole numbers of a unit.
    #[expect(clippy::cast_possible_truncation, reason = "a record of seconds")]
    fn whole(values: impl Iterator<Item = f64>, unit: f64) -> Self {
        Self::Int64(values.map(|value| (value / unit).round() as i64).collect())
    }

    /// The same in 32 bits; those beyond 2^31 are stored as an unsigned number is.
    #[expect(clippy::cast_possible_truncation, reason = "its lower half is stored")]
    fn halved(self) -> Self {
        match self {
            Self::Int64(values) => Self::Int32(values.into_iter().map(|value| value as i32).collect()),
            other => other,
        }
    }

    /// The same as two's complements of 8 bytes, the highest first.
    fn bytes(self) -> Self {
        let bytes = |value: i64| FixedLenByteArray::from(value.to_be_bytes().to_vec());
        match self {
            Self::Int64(values) => Self::Bytes(values.into_iter().map(bytes).collect()),
            other => other,
        }
    }
}

/// A file of columns, each with its type and name.
fn parquet(compression: Compression, columns: &[(&str, Cells)]) -> Vec<u8> {
    let schema: String = columns
        .iter()
        .map(|(column, _)| format!("required {column};"))
        .collect();
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
    let base = Base::new();
    let out = base.put("out.csv", "");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/simulated-friction.toml");
    let simulated = |motion: &str| {
        let arguments = ["simulate", scene, "--motion", motion, "--out", &out, "--force"];
        drop(ctl_offline(&arguments));
        // A whole number has no negative zero.
        std::fs::read_to_string(&out).expect("rows").replace(",-0,", ",0,")
    };
    let plain = simulated(&base.put("plain.csv", base.plain()));
    let rows = || base.rows.iter();
    let times = |unit_s: f64| Cells::whole(rows().map(|[t, ..]| *t), unit_s);
    let positions = || {
        Cells::Double(
            rows()
                .map(|[_, x, _]| format!("{x:.7}").parse().expect("a number"))
                .collect(),
        )
    };
    let (none, gzip) = (Compression::UNCOMPRESSED, Compression::GZIP(GzipLevel::default()));
    for (compression, time, cells) in [
        (none, "int64 t_s (TIMESTAMP(NANOS,true))", times(1e-9)),
        // Its type counts, and not its title.
        (
            Compression::SNAPPY,
            "int64 time_ms (TIMESTAMP(MICROS,false))",
            times(1e-6),
        ),
        (Compression::LZ4_RAW, "int64 t_s (TIMESTAMP_MILLIS)", times(1e-3)),
        (none, "int32 t_s (TIME(MILLIS,true))", times(1e-3).halved()),
        (gzip, "int64 t_s (DECIMAL(18,4))", times(1e-4)),
    ] {
        let tables = [(time, cells), ("double position_m", positions())];
        let path = base.put("times.parquet", parquet(compression, &tables));
        assert!(simulated(&path) == plain, "{time}: other rows");
    }
    let whole = || Cells::whole(rows().map(|[_, x, _]| *x), 1e-7);
    for (position, cells) in [
        ("int64 position_m (DECIMAL(18,7))", whole()),
        ("fixed_len_byte_array(8) position_m (DECIMAL(18,7))", whole().bytes()),
    ] {
        let tables = [("int64 t_s (TIMESTAMP(MILLIS,true))", times(1e-3)), (position, cells)];
        let path = base.put("positions.parquet", parquet(Compression::SNAPPY, &tables));
        assert!(simulated(&path) == plain, "{position}: other rows");
    }
    // A title names another unit.
    let tables = [("int64 time_ms", times(1e-3)), ("double position_m", positions())];
    let other = simulated(&base.put("whole.parquet", parquet(Compression::SNAPPY, &tables)));
    let times = |rows: &str| -> Vec<f64> {
        let cells = rows.lines().skip(1).filter_map(|row| row.split(',').next());
        cells.map(|cell| cell.parse().expect("a time")).collect()
    };
    let (other, plain) = (times(&other), times(&plain));
    assert_eq!(other.len(), plain.len());
    assert!(
        other
            .iter()
            .zip(&plain)
            .all(|(other, plain)| (other - plain).abs() < 1e-9)
    );
}
