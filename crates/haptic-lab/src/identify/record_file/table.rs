//! A file of text with a heading and rows of numbers.

use super::columns::{Quantity, plain};
use super::{Loaded, RecordFileError, Source};
use crate::identify::Record;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Shortest time that two files must have in common, s.
const SHORTEST_COMMON_S: f64 = 1.0;

/// Longest line that is taken for a heading, bytes.
const LONGEST_HEADING: u64 = 1 << 16;

/// Columns of one file; times in seconds, growing.
#[derive(Debug, Default)]
struct Table {
    t_s: Vec<f64>,
    /// The columns asked for after the time; empty where an optional one is not there.
    values: Vec<Vec<f64>>,
    notes: Vec<String>,
}

/// Reads a file, or one of positions and another of forces.
pub(super) fn read(source: &Source) -> Result<Loaded, RecordFileError> {
    use Quantity::{Force, Position, Velocity};
    let Some(force_path) = &source.force_path else {
        let mut table = Table::read(&source.path, source, &[Position, Velocity, Force])?;
        let force_n = table.values.pop().unwrap_or_default();
        return Ok(loaded(table, force_n));
    };
    let mut forces = Table::read(force_path, source, &[Force])?;
    let mut table = Table::read(&source.path, source, &[Position, Velocity])?;
    let (begin, end) = common(&table.t_s, &forces.t_s);
    if end - begin < SHORTEST_COMMON_S {
        // Clocks that count from their own starts: the starts are taken as the same instant.
        let ahead = forces.t_s.first().unwrap_or(&0.0) - table.t_s.first().unwrap_or(&0.0);
        forces.t_s.iter_mut().for_each(|t| *t -= ahead);
        table.notes.push(format!(
            "the files have no time in common: the forces begin {ahead} s later, and are moved to the beginning"
        ));
    }
    let (begin, end) = common(&table.t_s, &forces.t_s);
    if end - begin < SHORTEST_COMMON_S {
        return Err(RecordFileError::Apart {
            path: source.path.clone(),
            force_path: force_path.clone(),
        });
    }
    let is_common: Vec<bool> = table.t_s.iter().map(|t| (begin..=end).contains(t)).collect();
    for values in table.values.iter_mut().chain([&mut table.t_s]) {
        let mut each = is_common.iter();
        values.retain(|_| each.next().copied().unwrap_or(false));
    }
    table.notes.append(&mut forces.notes);
    let force_n = at_times(&table.t_s, &forces.t_s, &forces.values[0]);
    Ok(loaded(table, force_n))
}

fn loaded(mut table: Table, force_n: Vec<f64>) -> Loaded {
    let velocity = table.values.pop().filter(|values| !values.is_empty());
    Loaded {
        record: Record {
            t_s: table.t_s,
            position_m: table.values.pop().unwrap_or_default(),
            velocity_mps: velocity,
            force_n,
            resolution_m: None,
        },
        offset_n: None,
        has_one_clock: false,
        notes: table.notes,
    }
}

/// The time that two records have in common, s.
fn common(a: &[f64], b: &[f64]) -> (f64, f64) {
    let of = |t: &[f64]| (t.first().copied().unwrap_or(0.0), t.last().copied().unwrap_or(0.0));
    let ((a_begin, a_end), (b_begin, b_end)) = (of(a), of(b));
    (a_begin.max(b_begin), a_end.min(b_end))
}

/// Values at other times. Where several lie between two of those, their mean: a faster recorder's noise is
/// not taken for its signal.
fn at_times(times: &[f64], t_s: &[f64], values: &[f64]) -> Vec<f64> {
    let mut next = 0;
    times
        .iter()
        .enumerate()
        .map(|(index, t)| {
            let half = |other: Option<&f64>| other.map_or(0.0, |other| (other - t).abs() / 2.0);
            let before = half(index.checked_sub(1).and_then(|before| times.get(before)));
            let low = t_s.partition_point(|other| *other < t - before);
            let high = t_s.partition_point(|other| *other < t + half(times.get(index + 1)));
            if high >= low + 2 {
                return values[low..high].iter().sum::<f64>() / (high - low) as f64;
            }
            while next + 2 < t_s.len() && t_s[next + 1] <= *t {
                next += 1;
            }
            let share = ((t - t_s[next]) / (t_s[next + 1] - t_s[next])).clamp(0.0, 1.0);
            values[next] + share * (values[next + 1] - values[next])
        })
        .collect()
}

/// What separates the cells of a heading.
fn separator(heading: &str) -> char {
    [';', '\t', ',']
        .into_iter()
        .find(|separator| heading.contains(*separator))
        .unwrap_or(' ')
}

fn cells(line: &str, separator: char) -> Vec<&str> {
    if separator == ' ' {
        line.split_whitespace().collect()
    } else {
        line.split(separator)
            .map(|cell| cell.trim().trim_matches('"'))
            .collect()
    }
}

/// The names of the columns.
pub(super) fn headings(path: &Path) -> Result<Vec<String>, RecordFileError> {
    let failed = |source| RecordFileError::Open {
        path: path.to_path_buf(),
        source,
    };
    let mut lines = BufReader::new(File::open(path).map_err(failed)?);
    let mut line = Vec::new();
    loop {
        line.clear();
        if (&mut lines)
            .take(LONGEST_HEADING)
            .read_until(b'\n', &mut line)
            .map_err(failed)?
            == 0
        {
            return Err(RecordFileError::Empty {
                path: path.to_path_buf(),
                reason: "there is no heading".to_owned(),
            });
        }
        let text = String::from_utf8_lossy(&line);
        let heading = text.trim_start_matches('\u{feff}').trim();
        if !heading.is_empty() && !heading.starts_with('#') {
            return Ok(cells(heading, separator(heading))
                .into_iter()
                .map(str::to_owned)
                .collect());
        }
    }
}

