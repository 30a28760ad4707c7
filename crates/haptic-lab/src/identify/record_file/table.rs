//! A file of text with a heading and rows of numbers.

use super::columns::{Quantity, in_brackets};
use super::layout::{Layout, cells, evened, number, on_the_same_day};
use super::{Loaded, RecordFileError, Source};
use crate::identify::Record;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Shortest time that two files must have in common, s.
const SHORTEST_COMMON_S: f64 = 1.0;

/// What is read of a file for its heading, bytes.
const LONGEST_HEAD_BYTES: u64 = 1 << 16;

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

/// The text of a file, up to so many bytes: UTF-8, UTF-16 with its mark, or Latin-1.
fn text(path: &Path, most_bytes: u64) -> Result<String, RecordFileError> {
    /// Bytes in which a file that is not text shows it.
    const BEGINNING: usize = 4096;
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(most_bytes).read_to_end(&mut bytes))
        .map_err(|source| RecordFileError::Open {
            path: path.to_path_buf(),
            source,
        })?;
    let pairs = |of: fn([u8; 2]) -> u16| {
        let units = bytes[2..].chunks_exact(2).map(|pair| of([pair[0], pair[1]]));
        char::decode_utf16(units)
            .map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect()
    };
    match bytes.get(..2) {
        None => Err(RecordFileError::Empty {
            path: path.to_path_buf(),
            reason: "the file is empty".to_owned(),
        }),
        Some([0xff, 0xfe]) => Ok(pairs(u16::from_le_bytes)),
        Some([0xfe, 0xff]) => Ok(pairs(u16::from_be_bytes)),
        Some(_) if bytes[..bytes.len().min(BEGINNING)].contains(&0) => Err(RecordFileError::NotText {
            path: path.to_path_buf(),
        }),
        Some(_) => {
            Ok(String::from_utf8(bytes)
                .unwrap_or_else(|error| error.into_bytes().into_iter().map(char::from).collect()))
        }
    }
}

/// The names of the columns.
pub(super) fn headings(path: &Path) -> Result<Vec<String>, RecordFileError> {
    let text = text(path, LONGEST_HEAD_BYTES)?;
    let (_, lines) = content(&text);
    let layout = layout(path, &lines)?;
    let names = cells(lines[layout.heading], layout.separator);
    Ok(names.into_iter().map(str::to_owned).collect())
}

/// The lines of a file that are no remarks, with their numbers from 1.
fn content(text: &str) -> (Vec<usize>, Vec<&str>) {
    text.trim_start_matches('\u{feff}')
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with(['#', '%']) && !line.starts_with("//"))
        .unzip()
}

fn layout(path: &Path, lines: &[&str]) -> Result<Layout, RecordFileError> {
    Layout::find(lines).ok_or_else(|| RecordFileError::Empty {
        path: path.to_path_buf(),
        reason: "there is no heading with rows of numbers below it, as in `t_s,position_m,force_N`".to_owned(),
    })
}

