//! A table of text or Parquet: a heading, and rows of numbers.

use super::columns::{Quantity, in_brackets};
use super::error::RecordFileError;
use super::layout::{Layout, cells, evened, number, on_the_same_day};
use super::loaded::Loaded;
use super::parquet_table::ParquetTable;
use super::source::Source;
use crate::identify::record::Record;
use haptic_recording::Place;
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

/// The text of a file, up to a number of bytes: UTF-8, UTF-16 with its mark, or Latin-1.
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
            let text = String::from_utf8(bytes)
                .unwrap_or_else(|error| error.into_bytes().into_iter().map(char::from).collect());
            // Lines of old programs end with a carriage return alone.
            Ok(if text.contains('\n') {
                text
            } else {
                text.replace('\r', "\n")
            })
        }
    }
}

/// The names of the columns.
pub(super) fn headings(path: &Path) -> Result<Vec<String>, RecordFileError> {
    if let Some(table) = ParquetTable::open(path)? {
        return Ok(table.names());
    }
    let text = text(path, LONGEST_HEAD_BYTES)?;
    let (_, lines) = content(&text);
    Ok(names(&layout(path, &lines)?, &lines))
}

/// The titles of a file of text, or the numbers of its columns.
fn names(layout: &Layout, lines: &[&str]) -> Vec<String> {
    let row = |at: usize| cells(lines[at], layout.separator);
    match layout.heading {
        Some(heading) => row(heading).into_iter().map(str::to_owned).collect(),
        None => (1..=row(layout.data).len()).map(|number| number.to_string()).collect(),
    }
}

/// The lines of a file that are not remarks, with their numbers from 1.
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

/// A column that is wanted: its place, and SI units a unit of it.
type WantedColumn = Option<(usize, f64)>;

/// The columns of a file.
struct Headings<'a> {
    path: &'a Path,
    names: Vec<String>,
    /// The names, with the units of a line of units.
    titles: Vec<String>,
    /// Which are in s, whatever their titles say; empty for none.
    in_seconds: Vec<bool>,
}

impl Table {
    fn read(path: &Path, source: &Source, quantities: &[Quantity]) -> Result<Self, RecordFileError> {
        let mut table = match ParquetTable::open(path)? {
            Some(file) => Self::of_parquet(&file, path, source, quantities)?,
            None => Self::of_text(path, source, quantities)?,
        };
        table.even_out();
        Ok(table)
    }

    fn of_text(path: &Path, source: &Source, quantities: &[Quantity]) -> Result<Self, RecordFileError> {
        let text = text(path, u64::MAX)?;
        let (numbers, lines) = content(&text);
        let layout = layout(path, &lines)?;
        let separator = layout.separator;
        let names = names(&layout, &lines);
        let units = layout
            .units
            .map_or_else(Vec::new, |units| cells(lines[units], separator));
        let titles: Vec<String> = names
            .iter()
            .enumerate()
            .map(|(place, name)| match units.get(place).filter(|unit| !unit.is_empty()) {
                Some(unit) => format!("{name} [{}]", in_brackets(unit).unwrap_or(unit)),
                None => name.clone(),
            })
            .collect();
        let headings = Headings {
            path,
            names,
            titles,
            in_seconds: Vec::new(),
        };
        let (mut table, wanted) = Self::new(&headings, source, quantities)?;
        let names = headings.names;
        for (line, text) in numbers.iter().zip(&lines).skip(layout.data) {
            let row = cells(text, separator);
            let mut values = Vec::with_capacity(wanted.len());
            for column in &wanted {
                values.push(match column {
                    Some((place, unit)) => Some(unit * value(path, *line, &row, *place, &names[*place], separator)?),
                    None => None,
                });
            }
            table.push(path, Place::Line(*line as u64), &values, text.contains(':'))?;
        }
        Ok(table)
    }

    fn of_parquet(
        file: &ParquetTable,
        path: &Path,
        source: &Source,
        quantities: &[Quantity],
    ) -> Result<Self, RecordFileError> {
        let names = file.names();
        let headings = Headings {
            path,
            titles: names.clone(),
            names,
            in_seconds: file.in_seconds(),
        };
        let (mut table, wanted) = Self::new(&headings, source, quantities)?;
        let names = headings.names;
        let columns = wanted
            .iter()
            .map(|column| column.map(|(place, unit)| Ok((file.column(place)?, unit))).transpose())
            .collect::<Result<Vec<_>, RecordFileError>>()?;
        let rows = columns.iter().flatten().map(|(cells, _)| cells.len()).min();
        for row in 0..rows.unwrap_or(0) {
            let values: Vec<Option<f64>> = columns
                .iter()
                .map(|column| column.as_ref().map(|(cells, unit)| unit * cells[row]))
                .collect();
            if let Some(at) = values
                .iter()
                .position(|value| value.is_some_and(|value| !value.is_finite()))
            {
                return Err(RecordFileError::NotANumber {
                    path: path.to_path_buf(),
                    place: Place::Row(row as u64 + 1),
                    column: wanted[at].map_or_else(String::new, |(place, _)| names[place].clone()),
                    value: values[at].map_or_else(String::new, |value| value.to_string()),
                });
            }
            table.push(path, Place::Row(row as u64 + 1), &values, false)?;
        }
        Ok(table)
    }

