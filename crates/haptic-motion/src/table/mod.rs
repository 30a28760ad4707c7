//! One reader of the tables of other programs, in text or Parquet: columns by name, units by gains, one model of time.
//!
//! A file of text has a heading, perhaps a line of units, then a row of numbers for each sample. Cells are separated by
//! commas, semicolons, tabs or spaces; lines of `#`, `%` or `//` and whatever a program writes above the heading are
//! remarks. A comma is a decimal point where it does not separate. Times may be times of day. Columns are found by
//! their usual names, or named; without a heading they are named by their numbers, from 1. A data frame in Parquet is
//! read as such a table, with numbers of any type and moments as times.

mod columns;
mod error;
mod layout;
mod parquet_table;
mod times;

pub use columns::{Columns, Quantity};
pub use error::TableError;
pub use parquet_table::ParquetTable;

use crate::error::Place;
use crate::opened::{Input, Opened, RECORDING_TITLE};
use crate::text::decoded;
use columns::in_brackets;
use layout::{Layout, TextLine, cells, lines, number, on_the_same_day};
use std::fmt::Display;
use std::io::Read;
use std::path::Path;
use times::{Disorder, Times, retain};

/// What is read of a file for its heading, bytes.
const MAX_HEAD_BYTES: u64 = 1 << 16;

/// Of all rows, one in so many may lack a number.
const ROWS_A_MISSING_ONE: usize = 20;

/// Slowest motion that times without a unit may be of, s between two rows: slower ones are not in seconds.
const SLOWEST_WITHOUT_UNIT_S: f64 = 0.5;

/// How a table is read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableOptions {
    /// Names of columns.
    pub columns: Columns,
    /// Newtons a unit of the force column; negative where the sensor points the other way. `None` for
    /// the unit in the column's name, or N.
    pub force_gain: Option<f64>,
    /// Metres a unit of the position column; `None` for the unit in the column's name, or m.
    pub position_gain: Option<f64>,
    /// Seconds a unit of the time column; `None` for the unit in the column's name, or s.
    pub time_unit_s: Option<f64>,
    /// Whether the motion is a device's: columns that say so are then likelier than others.
    pub is_of_device: bool,
}

impl TableOptions {
    /// Whether the gains can be.
    ///
    /// # Errors
    /// One is 0 or not finite; the error names its option.
    pub fn check_gains(&self) -> Result<(), TableError> {
        let gains = [
            ("--force-gain", self.force_gain),
            ("--position-gain", self.position_gain),
        ];
        let wrong = |value: &f64| !value.is_finite() || *value == 0.0;
        for (option, gain) in gains {
            if let Some(value) = gain.filter(wrong) {
                let reason = format!("{option} = {value} is not a finite number other than 0");
                return Err(TableError::Other(reason));
            }
        }
        Ok(())
    }
}

/// Columns of one file; times in seconds, growing.
#[derive(Debug, Default)]
pub struct Table {
    /// Times, s.
    pub t_s: Vec<f64>,
    /// The columns asked for after the time; empty where an optional one is not there.
    pub values: Vec<Vec<f64>>,
    /// Which columns were read, what was left out, and what the times are.
    pub notes: Vec<String>,
    /// Where each row is in its file.
    pub places: Vec<Place>,
    /// Where a second take begins, after a pause whose length is not known.
    pub second_take: Option<Place>,
    /// Why the first row that lacks a number does.
    no_number: Option<TableError>,
    is_time_of_day: bool,
    /// Whether the title of the times, or the file, says their unit.
    has_time_unit: bool,
}

/// The bytes of a file, up to a number of them.
fn bytes(path: &Path, input: Input, most: u64) -> Result<Vec<u8>, TableError> {
    let mut bytes = Vec::new();
    input
        .take(most)
        .read_to_end(&mut bytes)
        .map_err(|error| TableError::of(path, error))?;
    Ok(bytes)
}

/// The text that bytes of a file are.
fn text(path: &Path, bytes: &[u8]) -> Result<String, TableError> {
    if bytes.is_empty() {
        return Err(TableError::of(path, "the file is empty"));
    }
    let text =
        decoded(bytes).ok_or_else(|| TableError::of(path, "not a table: the file is neither text nor Parquet"))?;
    // Lines of old programs end with a carriage return alone.
    Ok(if text.contains('\n') {
        text
    } else {
        text.replace('\r', "\n")
    })
}

/// The names of the columns of a file; `None` for a recording of hapticd or MCAP, whose columns are known.
///
/// # Errors
/// It cannot be read, or has no heading.
pub fn headings(path: &Path) -> Result<Option<Vec<String>>, TableError> {
    match Opened::open(path)? {
        Opened::Parquet(table) => Ok(Some(table.names())),
        Opened::Text(input) => {
            let text = text(path, &bytes(path, input, MAX_HEAD_BYTES)?)?;
            layout(path, &lines(&text), &TableOptions::default()).map(|layout| Some(layout.titles))
        }
        _ => Ok(None),
    }
}