impl Table {
    fn read(path: &Path, source: &Source, quantities: &[Quantity]) -> Result<Self, RecordFileError> {
        let text = text(path, u64::MAX)?;
        let (numbers, lines) = content(&text);
        let layout = layout(path, &lines)?;
        let separator = layout.separator;
        let names = cells(lines[layout.heading], separator);
        let units = layout
            .units
            .map_or_else(Vec::new, |units| cells(lines[units], separator));
        let titles: Vec<String> = names
            .iter()
            .enumerate()
            .map(|(place, name)| match units.get(place).filter(|unit| !unit.is_empty()) {
                Some(unit) => format!("{name} [{}]", in_brackets(unit).unwrap_or(unit)),
                None => (*name).to_owned(),
            })
            .collect();
        let mut table = Self::default();
        let mut places = vec![find(path, source, Quantity::Time, &names, &titles)?];
        for quantity in quantities {
            places.push(find(path, source, *quantity, &names, &titles)?);
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
        for (line, text) in numbers.iter().zip(&lines).skip(layout.data) {
            let row = cells(text, separator);
            let mut values = Vec::with_capacity(places.len());
            for place in &places {
                values.push(match place {
                    Some((place, unit)) => Some(unit * value(path, *line, &row, *place, names[*place], separator)?),
                    None => None,
                });
            }
            let mut t_s = values[0].unwrap_or_default();
            if let Some(before) = table.t_s.last() {
                if text.contains(':') {
                    t_s = on_the_same_day(t_s, *before);
                }
                if t_s < *before {
                    return Err(RecordFileError::TimeGoesBack {
                        path: path.to_path_buf(),
                        line: *line,
                        t_s,
                        before_s: *before,
                    });
                }
            }
            table.t_s.push(t_s);
            for (column, number) in table.values.iter_mut().zip(&values[1..]) {
                column.extend(*number);
            }
        }
        table.even_out();
        Ok(table)
    }

    /// Makes rounded times even; else leaves out rows that repeat a time.
    fn even_out(&mut self) {
        if let Some((even, rounding_s)) = evened(&self.t_s) {
            self.t_s = even;
            self.notes.push(format!(
                "times are rounded to {:.3} ms: the rows are taken as even",
                1e3 * rounding_s
            ));
            return;
        }
        let grows: Vec<bool> = std::iter::once(true)
            .chain(self.t_s.windows(2).map(|pair| pair[1] > pair[0]))
            .collect();
        let repeated = grows.iter().filter(|grows| !**grows).count();
        if repeated == 0 {
            return;
        }
        for column in self.values.iter_mut().chain([&mut self.t_s]) {
            let mut grows = grows.iter();
            column.retain(|_| grows.next().copied().unwrap_or(false));
        }
        self.notes.push(format!(
            "{repeated} rows repeat the time of the row before, and are left out"
        ));
    }
}

/// Place and SI units a unit of a column; `None` where a velocity is not there.
fn find(
    path: &Path,
    source: &Source,
    quantity: Quantity,
    names: &[&str],
    titles: &[String],
) -> Result<Option<(usize, f64)>, RecordFileError> {
    let missing = || RecordFileError::MissingColumn {
        path: path.to_path_buf(),
        what: quantity.what(),
        option: quantity.option(),
        header: titles.join(","),
        usual: quantity.usual(),
    };
    let places: Vec<usize> = match source.columns.named(quantity) {
        Some(name) => (0..names.len()).filter(|place| names[*place] == name).collect(),
        None => {
            let rank = |place: &usize| quantity.rank(&titles[*place]);
            let best = (0..names.len()).filter_map(|place| rank(&place)).min();
            (0..names.len())
                .filter(|place| best.is_some() && rank(place) == best)
                .collect()
        }
    };
    let place = match places[..] {
        [place] => place,
        [] if quantity == Quantity::Velocity && source.columns.velocity.is_none() => return Ok(None),
        [] => return Err(missing()),
        [first, ..] => {
            return Err(RecordFileError::DoubledColumn {
                path: path.to_path_buf(),
                column: names[first].to_owned(),
                count: places.len(),
            });
        }
    };
    // A gain that is given is what a unit of the column is, whatever its name tells.
    let gain = match quantity {
        Quantity::Time => None,
        Quantity::Position | Quantity::Velocity => source.position_gain,
        Quantity::Force => source.force_gain,
    };
    let unit = gain.or_else(|| quantity.unit(&titles[place]));
    let unit = unit.or((quantity == Quantity::Velocity).then_some(1.0));
    match unit {
        Some(unit) => Ok(Some((place, unit))),
        None => Err(RecordFileError::UnknownUnit {
            path: path.to_path_buf(),
            column: titles[place].clone(),
            instead: quantity.instead_of_unit(),
        }),
    }
}

fn value(
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
    number(text, separator).ok_or_else(|| RecordFileError::NotANumber {
        path: path.to_path_buf(),
        line,
        column: column.to_owned(),
        value: (*text).to_owned(),
    })
}
