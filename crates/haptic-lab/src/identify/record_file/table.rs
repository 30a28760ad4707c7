//! A table of text or Parquet: a heading, and rows of numbers.

use super::columns::{Quantity, in_brackets};
use super::error::RecordFileError;
use super::layout::{Layout, Line, cells, lines, number, on_the_same_day};
use super::loaded::Loaded;
use super::parquet_table::ParquetTable;
use super::source::Source;
use super::times::{Times, retain};
use crate::identify::record::Record;
use crate::text::decoded;
use haptic_recording::Place;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Shortest time that two files must have in common, s.
const SHORTEST_COMMON_S: f64 = 1.0;

/// What is read of a file for its heading, bytes.
const LONGEST_HEAD_BYTES: u64 = 1 << 16;

/// Of all rows, one in so many may lack a number.
const ROWS_A_MISSING_ONE: usize = 20;

/// Slowest motion that times without a unit may be of, s between two rows: slower ones are not in seconds.
const SLOWEST_WITHOUT_UNIT_S: f64 = 0.5;

/// Columns of one file; times in seconds, growing.
#[derive(Debug, Default)]
struct Table {
    t_s: Vec<f64>,
    /// The columns asked for after the time; empty where an optional one is not there.
    values: Vec<Vec<f64>>,
    notes: Vec<String>,
    /// Where each row is in its file.
    places: Vec<Place>,
    /// Why the first row that lacks a number does.
    no_number: Option<RecordFileError>,
    is_time_of_day: bool,
    /// Whether the title of the times, or the file, says their unit.
    has_time_unit: bool,
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
    table.retain(&is_common);
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

/// The text of a file, up to a number of bytes.
fn text(path: &Path, most_bytes: u64) -> Result<String, RecordFileError> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(most_bytes).read_to_end(&mut bytes))
        .map_err(|source| RecordFileError::Open {
            path: path.to_path_buf(),
            source,
        })?;
    if bytes.is_empty() {
        return Err(RecordFileError::Empty {
            path: path.to_path_buf(),
            reason: "the file is empty".to_owned(),
        });
    }
    let text = decoded(&bytes).ok_or_else(|| RecordFileError::NotText {
        path: path.to_path_buf(),
    })?;
    // Lines of old programs end with a carriage return alone.
    Ok(if text.contains('\n') {
        text
    } else {
        text.replace('\r', "\n")
    })
}

/// The names of the columns.
pub(super) fn headings(path: &Path) -> Result<Vec<String>, RecordFileError> {
    if let Some(table) = ParquetTable::open(path)? {
        return Ok(table.names());
    }
    let text = text(path, LONGEST_HEAD_BYTES)?;
    let source = Source::new(path);
    layout(path, &lines(&text), &source).map(|layout| layout.titles)
}

