//! The tidy rows of both studies, one a trial, and their CSV.
//!
//! A file may come from another program: columns that are not required may be missing, columns that are not
//! known are passed over, and the order is free. Lengths in m, times in s, forces in N.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};

/// Who did a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Operator {
    /// A person.
    Human,
    /// A model of one. Its trials say nothing about people.
    Simulated,
}

/// A valid click of the Fitts task, and the invalid ones before it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittsTrial {
    /// Who did it; a file from elsewhere need not tell.
    #[serde(default)]
    pub operator: Option<Operator>,
    /// Code of the subject.
    pub subject: String,
    /// Session of the subject, from 1.
    #[serde(default = "first")]
    pub session: u32,
    /// Segment of the subject's study, from 1.
    pub block: u32,
    /// Name of the resistance.
    pub resistance: String,
    /// Name of the condition: a pair of amplitude and width.
    pub condition: String,
    /// Trial of the segment, from 1.
    pub trial: u32,
    /// Direction of the movement along the rig's axis, +1 or -1.
    #[serde(default)]
    pub direction: Option<i8>,
    /// Distance between the targets' centres, m (> 0).
    pub amplitude_m: f64,
    /// Width of the target, m (> 0).
    pub width_m: f64,
    /// Diameter of the cursor, m (>= 0, below the width).
    #[serde(default)]
    pub cursor_diameter_m: Option<f64>,
    /// Cursor's centre at the valid click, from the target's centre, m: positive is overshoot, whichever way the
    /// movement went.
    pub end_error_m: f64,
    /// From the valid click before to this one, s (> 0).
    pub movement_time_s: f64,
    /// Invalid clicks before the valid one.
    pub errors: u32,
    /// Sizes of the invalid clicks added up, m (>= 0): each is how far the cursor's edge was outside the target's.
    #[serde(default)]
    pub error_size_m: Option<f64>,
    /// Tick at which the target became active.
    #[serde(default)]
    pub start_tick: Option<u64>,
    /// Tick of the valid click.
    #[serde(default)]
    pub end_tick: Option<u64>,
    /// Revision of the scene that was rendered.
    #[serde(default)]
    pub scene_revision: Option<u64>,
    /// Recording of the trial, a path from the study's folder.
    #[serde(default)]
    pub recording: Option<String>,
}

/// What a perception test changes of the base surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Case {
    /// Static and dynamic friction are higher.
    A,
    /// Static friction alone is higher.
    B,
    /// Static and dynamic friction are lower.
    C,
}

/// How a perception test chooses its levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Every level of a list equally often, in random order.
    Constant,
    /// The level follows the answers.
    Staircase,
}

/// A two-interval choice between the base surface and a comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PerceptionTrial {
    /// Who did it; a file from elsewhere need not tell.
    #[serde(default)]
    pub operator: Option<Operator>,
    /// Code of the subject.
    pub subject: String,
    /// Session of the subject, from 1.
    #[serde(default = "first")]
    pub session: u32,
    /// What the comparison changes.
    pub case: Case,
    /// How the level was chosen.
    pub method: Method,
    /// Trial of the subject's case, from 1.
    pub trial: u32,
    /// Static friction of the base, N (>= 0).
    #[serde(rename = "base_static_N")]
    pub base_static_n: f64,
    /// Dynamic friction of the base, N (>= 0).
    #[serde(rename = "base_dynamic_N")]
    pub base_dynamic_n: f64,
    /// Static friction of the comparison, N (>= 0).
    #[serde(rename = "comparison_static_N")]
    pub comparison_static_n: f64,
    /// Dynamic friction of the comparison, N (>= 0).
    #[serde(rename = "comparison_dynamic_N")]
    pub comparison_dynamic_n: f64,
    /// Size of the change, N (>= 0), whichever way it goes.
    #[serde(rename = "level_N")]
    pub level_n: f64,
    /// Whether the first interval had the comparison.
    pub comparison_first: bool,
    /// The interval, 1 or 2, that was said to have more friction.
    pub answer: u8,
    /// Whether it had.
    pub correct: bool,
    /// From the end of the second interval to the answer, s (>= 0).
    #[serde(default)]
    pub response_time_s: Option<f64>,
    /// Whether the staircase turned after this answer.
    #[serde(default)]
    pub reversal: bool,
    /// First tick of the first interval.
    #[serde(default)]
    pub start_tick: Option<u64>,
    /// Tick of the answer.
    #[serde(default)]
    pub end_tick: Option<u64>,
    /// Recording of the trial, a path from the study's folder.
    #[serde(default)]
    pub recording: Option<String>,
}

