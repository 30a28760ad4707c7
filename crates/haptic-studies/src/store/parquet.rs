//! All trials of a study as Parquet, a column for each of the CSV. A column without any value is left out.

use super::super::trial::Trial;
use parquet::basic::Compression;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;
use serde_json::{Map, Value};
use std::fs::File;
use std::io;
use std::sync::Arc;

/// Writes trials.
pub(super) fn write<T: Trial>(trials: &[T], file: &mut File) -> io::Result<()> {
    let rows: Result<Vec<Map<String, Value>>, serde_json::Error> = trials
        .iter()
        .map(|trial| serde_json::from_value(serde_json::to_value(trial)?))
        .collect();
    write_rows(&rows?, file).map_err(io::Error::other)
}

fn write_rows(rows: &[Map<String, Value>], file: &mut File) -> Result<(), ParquetError> {
    let first = rows.first().cloned().unwrap_or_default();
    let columns: Vec<(&String, &Value)> = first
        .keys()
        .filter_map(|name| {
            let value = rows.iter().map(|row| &row[name]).find(|value| !value.is_null())?;
            Some((name, value))
        })
        .collect();
    let fields = columns
        .iter()
        .map(|(name, value)| format!("OPTIONAL {};", type_of(name, value)));
    let schema = parse_message_type(&format!("message trial {{ {} }}", fields.collect::<String>()))?;
    let properties = WriterProperties::builder()
        .set_compression(Compression::LZ4_RAW)
        .build();
    let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for (name, example) in &columns {
        let Some(mut column) = group.next_column()? else {
            continue;
        };
        let values: Vec<&Value> = rows.iter().map(|row| &row[name.as_str()]).collect();
        match example {
            Value::Bool(_) => put::<BoolType>(&mut column, &values, Value::as_bool)?,
            Value::Number(number) if number.is_f64() => put::<DoubleType>(&mut column, &values, Value::as_f64)?,
            Value::Number(_) => put::<Int64Type>(&mut column, &values, Value::as_i64)?,
            _ => put::<ByteArrayType>(&mut column, &values, |value| {
                value.as_str().map(|text| ByteArray::from(text.as_bytes().to_vec()))
            })?,
        }
        column.close()?;
    }
    group.close()?;
    writer.close()?;
    Ok(())
}

fn type_of(name: &str, value: &Value) -> String {
    match value {
        Value::Bool(_) => format!("BOOLEAN {name}"),
        Value::Number(number) if number.is_f64() => format!("DOUBLE {name}"),
        Value::Number(_) => format!("INT64 {name}"),
        _ => format!("BYTE_ARRAY {name} (STRING)"),
    }
}

fn put<D: DataType>(
    column: &mut SerializedColumnWriter<'_>,
    values: &[&Value],
    read: impl Fn(&Value) -> Option<D::T>,
) -> Result<(), ParquetError> {
    let cells: Vec<Option<D::T>> = values.iter().map(|value| read(value)).collect();
    let is_there: Vec<i16> = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    let there: Vec<D::T> = cells.into_iter().flatten().collect();
    column.typed::<D>().write_batch(&there, Some(&is_there), None)?;
    Ok(())
}