fn layout(path: &Path, lines: &[TextLine<'_>], options: &TableOptions) -> Result<Layout, TableError> {
    let is_wanted = |title: &str| {
        Quantity::ALL
            .into_iter()
            .any(|quantity| match options.columns.named(quantity) {
                Some(name) => name == title,
                None => quantity.rank(title).is_some(),
            })
    };
    Layout::find(lines, &is_wanted).ok_or_else(|| {
        let reason = "there is no heading with rows of numbers below it, as in `t_s,position_m,force_N`";
        TableError::of(path, reason)
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
    /// Reads the times and some quantities of a file; `path` is its name.
    ///
    /// # Errors
    /// A cell of it cannot be read, it has no columns to name, or one is missing; the error says where.
    pub fn read(
        path: &Path,
        file: Opened,
        options: &TableOptions,
        quantities: &[Quantity],
    ) -> Result<Self, TableError> {
        match file {
            Opened::Parquet(file) => Self::of_parquet(&file, options, quantities),
            Opened::Text(input) | Opened::CsvRecording(input) => {
                Self::of_text(path, &bytes(path, input, u64::MAX)?, options, quantities)
            }
            Opened::Mcap(_) | Opened::ParquetRecording(_) => Err(TableError::of(
                path,
                "the columns of a recording in MCAP or Parquet cannot be named, nor those of another MCAP file, and \
                 their units are known; `haptic-ctl recording export` makes CSV of a recording",
            )),
        }
    }

    fn of_text(path: &Path, bytes: &[u8], options: &TableOptions, quantities: &[Quantity]) -> Result<Self, TableError> {
        // The last number of a recording that was broken off may be half one.
        let is_recording = bytes.starts_with(RECORDING_TITLE.as_bytes());
        let end = bytes.iter().rposition(|byte| *byte == b'\n').filter(|_| is_recording);
        let text = text(path, end.map_or(bytes, |end| &bytes[..=end]))?;
        let lines = lines(&text);
        let Layout {
            separator,
            titles: names,
            units,
            data,
            ..
        } = layout(path, &lines, options)?;
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
        let (mut table, wanted) = Self::new(&headings, options, quantities)?;
        let names = headings.names;
        for TextLine { number, text, .. } in lines.into_iter().skip(data).filter(|line| !line.is_remark) {
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
            let time = wanted[0].and_then(|(place, _)| row.get(place));
            table.push(
                Place::Line(number as u64),
                &values,
                time.is_some_and(|cell| cell.contains(':')),
            );
        }
        table.finished(path, quantities)
    }

    fn of_parquet(file: &ParquetTable, options: &TableOptions, quantities: &[Quantity]) -> Result<Self, TableError> {
        let path = file.path();
        let names = file.names();
        let headings = Headings {
            path,
            titles: names.clone(),
            names,
            in_seconds: file.in_seconds(),
        };
        let (mut table, wanted) = Self::new(&headings, options, quantities)?;
        let names = headings.names;
        let columns = wanted
            .iter()
            .map(|column| column.map(|(place, unit)| Ok((file.column(place)?, unit))).transpose())
            .collect::<Result<Vec<_>, TableError>>()?;
        let rows = columns.iter().flatten().map(|(cells, _)| cells.len()).min();
        for row in 0..rows.unwrap_or(0) {
            let values: Vec<Option<f64>> = columns
                .iter()
                .map(|column| column.as_ref().map(|(cells, unit)| unit * cells[row]))
                .collect();
            let place = Place::Row(row as u64 + 1);
            let cells = wanted.iter().flatten().zip(values.iter().flatten());
            if let Some(((column, _), value)) = cells.into_iter().find(|(_, value)| !value.is_finite()) {
                let no_number = || not_a_number(path, place, &names[*column], value);
                table.no_number.get_or_insert_with(no_number);
            }
            table.push(place, &values, false);
        }
        table.finished(path, quantities)
    }

    /// An empty table, and the columns that go into it: the time and the others.
    fn new(
        headings: &Headings<'_>,
        options: &TableOptions,
        quantities: &[Quantity],
    ) -> Result<(Self, Vec<WantedColumn>), TableError> {
        let all: Vec<Quantity> = std::iter::once(Quantity::Time)
            .chain(quantities.iter().copied())
            .collect();
        headings.have(options, &all)?;
        let wanted = all
            .iter()
            .map(|quantity| headings.find(options, *quantity))
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
            has_time_unit: has_time_unit || options.time_unit_s.is_some(),
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
    fn leave_out_no_numbers(&mut self, quantities: &[Quantity]) -> Result<(), TableError> {
        let Some(error) = self.no_number.take() else {
            return Ok(());
        };
        for (values, quantity) in self.values.iter_mut().zip(quantities) {
            let lacking = values.iter().filter(|value| !value.is_finite()).count();
            if quantity.is_velocity() && lacking * ROWS_A_MISSING_ONE > values.len() {
                self.notes.push(format!(
                    "the {} column holds no number in {lacking} of {} rows: left out, it is only held against the \
                     positions",
                    quantity.what(),
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

    /// Leaves out the rows that are not kept.
    pub fn retain(&mut self, keeps: &[bool]) {
        for values in self.values.iter_mut().chain([&mut self.t_s]) {
            retain(values, keeps);
        }
        retain(&mut self.places, keeps);
    }

    fn finished(mut self, path: &Path, quantities: &[Quantity]) -> Result<Self, TableError> {
        self.leave_out_no_numbers(quantities)?;
        self.time(path)?;
        Ok(self)
    }

    /// Makes times of the stamps.
    fn time(&mut self, path: &Path) -> Result<(), TableError> {
        let times = Times::of(&self.t_s, |row| self.places[row].to_string()).map_err(|Disorder { at, falls }| {
            let (before_s, t_s) = (self.t_s[at.saturating_sub(1)], self.t_s[at]);
            let reason = format!(
                "time goes back from {before_s} s to {t_s} s, as it does {falls} times: no clock does that; name the \
                 time column with --time-column, or give the takes one by one"
            );
            TableError::at(path, self.places[at], reason)
        })?;
        if !self.has_time_unit && !self.is_time_of_day && times.period_s > SLOWEST_WITHOUT_UNIT_S {
            return Err(TableError::NoTimeUnit {
                path: path.to_path_buf(),
                first: self.t_s.first().copied().unwrap_or(0.0),
                step: times.period_s,
            });
        }
        self.second_take = times.second_take.map(|row| self.places[row]);
        let mut kept = times.kept.iter().peekable();
        let is_kept: Vec<bool> = (0..self.t_s.len())
            .map(|row| kept.next_if(|&&at| at == row).is_some())
            .collect();
        self.retain(&is_kept);
        self.notes.push(times.summary());
        self.notes.extend(times.notes);
        self.t_s = times.t_s;
        Ok(())
    }
}

impl Headings<'_> {
    /// Place and SI units a unit of a column; `None` where one that may be missing is not there.
    fn find(&self, options: &TableOptions, quantity: Quantity) -> Result<WantedColumn, TableError> {
        let Some(place) = self.place(options, quantity)? else {
            return Ok(None);
        };
        // A gain that is given is what a unit of the column is, whatever its name says.
        let gain = match quantity {
            Quantity::Time => match self.in_seconds.get(place) {
                Some(true) => Some(1.0),
                _ => options.time_unit_s,
            },
            Quantity::Position | Quantity::Velocity | Quantity::PositionY | Quantity::VelocityY => {
                options.position_gain
            }
            Quantity::Force => options.force_gain,
        };
        let unit = gain.or_else(|| quantity.unit(&self.titles[place]));
        let unit = unit.or(quantity.is_velocity().then_some(1.0));
        match unit {
            Some(unit) => Ok(Some((place, unit))),
            None => Err(TableError::UnknownUnit {
                path: self.path.to_path_buf(),
                column: self.titles[place].clone(),
                instead: quantity.instead_of_unit(),
            }),
        }
    }

    /// Whether all columns are there; every one that is missing is named.
    fn have(&self, options: &TableOptions, quantities: &[Quantity]) -> Result<(), TableError> {
        let missing: Vec<Quantity> = quantities
            .iter()
            .copied()
            .filter(|&quantity| !quantity.is_optional() || options.columns.named(quantity).is_some())
            .filter(|&quantity| self.places(options, quantity).is_empty())
            .collect();
        let joined =
            |of: fn(Quantity) -> String, by: &str| missing.iter().map(|&one| of(one)).collect::<Vec<_>>().join(by);
        if missing.is_empty() {
            return Ok(());
        }
        Err(TableError::MissingColumn {
            path: self.path.to_path_buf(),
            what: joined(|one| one.what().to_owned(), ", no "),
            option: joined(|one| one.option().to_owned(), ", "),
            header: self.titles.join(","),
            usual: joined(Quantity::usual, "; "),
        })
    }

    /// The places of the columns that are named, or have the likeliest name.
    fn places(&self, options: &TableOptions, quantity: Quantity) -> Vec<usize> {
        let all = 0..self.names.len();
        let Some(name) = options.columns.named(quantity) else {
            let is_other = |title: &str| options.is_of_device && !columns::is_of_device(title);
            let rank = |place: &usize| {
                let title = &self.titles[*place];
                quantity.rank(title).map(|rank| (is_other(title), rank))
            };
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

    /// The place of the column that is named, or has a usual name; of one that may be missing perhaps none.
    fn place(&self, options: &TableOptions, quantity: Quantity) -> Result<Option<usize>, TableError> {
        match self.places(options, quantity)[..] {
            [] => Ok(None),
            [place] => Ok(Some(place)),
            ref several => Err(TableError::AmbiguousColumn {
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
) -> Result<f64, TableError> {
    let place_in_file = Place::Line(line as u64);
    let Some(text) = row.get(place) else {
        let reason = format!("the row has {} cells, and none for {column}", row.len());
        return Err(TableError::at(path, place_in_file, reason));
    };
    number(text, separator).ok_or_else(|| not_a_number(path, place_in_file, column, text))
}

fn not_a_number(path: &Path, place: Place, column: &str, value: impl Display) -> TableError {
    TableError::at(path, place, format_args!("{column} = `{value}` is not a number"))
}
