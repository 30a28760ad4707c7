//! A row of CSV, read cell by cell.

use crate::columns::{self, Kind, STATES};
use haptic_ipc::{Sample, SampleY};
use std::fmt::Display;

/// Reads a row of `columns` cells; those that a later version added are passed over.
///
/// # Errors
/// What is wrong with it.
pub(super) fn parse(text: &[u8], columns: usize, axes: u8) -> Result<(Sample, Option<SampleY>), String> {
    let text = std::str::from_utf8(text).map_err(|error| error.to_string())?;
    let (mut sample, mut y) = (Sample::default(), SampleY::default());
    let known = columns::columns(axes);
    let mut cells = text.split(',');
    for (index, column) in known.iter().take(columns).enumerate() {
        let cell = cells
            .next()
            .ok_or_else(|| format!("{index} cells of {columns}"))?
            .trim();
        let bits = bits(column.kind, cell).map_err(|error| format!("{} = `{cell}`: {error}", column.name))?;
        if !column.set(&mut sample, &mut y, bits) {
            return Err(format!("{} = `{cell}` is out of range", column.name));
        }
    }
    let cells = known.len().min(columns) + cells.count();
    if cells < columns {
        return Err(format!("{cells} cells of {columns}"));
    }
    Ok((sample, (axes == 2).then_some(y)))
}

fn bits(kind: Kind, cell: &str) -> Result<u64, String> {
    fn reason(error: impl Display) -> String {
        error.to_string()
    }
    match kind {
        Kind::U64 => cell.parse().map_err(reason),
        Kind::U32 => cell.parse::<u32>().map(u64::from).map_err(reason),
        Kind::F64 => cell.parse().map(f64::to_bits).map_err(reason),
        Kind::Contact => cell
            .parse::<i8>()
            .map(|contact| contact.cast_unsigned().into())
            .map_err(reason),
        Kind::State => STATES
            .iter()
            .position(|state| *state == cell)
            .map(|place| place as u64)
            .ok_or_else(|| "not a state".to_owned()),
    }
}
