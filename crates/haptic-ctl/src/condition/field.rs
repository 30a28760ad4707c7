//! The fields that a condition can compare, and the values of each.

use haptic_core::ParameterKey;
use haptic_core::friction::LAWS;
use haptic_core::nearest::meant_or_semicolon;
use haptic_core::parameters::TABLE;
use haptic_ipc::{RigState, SAMPLE_COLUMNS, SAMPLE_Y_COLUMNS, TimingWindow};
use std::str::FromStr;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Field {
    State,
    Scene,
    Law,
    /// A column of a sample.
    Sample(&'static str),
    /// A column that a sample has on a rig of two axes.
    SecondAxis(&'static str),
    Count(usize),
    Parameter(ParameterKey),
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Word(String),
    Number(f64),
}

/// A name, and how its count is read.
type Count = (&'static str, fn(&TimingWindow) -> f64);

/// Counts since the loop began, sent once a second.
#[expect(clippy::cast_precision_loss, reason = "counts below 2^53")]
pub(super) const COUNTS: [Count; 3] = [
    ("overruns", |timing| timing.overruns as f64),
    ("missed_periods", |timing| timing.missed_periods as f64),
    ("telemetry_dropped", |timing| timing.telemetry_dropped as f64),
];

/// All fields but the parameters, for messages and help.
pub(crate) fn fields() -> String {
    let mut names = vec!["state", "scene", "law"];
    names.extend(SAMPLE_COLUMNS.iter().filter(|name| **name != "state"));
    names.extend(SAMPLE_Y_COLUMNS);
    names.extend(COUNTS.iter().map(|(name, _)| *name));
    names.join(", ")
}

/// The words that a field can have, as in a condition.
pub(crate) fn words(field: &str) -> Vec<String> {
    match field {
        "state" => RigState::ALL.map(|state| state.to_string()).to_vec(),
        "law" => LAWS.map(str::to_owned).to_vec(),
        "contact" => contacts()
            .map(|(word, _)| {
                if word.contains(' ') {
                    format!("'{word}'")
                } else {
                    word.to_owned()
                }
            })
            .to_vec(),
        _ => Vec::new(),
    }
}

impl FromStr for Field {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "state" => return Ok(Self::State),
            "scene" => return Ok(Self::Scene),
            "law" => return Ok(Self::Law),
            _ => {}
        }
        if let Some(column) = SAMPLE_COLUMNS.iter().find(|column| **column == name) {
            return Ok(Self::Sample(column));
        }
        if let Some(column) = SAMPLE_Y_COLUMNS.into_iter().find(|column| *column == name) {
            return Ok(Self::SecondAxis(column));
        }
        if let Some(count) = COUNTS.iter().position(|(count, _)| *count == name) {
            return Ok(Self::Count(count));
        }
        let is_value_of = |field: &&str| words(field).iter().any(|word| word.trim_matches('\'') == name);
        if let Some(field) = ["state", "law", "contact"].into_iter().find(is_value_of) {
            return Err(format!("`{name}` is not a field: write {field}={name}"));
        }
        name.parse().map(Self::Parameter).map_err(|_| {
            let fields = fields();
            let parameters = TABLE.iter().flat_map(|row| [row.name, row.symbol]);
            let known: Vec<&str> = fields.split(", ").chain(parameters).collect();
            format!(
                "unknown field `{name}`{} the fields are {fields}, and the parameters of the scene by name or symbol",
                meant_or_semicolon(name, &known)
            )
        })
    }
}

/// The unit of a column or count, from the end of its name; empty for a bare number.
fn unit(name: &str) -> &'static str {
    const UNITS: [(&str, &str); 5] = [("_m", "m"), ("_mps", "m/s"), ("_N", "N"), ("_s", "s"), ("_ns", "ns")];
    UNITS
        .iter()
        .find(|(ending, _)| name.ends_with(ending))
        .map_or("", |(_, unit)| unit)
}

/// A contact in words.
pub(crate) const fn contact(direction: i8) -> &'static str {
    match direction {
        0 => "stuck",
        1.. => "slides +",
        _ => "slides -",
    }
}

/// The words for a contact, with the numbers that a sample has for them.
fn contacts() -> [(&'static str, i8); 3] {
    [0, 1, -1].map(|direction| (contact(direction), direction))
}

/// A word of a field, if it is one of those that there are.
fn known_word(field: &str, word: &str, words: &[String]) -> Result<Value, String> {
    let known: Vec<&str> = words.iter().map(String::as_str).collect();
    if known.contains(&word) {
        return Ok(Value::Word(word.to_owned()));
    }
    Err(format!(
        "{field} = `{word}`: unknown {field}{} the {field}s are {}",
        meant_or_semicolon(word, &known),
        known.join(", ")
    ))
}

impl Field {
    pub(super) fn value(self, name: &str, word: &str) -> Result<Value, String> {
        match self {
            Self::State => known_word("state", word, &words("state")),
            Self::Law => known_word("law", word, &words("law")),
            Self::Scene => Ok(Value::Word(word.to_owned())),
            // Units are accepted here as well.
            Self::Parameter(_) => crate::units::value(name, word).map(Value::Number),
            Self::Sample("contact") => {
                let named = contacts().into_iter().find(|(known, _)| *known == word);
                let number = named.map_or_else(|| word.parse().ok(), |(_, direction)| Some(f64::from(direction)));
                number
                    .filter(|number| number.is_finite())
                    .map(Value::Number)
                    .ok_or_else(|| {
                        let words = contacts().map(|(word, _)| format!("`{word}`")).join(", ");
                        format!("{name} = `{word}` is not a finite number, nor one of {words}")
                    })
            }
            Self::Sample(_) | Self::SecondAxis(_) | Self::Count(_) => {
                crate::units::value_in(name, word, unit(name)).map(Value::Number)
            }
        }
    }
}