    /// An empty table, and the columns that go into it: the time and the others.
    fn new(
        headings: &Headings<'_>,
        source: &Source,
        quantities: &[Quantity],
    ) -> Result<(Self, Vec<WantedColumn>), RecordFileError> {
        let mut wanted = vec![headings.find(source, Quantity::Time)?];
        for quantity in quantities {
            wanted.push(headings.find(source, *quantity)?);
        }
        let names = &headings.names;
        let shown: Vec<String> = wanted
            .iter()
            .flatten()
            .map(|(place, unit)| match unit {
                1.0 => names[*place].clone(),
                unit => format!("{} (x {unit})", names[*place]),
            })
            .collect();
        let table = Self {
            values: vec![Vec::new(); quantities.len()],
            notes: vec![format!("{}: columns {}", headings.path.display(), shown.join(", "))],
            ..Self::default()
        };
        Ok((table, wanted))
    }

    /// Takes a row: its time, and the values of the others.
    fn push(
        &mut self,
        path: &Path,
        place: Place,
        values: &[Option<f64>],
        is_time_of_day: bool,
    ) -> Result<(), RecordFileError> {
        let mut t_s = values[0].unwrap_or_default();
        if let Some(before) = self.t_s.last() {
            if is_time_of_day {
                t_s = on_the_same_day(t_s, *before);
            }
            if t_s < *before {
                return Err(RecordFileError::TimeGoesBack {
                    path: path.to_path_buf(),
                    place,
                    t_s,
                    before_s: *before,
                });
            }
        }
        self.t_s.push(t_s);
        for (column, number) in self.values.iter_mut().zip(&values[1..]) {
            column.extend(*number);
        }
        Ok(())
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

impl Headings<'_> {
    /// Place and SI units a unit of a column; `None` where a velocity is not there.
    fn find(&self, source: &Source, quantity: Quantity) -> Result<WantedColumn, RecordFileError> {
        let Some(place) = self.place(source, quantity)? else {
            return Ok(None);
        };
        // A gain that is given is what a unit of the column is, whatever its name says.
        let gain = match quantity {
            Quantity::Time => self.in_seconds.get(place).filter(|is_so| **is_so).map(|_| 1.0),
            Quantity::Position | Quantity::Velocity => source.position_gain,
            Quantity::Force => source.force_gain,
        };
        let unit = gain.or_else(|| quantity.unit(&self.titles[place]));
        let unit = unit.or((quantity == Quantity::Velocity).then_some(1.0));
        match unit {
            Some(unit) => Ok(Some((place, unit))),
            None => Err(RecordFileError::UnknownUnit {
                path: self.path.to_path_buf(),
                column: self.titles[place].clone(),
                instead: quantity.instead_of_unit(),
            }),
        }
    }

    /// The place of the column that is named, or has a usual name.
    fn place(&self, source: &Source, quantity: Quantity) -> Result<Option<usize>, RecordFileError> {
        let all = 0..self.names.len();
        let places: Vec<usize> = match source.columns.named(quantity) {
            Some(name) => all.filter(|place| self.names[*place] == name).collect(),
            None => {
                let rank = |place: &usize| quantity.rank(&self.titles[*place]);
                let best = all.clone().filter_map(|place| rank(&place)).min();
                all.filter(|place| best.is_some() && rank(place) == best).collect()
            }
        };
        match places[..] {
            [place] => Ok(Some(place)),
            [] if quantity == Quantity::Velocity && source.columns.velocity.is_none() => Ok(None),
            [] => Err(RecordFileError::MissingColumn {
                path: self.path.to_path_buf(),
                what: quantity.what(),
                option: quantity.option(),
                header: self.titles.join(","),
                usual: quantity.usual(),
            }),
            [first, ..] => Err(RecordFileError::DoubledColumn {
                path: self.path.to_path_buf(),
                column: self.names[first].clone(),
                count: places.len(),
            }),
        }
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
        place: Place::Line(line as u64),
        column: column.to_owned(),
        value: (*text).to_owned(),
    })
}