fn layout(path: &Path, lines: &[Line<'_>], source: &Source) -> Result<Layout, RecordFileError> {
    let is_wanted = |title: &str| {
        Quantity::ALL
            .into_iter()
            .any(|quantity| match source.columns.named(quantity) {
                Some(name) => name == title,
                None => quantity.rank(title).is_some(),
            })
    };
    Layout::find(lines, &is_wanted).ok_or_else(|| RecordFileError::Empty {
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
        table.leave_out_no_numbers(quantities)?;
        table.time(path)?;
        Ok(table)
    }

    fn of_text(path: &Path, source: &Source, quantities: &[Quantity]) -> Result<Self, RecordFileError> {
        let text = text(path, u64::MAX)?;
        let lines = lines(&text);
        let Layout {
            separator,
            titles: names,
            units,
            data,
            ..
        } = layout(path, &lines, source)?;
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
        for Line { number, text, .. } in lines.into_iter().skip(data).filter(|line| !line.is_remark) {
            let row = cells(text, separator);
            let mut values = Vec::with_capacity(wanted.len());
            for column in &wanted {
                values.push(match column {
                    Some((place, unit)) => match value(path, number, &row, *place, &names[*place], separator) {
                        Ok(value) => Some(unit * value),
                        Err(error) => {
                            table.no_number.get_or_insert(error);
                            Some(f64::NAN)
                        }
                    },
                    None => None,
                });
            }
            table.push(Place::Line(number as u64), &values, text.contains(':'));
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
            let place = Place::Row(row as u64 + 1);
            if let Some(at) = values
                .iter()
                .position(|value| value.is_some_and(|value| !value.is_finite()))
            {
                table.no_number.get_or_insert_with(|| RecordFileError::NotANumber {
                    path: path.to_path_buf(),
                    place,
                    column: wanted[at].map_or_else(String::new, |(place, _)| names[place].clone()),
                    value: values[at].map_or_else(String::new, |value| value.to_string()),
                });
            }
            table.push(place, &values, false);
        }
        Ok(table)
    }

    /// An empty table, and the columns that go into it: the time and the others.
    fn new(
        headings: &Headings<'_>,
        source: &Source,
        quantities: &[Quantity],
    ) -> Result<(Self, Vec<WantedColumn>), RecordFileError> {
        let all: Vec<Quantity> = std::iter::once(Quantity::Time)
            .chain(quantities.iter().copied())
            .collect();
        headings.have(source, &all)?;
        let wanted = all
            .iter()
            .map(|quantity| headings.find(source, *quantity))
            .collect::<Result<Vec<_>, _>>()?;
        let names = &headings.names;
        let shown: Vec<String> = wanted
            .iter()
            .flatten()
            .map(|(place, unit)| match unit {
                1.0 => names[*place].clone(),
                unit => format!("{} (x {unit})", names[*place]),
            })
            .collect();
        let has_time_unit = wanted[0].is_some_and(|(place, _)| {
            headings.in_seconds.get(place).is_some_and(|is_so| *is_so)
                || Quantity::Time.names_unit(&headings.titles[place])
        });
        let table = Self {
            values: vec![Vec::new(); quantities.len()],
            notes: vec![format!("{}: columns {}", headings.path.display(), shown.join(", "))],
            has_time_unit: has_time_unit || source.time_unit_s.is_some(),
            ..Self::default()
        };
        Ok((table, wanted))
    }

    /// Takes a row: its time, and the values of the others.
    fn push(&mut self, place: Place, values: &[Option<f64>], is_time_of_day: bool) {
        let mut t_s = values[0].unwrap_or_default();
        if let Some(before) = self.t_s.last()
            && is_time_of_day
        {
            t_s = on_the_same_day(t_s, *before);
        }
        self.is_time_of_day |= is_time_of_day;
        self.t_s.push(t_s);
        self.places.push(place);
        for (column, number) in self.values.iter_mut().zip(&values[1..]) {
            column.extend(*number);
        }
    }

    /// Leaves out a column that may be missing and holds no numbers, and then rows without numbers, where they are few.
    fn leave_out_no_numbers(&mut self, quantities: &[Quantity]) -> Result<(), RecordFileError> {
        let Some(error) = self.no_number.take() else {
            return Ok(());
        };
        for (values, quantity) in self.values.iter_mut().zip(quantities) {
            let lacking = values.iter().filter(|value| !value.is_finite()).count();
            if *quantity == Quantity::Velocity && lacking * ROWS_A_MISSING_ONE > values.len() {
                self.notes.push(format!(
                    "the velocity column holds no number in {lacking} of {} rows: left out, it is only held against the \
                     positions",
                    values.len()
                ));
                values.clear();
            }
        }
        let columns = || {
            self.values
                .iter()
                .chain([&self.t_s])
                .filter(|values| !values.is_empty())
        };
        let keeps: Vec<bool> = (0..self.t_s.len())
            .map(|row| columns().all(|values| values[row].is_finite()))
            .collect();
        let lacking = keeps.iter().filter(|keeps| !**keeps).count();
        if lacking * ROWS_A_MISSING_ONE > keeps.len() {
            return Err(error);
        }
        if lacking > 0 {
            let first = keeps.iter().position(|keeps| !keeps).map(|row| self.places[row]);
            let first = first.map_or_else(String::new, |place| format!(", the first in {place}"));
            let rows = if lacking == 1 { "row lacks" } else { "rows lack" };
            self.notes
                .push(format!("{lacking} {rows} a number{first}: left out, as gaps"));
            self.retain(&keeps);
        }
        Ok(())
    }

    fn retain(&mut self, keeps: &[bool]) {
        for values in self.values.iter_mut().chain([&mut self.t_s]) {
            retain(values, keeps);
        }
        retain(&mut self.places, keeps);
    }

    /// Makes times of the stamps.
    fn time(&mut self, path: &Path) -> Result<(), RecordFileError> {
        let times = Times::of(&self.t_s, |row| self.places[row].to_string()).map_err(|disorder| {
            RecordFileError::TimeGoesBack {
                path: path.to_path_buf(),
                place: self.places[disorder.at],
                t_s: self.t_s[disorder.at],
                before_s: self.t_s[disorder.at.saturating_sub(1)],
                falls: disorder.falls,
            }
        })?;
        if !self.has_time_unit && !self.is_time_of_day && times.period_s > SLOWEST_WITHOUT_UNIT_S {
            return Err(RecordFileError::NoTimeUnit {
                path: path.to_path_buf(),
                first: self.t_s.first().copied().unwrap_or(0.0),
                step: times.period_s,
            });
        }
        let mut kept = times.kept.iter().peekable();
        let is_kept: Vec<bool> = (0..self.t_s.len())
            .map(|row| kept.next_if(|&&at| at == row).is_some())
            .collect();
        self.retain(&is_kept);
        self.notes.push(times.told());
        self.notes.extend(times.notes);
        self.t_s = times.t_s;
        Ok(())
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
            Quantity::Time => match self.in_seconds.get(place) {
                Some(true) => Some(1.0),
                _ => source.time_unit_s,
            },
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

    /// Whether all columns are there; every one that is missing is named.
    fn have(&self, source: &Source, quantities: &[Quantity]) -> Result<(), RecordFileError> {
        let missing: Vec<Quantity> = quantities
            .iter()
            .copied()
            .filter(|&quantity| quantity != Quantity::Velocity || source.columns.velocity.is_some())
            .filter(|&quantity| self.places(source, quantity).is_empty())
            .collect();
        let joined =
            |of: fn(Quantity) -> String, by: &str| missing.iter().map(|&one| of(one)).collect::<Vec<_>>().join(by);
        if missing.is_empty() {
            return Ok(());
        }
        Err(RecordFileError::MissingColumn {
            path: self.path.to_path_buf(),
            what: joined(|one| one.what().to_owned(), ", no "),
            option: joined(|one| one.option().to_owned(), ", "),
            header: self.titles.join(","),
            usual: joined(Quantity::usual, "; "),
        })
    }

    /// The places of the columns that are named, or have the likeliest name.
    fn places(&self, source: &Source, quantity: Quantity) -> Vec<usize> {
        let all = 0..self.names.len();
        let Some(name) = source.columns.named(quantity) else {
            let rank = |place: &usize| quantity.rank(&self.titles[*place]);
            let best = all.clone().filter_map(|place| rank(&place)).min();
            return all.filter(|place| best.is_some() && rank(place) == best).collect();
        };
        let named: Vec<usize> = all.filter(|place| self.names[*place] == name).collect();
        // A column is named by its place where no title says so.
        let by_place = name.parse::<usize>().ok().and_then(|place| place.checked_sub(1));
        match by_place.filter(|place| named.is_empty() && *place < self.names.len()) {
            Some(place) => vec![place],
            None => named,
        }
    }

    /// The place of the column that is named, or has a usual name; of a velocity perhaps none.
    fn place(&self, source: &Source, quantity: Quantity) -> Result<Option<usize>, RecordFileError> {
        match self.places(source, quantity)[..] {
            [] => Ok(None),
            [place] => Ok(Some(place)),
            ref several => Err(RecordFileError::AmbiguousColumn {
                path: self.path.to_path_buf(),
                what: quantity.what(),
                option: quantity.option(),
                candidates: several
                    .iter()
                    .map(|&place| format!("`{}` (column {})", self.titles[place], place + 1))
                    .collect::<Vec<_>>()
                    .join(", "),
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