const fn first() -> u32 {
    1
}

/// A row that can be read and written.
pub trait Trial: Serialize + DeserializeOwned {
    /// The columns that are written.
    const COLUMNS: &'static [&'static str];

    /// The columns that a file must have.
    const REQUIRED: &'static [&'static str];

    /// Checks the values.
    ///
    /// # Errors
    /// A value is out of its range.
    fn check(&self) -> Result<(), OutOfRange>;
}

/// A value of a row that is out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{column} = {value}{unit} is out of range: {limit}")]
pub struct OutOfRange {
    /// The column.
    pub column: &'static str,
    /// Its value.
    pub value: String,
    /// Its unit, after a blank; empty where it has none.
    pub unit: &'static str,
    /// What it must be.
    pub limit: &'static str,
}

/// Why a file of trials cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// A required column is missing.
    #[error("no column `{0}`")]
    NoColumn(&'static str),
    /// A cell is not what its column holds.
    #[error("line {line}: {column} = `{value}`: {why}")]
    Cell {
        /// Line of the file, from 1.
        line: u64,
        /// The column's name.
        column: String,
        /// The cell.
        value: String,
        /// What is wrong with it.
        why: String,
    },
    /// A value is out of its range.
    #[error("line {line}: {source}")]
    OutOfRange {
        /// Line of the file, from 1.
        line: u64,
        /// Which, and its range.
        source: OutOfRange,
    },
    /// It is not CSV, or cannot be read or written.
    #[error(transparent)]
    Csv(#[from] csv::Error),
}

/// Reads the trials of a file.
///
/// # Errors
/// The file cannot be read, lacks a required column, or has a wrong cell.
pub fn read<T: Trial>(source: impl Read) -> Result<Vec<T>, TrialError> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(source);
    let header = reader.headers()?.clone();
    for column in T::REQUIRED {
        if !header.iter().any(|found| found == *column) {
            return Err(TrialError::NoColumn(column));
        }
    }
    let mut trials = Vec::new();
    for record in reader.records() {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        let trial: T = record
            .deserialize(Some(&header))
            .map_err(|error| wrong_cell(line, &header, &record, error))?;
        trial
            .check()
            .map_err(|source| TrialError::OutOfRange { line, source })?;
        trials.push(trial);
    }
    Ok(trials)
}

fn wrong_cell(line: u64, header: &csv::StringRecord, record: &csv::StringRecord, error: csv::Error) -> TrialError {
    let csv::ErrorKind::Deserialize { err, .. } = error.kind() else {
        return TrialError::Csv(error);
    };
    let Some(index) = err.field().and_then(|field| usize::try_from(field).ok()) else {
        return TrialError::Csv(error);
    };
    TrialError::Cell {
        line,
        column: header.get(index).unwrap_or_default().to_owned(),
        value: record.get(index).unwrap_or_default().to_owned(),
        why: err.kind().to_string(),
    }
}

/// Writes trials with their header. Numbers are written so that they read back exactly.
///
/// # Errors
/// They cannot be written.
pub fn write<T: Trial>(trials: &[T], sink: impl Write) -> Result<(), TrialError> {
    let mut writer = csv::Writer::from_writer(sink);
    for trial in trials {
        writer.serialize(trial)?;
    }
    writer.flush().map_err(csv::Error::from)?;
    Ok(())
}

/// A trial as a line of a file, with its end; before the first one stands the header.
///
/// # Errors
/// It cannot be written as CSV.
pub fn line<T: Trial>(trial: &T, with_header: bool) -> Result<Vec<u8>, TrialError> {
    let mut bytes = Vec::new();
    let mut writer = csv::WriterBuilder::new()
        .has_headers(with_header)
        .from_writer(&mut bytes);
    writer.serialize(trial)?;
    writer.flush().map_err(csv::Error::from)?;
    drop(writer);
    Ok(bytes)
}