impl Table {
    fn read(path: &Path, source: &Source, quantities: &[Quantity]) -> Result<Self, RecordFileError> {
        let text = std::fs::read(path).map_err(|error| RecordFileError::Open {
            path: path.to_path_buf(),
            source: error,
        })?;
        let text = String::from_utf8_lossy(&text);
        let text = text.trim_start_matches('\u{feff}');
        let mut lines = text
            .lines()
            .enumerate()
            .map(|(index, line)| (index + 1, line.trim()))
            .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let empty = || RecordFileError::Empty {
            path: path.to_path_buf(),
            reason: "there is no heading, or no row below it".to_owned(),
        };
        let (_, heading) = lines.next().ok_or_else(empty)?;
        let separator = separator(heading);
        let names = cells(heading, separator);
        let mut table = Self::default();
        let mut places = vec![find(path, source, Quantity::Time, &names)?];
        for quantity in quantities {
            places.push(find(path, source, *quantity, &names)?);
        }
        table.notes.push(format!(
            "{}: columns {}",
            path.display(),
            places
                .iter()
                .flatten()
                .map(|(place, unit)| match unit {
                    1.0 => names[*place].to_owned(),
                    unit => format!("{} (x {unit})", names[*place]),
                })
                .collect::<Vec<_>>()
                .join(", ")
        ));
        table.values = vec![Vec::new(); quantities.len()];
        let mut repeated = 0_u64;
        for (line, text) in lines {
            let row = cells(text, separator);
            let mut numbers = Vec::with_capacity(places.len());
            for place in &places {
                numbers.push(match place {
                    Some((place, unit)) => Some(unit * number(path, line, &row, *place, names[*place], separator)?),
                    None => None,
                });
            }
            let t_s = numbers[0].unwrap_or_default();
            match table.t_s.last() {
                Some(before) if t_s < *before => {
                    return Err(RecordFileError::TimeGoesBack {
                        path: path.to_path_buf(),
                        line,
                        t_s,
                        before_s: *before,
                    });
                }
                Some(before) if t_s <= *before => {
                    repeated += 1;
                    continue;
                }
                _ => {}
            }
            table.t_s.push(t_s);
            for (column, number) in table.values.iter_mut().zip(&numbers[1..]) {
                column.extend(*number);
            }
        }
        if repeated > 0 {
            table.notes.push(format!(
                "{repeated} rows repeat the time of the row before, and are left out"
            ));
        }
        if table.t_s.is_empty() { Err(empty()) } else { Ok(table) }
    }
}

/// Place and SI units a unit of a column; `None` where a velocity is not there.
fn find(
    path: &Path,
    source: &Source,
    quantity: Quantity,
    names: &[&str],
) -> Result<Option<(usize, f64)>, RecordFileError> {
    let missing = || RecordFileError::MissingColumn {
        path: path.to_path_buf(),
        what: quantity.what(),
        option: quantity.option(),
        header: names.join(","),
        usual: quantity
            .usual()
            .iter()
            .map(|(name, _)| *name)
            .collect::<Vec<_>>()
            .join(", "),
    };
    let at = |name: &str, is_same: &dyn Fn(&str) -> bool| {
        let places: Vec<usize> = (0..names.len()).filter(|place| is_same(names[*place])).collect();
        match places[..] {
            [] => Ok(None),
            [place] => Ok(Some(place)),
            _ => Err(RecordFileError::DoubledColumn {
                path: path.to_path_buf(),
                column: name.to_owned(),
                count: places.len(),
            }),
        }
    };
    // A gain that is given is what a unit of the column is, whatever its name tells.
    let gain = match quantity {
        Quantity::Time => None,
        Quantity::Position | Quantity::Velocity => source.position_gain,
        Quantity::Force => source.force_gain,
    };
    if let Some(name) = source.columns.named(quantity) {
        let place = at(name, &|other| other == name)?.ok_or_else(missing)?;
        return Ok(Some((place, gain.unwrap_or_else(|| quantity.unit(&plain(name))))));
    }
    for (usual, unit) in quantity.usual() {
        if let Some(place) = at(usual, &|other| plain(other) == *usual)? {
            return Ok(Some((place, gain.unwrap_or(*unit))));
        }
    }
    if quantity == Quantity::Velocity {
        Ok(None)
    } else {
        Err(missing())
    }
}

fn number(
    path: &Path,
    line: usize,
    row: &[&str],
    place: usize,
    column: &str,
    separator: char,
) -> Result<f64, RecordFileError> {
    let Some(text) = row.get(place) else {
        return Err(RecordFileError::ShortRow {
            path: path.to_path_buf(),
            line,
            cells: row.len(),
            column: column.to_owned(),
        });
    };
    // Between semicolons and tabs a comma is a decimal point.
    let parsed = match separator {
        ';' | '\t' => text.replace(',', ".").parse::<f64>(),
        _ => text.parse::<f64>(),
    };
    parsed
        .ok()
        .filter(|value| value.is_finite())
        .ok_or_else(|| RecordFileError::NotANumber {
            path: path.to_path_buf(),
            line,
            column: column.to_owned(),
            value: (*text).to_owned(),
        })
}