fn check(
    is_right: bool,
    column: &'static str,
    value: &impl ToString,
    unit: &'static str,
    limit: &'static str,
) -> Result<(), OutOfRange> {
    if is_right {
        return Ok(());
    }
    let value = value.to_string();
    Err(OutOfRange {
        column,
        value,
        unit,
        limit,
    })
}

const POSITIVE: &str = "it must be above 0 and finite";
const NOT_NEGATIVE: &str = "it must be 0 or above, and finite";

fn positive(column: &'static str, value: f64, unit: &'static str) -> Result<(), OutOfRange> {
    check(value > 0.0 && value.is_finite(), column, &value, unit, POSITIVE)
}

fn not_negative(column: &'static str, value: f64, unit: &'static str) -> Result<(), OutOfRange> {
    check(value >= 0.0 && value.is_finite(), column, &value, unit, NOT_NEGATIVE)
}

fn named(column: &'static str, value: &str) -> Result<(), OutOfRange> {
    check(!value.is_empty(), column, &"``", "", "it must not be empty")
}

impl Trial for FittsTrial {
    const COLUMNS: &'static [&'static str] = &[
        "operator",
        "subject",
        "session",
        "block",
        "resistance",
        "condition",
        "trial",
        "direction",
        "amplitude_m",
        "width_m",
        "cursor_diameter_m",
        "end_error_m",
        "movement_time_s",
        "errors",
        "error_size_m",
        "start_tick",
        "end_tick",
        "scene_revision",
        "recording",
    ];

    const REQUIRED: &'static [&'static str] = &[
        "subject",
        "block",
        "resistance",
        "condition",
        "trial",
        "amplitude_m",
        "width_m",
        "end_error_m",
        "movement_time_s",
        "errors",
    ];

    fn check(&self) -> Result<(), OutOfRange> {
        named("subject", &self.subject)?;
        named("resistance", &self.resistance)?;
        named("condition", &self.condition)?;
        positive("amplitude_m", self.amplitude_m, " m")?;
        positive("width_m", self.width_m, " m")?;
        positive("movement_time_s", self.movement_time_s, " s")?;
        check(
            self.end_error_m.is_finite(),
            "end_error_m",
            &self.end_error_m,
            " m",
            "it must be finite",
        )?;
        if let Some(direction) = self.direction {
            check(direction.abs() == 1, "direction", &direction, "", "it must be 1 or -1")?;
        }
        if let Some(diameter) = self.cursor_diameter_m {
            not_negative("cursor_diameter_m", diameter, " m")?;
            check(
                diameter < self.width_m,
                "cursor_diameter_m",
                &diameter,
                " m",
                "it must be below width_m",
            )?;
        }
        self.error_size_m
            .map_or(Ok(()), |size| not_negative("error_size_m", size, " m"))
    }
}

impl Trial for PerceptionTrial {
    const COLUMNS: &'static [&'static str] = &[
        "operator",
        "subject",
        "session",
        "case",
        "method",
        "trial",
        "base_static_N",
        "base_dynamic_N",
        "comparison_static_N",
        "comparison_dynamic_N",
        "level_N",
        "comparison_first",
        "answer",
        "correct",
        "response_time_s",
        "reversal",
        "start_tick",
        "end_tick",
        "recording",
    ];

    const REQUIRED: &'static [&'static str] = &[
        "subject",
        "case",
        "method",
        "trial",
        "base_static_N",
        "base_dynamic_N",
        "comparison_static_N",
        "comparison_dynamic_N",
        "level_N",
        "comparison_first",
        "answer",
        "correct",
    ];

    fn check(&self) -> Result<(), OutOfRange> {
        named("subject", &self.subject)?;
        not_negative("base_static_N", self.base_static_n, " N")?;
        not_negative("base_dynamic_N", self.base_dynamic_n, " N")?;
        not_negative("comparison_static_N", self.comparison_static_n, " N")?;
        not_negative("comparison_dynamic_N", self.comparison_dynamic_n, " N")?;
        not_negative("level_N", self.level_n, " N")?;
        check(
            matches!(self.answer, 1 | 2),
            "answer",
            &self.answer,
            "",
            "it must be 1 or 2",
        )?;
        self.response_time_s
            .map_or(Ok(()), |time| not_negative("response_time_s", time, " s"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fitts_trial() -> FittsTrial {
        FittsTrial {
            operator: Some(Operator::Simulated),
            subject: "01".to_owned(),
            session: 1,
            block: 3,
            resistance: "high stiction".to_owned(),
            condition: "5".to_owned(),
            trial: 8,
            direction: Some(-1),
            amplitude_m: 0.45,
            width_m: 0.06,
            cursor_diameter_m: Some(0.006),
            end_error_m: -0.1 / 3.0,
            movement_time_s: 0.731,
            errors: 2,
            error_size_m: Some(0.0123),
            start_tick: Some(u64::MAX),
            end_tick: Some(1),
            scene_revision: Some(7),
            recording: Some("data/a, b.mcap".to_owned()),
        }
    }

    fn perception_trial() -> PerceptionTrial {
        PerceptionTrial {
            operator: None,
            subject: "s".to_owned(),
            session: 2,
            case: Case::C,
            method: Method::Staircase,
            trial: 1,
            base_static_n: 4.0,
            base_dynamic_n: 3.5,
            comparison_static_n: 3.0,
            comparison_dynamic_n: 2.5,
            level_n: 1.0,
            comparison_first: true,
            answer: 2,
            correct: true,
            response_time_s: Some(0.4),
            reversal: false,
            start_tick: None,
            end_tick: None,
            recording: None,
        }
    }

    fn reads_back<T: Trial + PartialEq + std::fmt::Debug + Clone>(trial: T) {
        let trials = vec![trial.clone(), trial];
        let mut whole = Vec::new();
        write(&trials, &mut whole).expect("written");
        let by_line = [line(&trials[0], true), line(&trials[1], false)].map(|line| line.expect("written"));
        assert_eq!(whole, by_line.concat());
        let header = String::from_utf8(whole.clone()).expect("text");
        assert!(header.starts_with(&format!("{}\n", T::COLUMNS.join(","))), "{header}");
        assert_eq!(read::<T>(&whole[..]).expect("read"), trials);
    }

    #[test]
    fn rows_read_back_to_the_last_bit() {
        reads_back(fitts_trial());
        reads_back(perception_trial());
    }

    const ELSEWHERE: &str =
        "trial,subject,block,resistance,condition,amplitude_m,width_m,end_error_m,movement_time_s,errors,mood\n";

    #[test]
    fn a_file_from_elsewhere_needs_the_required_columns_alone() {
        let text = format!("{ELSEWHERE}1, x7,2,drag,5,0.3,0.04,-0.006,0.612,1,fair\n");
        let read_back = read::<FittsTrial>(text.as_bytes()).expect("read");
        let [trial] = &read_back[..] else { panic!("one row") };
        assert_eq!((trial.subject.as_str(), trial.session, trial.operator), ("x7", 1, None));
        assert_eq!((trial.end_error_m, trial.errors), (-0.006, 1));
        assert_eq!(trial.direction, None);
    }

    #[test]
    fn a_wrong_file_is_told_by_line_column_value_and_limit() {
        for (row, message) in [
            (
                "1,x,2,drag,5,0.3,wide,0,0.6,1,",
                "line 2: width_m = `wide`: invalid float literal",
            ),
            (
                "1,x,2,drag,5,-0.3,0.04,0,0.6,1,",
                "line 2: amplitude_m = -0.3 m is out of range: it must be above 0 and finite",
            ),
            (
                "1,x,2,drag,5,0.3,0.04,NaN,0.6,1,",
                "line 2: end_error_m = NaN m is out of range: it must be finite",
            ),
            (
                "1,,2,drag,5,0.3,0.04,0,0.6,1,",
                "line 2: subject = `` is out of range: it must not be empty",
            ),
        ] {
            let error = read::<FittsTrial>(format!("{ELSEWHERE}{row}\n").as_bytes()).expect_err(row);
            assert_eq!(error.to_string(), message);
        }
        let error = read::<FittsTrial>(&b"subject,block\n1,2\n"[..]).expect_err("columns are missing");
        assert_eq!(error.to_string(), "no column `resistance`");
    }
}
