//! Conditions on what the daemon reports: `state=engaged and device_position_m>0.01`.
//!
//! A condition is one or more comparisons joined by `and`; it holds when all of them do at once. A comparison is a field, one of `= != < <= > >=`, and a
//! number or a word; a word with spaces is put in quotes. Fields are those of a sample, the rig's and scene's state, the parameters of the
//! scene by name or symbol, and the counts of the loop.

use crate::watch;
use haptic_core::friction::LAWS;
use haptic_core::parameters::TABLE;
use haptic_core::{Directional, ParameterKey};
use haptic_ipc::{Event, RigState, Sample, StateEvent, TimingWindow, Topic, meant_or_semicolon};
use std::fmt;
use std::str::FromStr;

/// A condition.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Condition {
    text: String,
    comparisons: Vec<Comparison>,
}

#[derive(Clone, Debug, PartialEq)]
struct Comparison {
    field: Field,
    operator: Operator,
    value: Value,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Field {
    State,
    Scene,
    Law,
    Sample(usize),
    Count(usize),
    Parameter(ParameterKey),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Operator {
    Equal,
    NotEqual,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
}

#[derive(Clone, Debug, PartialEq)]
enum Value {
    State(RigState),
    Word(String),
    Number(f64),
}

/// Two-letter operators first: `<=` begins with `<`.
const OPERATORS: [(&str, Operator); 7] = [
    ("==", Operator::Equal),
    ("!=", Operator::NotEqual),
    ("<=", Operator::LessOrEqual),
    (">=", Operator::GreaterOrEqual),
    ("=", Operator::Equal),
    ("<", Operator::Less),
    (">", Operator::Greater),
];

type Read<T> = (&'static str, fn(&T) -> f64);

/// The columns of a sample that are numbers.
#[expect(clippy::cast_precision_loss, reason = "counts and durations below 2^53")]
const COLUMNS: [Read<Sample>; 13] = [
    ("tick", |sample| sample.tick as f64),
    ("t_s", |sample| sample.t_s),
    ("contact", |sample| f64::from(sample.contact)),
    ("device_position_m", |sample| sample.device_position_m),
    ("device_velocity_mps", |sample| sample.device_velocity_mps),
    ("block_position_m", |sample| sample.block_position_m),
    ("block_velocity_mps", |sample| sample.block_velocity_mps),
    ("coupling_force_N", |sample| sample.coupling_force_n),
    ("command_force_N", |sample| sample.command_force_n),
    ("revision", |sample| sample.revision as f64),
    ("wake_latency_ns", |sample| sample.wake_latency_ns as f64),
    ("tick_ns", |sample| sample.tick_ns as f64),
    ("device_round_trip_ns", |sample| sample.device_round_trip_ns as f64),
];

/// The place of the revision in [`COLUMNS`]; it is known of the state as well.
const REVISION: usize = 9;

/// The place of the contact in [`COLUMNS`]; it goes by words as well.
const CONTACT: usize = 2;

/// What is counted since the loop began, told once a second.
#[expect(clippy::cast_precision_loss, reason = "counts below 2^53")]
const COUNTS: [Read<TimingWindow>; 3] = [
    ("overruns", |timing| timing.overruns as f64),
    ("missed_periods", |timing| timing.missed_periods as f64),
    ("telemetry_dropped", |timing| timing.telemetry_dropped as f64),
];

/// All fields but the parameters, for messages and help.
pub(crate) fn fields() -> String {
    let mut names = vec!["state", "scene", "law"];
    names.extend(COLUMNS.iter().map(|(name, _)| *name));
    names.extend(COUNTS.iter().map(|(name, _)| *name));
    names.join(", ")
}

/// The words that a field can be, as a condition takes them.
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

impl Condition {
    /// That the rig is in a state.
    pub(crate) fn in_state(state: RigState) -> Self {
        Self {
            text: format!("state={state}"),
            comparisons: vec![Comparison {
                field: Field::State,
                operator: Operator::Equal,
                value: Value::State(state),
            }],
        }
    }

    /// What must be subscribed to. The state always is: it tells that the rig is stopped.
    pub(crate) fn topics(&self) -> Vec<Topic> {
        let mut topics = vec![Topic::State];
        let wants = |wanted: fn(&Field) -> bool| self.comparisons.iter().any(|one| wanted(&one.field));
        if wants(|field| matches!(field, Field::Sample(column) if *column != REVISION)) {
            topics.push(Topic::Samples);
        }
        if wants(|field| matches!(field, Field::Count(_))) {
            topics.push(Topic::Timing);
        }
        topics
    }

    /// Whether it speaks of the rig's state, and a rig in this one does not fulfil what it says of it.
    pub(crate) fn is_ruled_out_by(&self, state: RigState) -> bool {
        self.comparisons
            .iter()
            .filter(|one| one.field == Field::State)
            .any(|one| !one.word_holds(&state.to_string()))
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Condition {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut comparisons = Vec::new();
        let mut rest = text;
        loop {
            let (comparison, after) = comparison(rest)?;
            comparisons.push(comparison);
            let after = after.trim_start();
            if after.is_empty() {
                break;
            }
            rest = after
                .strip_prefix("and")
                .filter(|rest| rest.starts_with(char::is_whitespace))
                .ok_or_else(|| {
                    format!("`{after}`: comparisons are joined by `and`, and a value with spaces is quoted")
                })?;
        }
        Ok(Self {
            text: text.trim().to_owned(),
            comparisons,
        })
    }
}

/// Reads a comparison, and says what is left.
fn comparison(text: &str) -> Result<(Comparison, &str), String> {
    let text = text.trim_start();
    let ends = text
        .find(|letter: char| "=!<>".contains(letter) || letter.is_whitespace())
        .unwrap_or(text.len());
    let (name, rest) = text.split_at(ends);
    if name.is_empty() {
        return Err(format!(
            "`{text}` does not begin with a field: write FIELD=VALUE, as in state=engaged"
        ));
    }
    let field = field(name)?;
    let rest = rest.trim_start();
    let (sign, operator) = *OPERATORS
        .iter()
        .find(|(sign, _)| rest.starts_with(sign))
        .ok_or_else(|| format!("`{name}` is to be followed by = != < <= > or >=, and a value, as in state=engaged"))?;
    let rest = rest[sign.len()..].trim_start();
    let (word, rest) = word(rest)?;
    if word.is_empty() {
        return Err(format!("`{name}{sign}` is to be followed by a value"));
    }
    let value = field.value(name, word)?;
    let is_word = !matches!(value, Value::Number(_));
    if is_word && !matches!(operator, Operator::Equal | Operator::NotEqual) {
        return Err(format!("{name} is a word: it can be compared by = and != only"));
    }
    Ok((Comparison { field, operator, value }, rest))
}

fn word(text: &str) -> Result<(&str, &str), String> {
    if let Some(quote) = text.chars().next().filter(|first| "'\"".contains(*first)) {
        return text[1..]
            .split_once(quote)
            .ok_or_else(|| format!("the quote in `{text}` is not closed"));
    }
    Ok(text.split_at(text.find(char::is_whitespace).unwrap_or(text.len())))
}

fn field(name: &str) -> Result<Field, String> {
    match name {
        "state" => return Ok(Field::State),
        "scene" => return Ok(Field::Scene),
        "law" => return Ok(Field::Law),
        _ => {}
    }
    if let Some(column) = COLUMNS.iter().position(|(column, _)| *column == name) {
        return Ok(Field::Sample(column));
    }
    if let Some(count) = COUNTS.iter().position(|(count, _)| *count == name) {
        return Ok(Field::Count(count));
    }
    name.parse().map(Field::Parameter).map_err(|_| {
        let fields = fields();
        let parameters = TABLE.iter().flat_map(|row| [row.name, row.symbol]);
        let known: Vec<&str> = fields.split(", ").chain(parameters).collect();
        format!(
            "there is no field `{name}`{} there are {fields}, and the parameters of the scene by name or symbol",
            meant_or_semicolon(name, &known)
        )
    })
}

/// The unit of a column or count, which its name ends with; empty where it is a bare number.
fn unit(name: &str) -> &'static str {
    const UNITS: [(&str, &str); 5] = [("_m", "m"), ("_mps", "m/s"), ("_N", "N"), ("_s", "s"), ("_ns", "ns")];
    UNITS
        .iter()
        .find(|(ending, _)| name.ends_with(ending))
        .map_or("", |(_, unit)| unit)
}

/// The words for a contact, with the numbers that a sample has for them.
fn contacts() -> [(&'static str, i8); 3] {
    [0, 1, -1].map(|direction| (watch::contact(direction), direction))
}

impl Field {
    fn value(self, name: &str, word: &str) -> Result<Value, String> {
        match self {
            Self::State => RigState::ALL
                .into_iter()
                .find(|state| state.to_string() == word)
                .map(Value::State)
                .ok_or_else(|| {
                    let states = RigState::ALL.map(|state| state.to_string());
                    let known: Vec<&str> = states.iter().map(String::as_str).collect();
                    format!(
                        "state = `{word}`: there is no such state{} there are {}",
                        meant_or_semicolon(word, &known),
                        known.join(", ")
                    )
                }),
            Self::Law if !LAWS.contains(&word) => Err(format!(
                "law = `{word}`: there is no such law{} there are {}",
                meant_or_semicolon(word, &LAWS),
                LAWS.join(", ")
            )),
            Self::Scene | Self::Law => Ok(Value::Word(word.to_owned())),
            // A parameter may be given in its units here as well.
            Self::Parameter(_) => crate::units::value(name, word).map(Value::Number),
            Self::Sample(CONTACT) if contacts().iter().any(|(known, _)| *known == word) => {
                let found = contacts().into_iter().find(|(known, _)| *known == word);
                Ok(Value::Number(found.map_or(0.0, |(_, direction)| direction.into())))
            }
            Self::Sample(CONTACT) => word
                .parse()
                .ok()
                .filter(|number: &f64| number.is_finite())
                .map(Value::Number)
                .ok_or_else(|| {
                    let words = contacts().map(|(word, _)| format!("`{word}`")).join(", ");
                    format!("{name} = `{word}` is not a finite number, nor one of {words}")
                }),
            Self::Sample(_) | Self::Count(_) => crate::units::value_in(name, word, unit(name)).map(Value::Number),
        }
    }
}

impl Comparison {
    fn word_holds(&self, found: &str) -> bool {
        let equal = match &self.value {
            Value::State(state) => state.to_string() == found,
            Value::Word(word) => word == found,
            Value::Number(_) => false,
        };
        equal == (self.operator == Operator::Equal)
    }

    fn number_holds(&self, found: f64) -> bool {
        let Value::Number(wanted) = self.value else {
            return false;
        };
        match self.operator {
            Operator::Equal => found == wanted,
            Operator::NotEqual => found != wanted,
            Operator::Less => found < wanted,
            Operator::LessOrEqual => found <= wanted,
            Operator::Greater => found > wanted,
            Operator::GreaterOrEqual => found >= wanted,
        }
    }
}

/// What is known of the rig, from the events so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    pub(crate) state: Option<StateEvent>,
    sample: Option<Sample>,
    counts: Option<TimingWindow>,
}

impl Known {
    /// Takes an event, and says whether the condition holds after it, or after any sample in it. What is not known yet does not hold.
    pub(crate) fn take(&mut self, event: Event, condition: &Condition) -> bool {
        match event {
            Event::State(state) => self.state = Some(state),
            Event::Timing(timing) => self.counts = Some(timing.since_start),
            Event::Samples(samples) => {
                return samples.rows.into_iter().any(|row| {
                    self.sample = Some(row);
                    self.fulfils(condition)
                });
            }
            Event::Log(_) | Event::Unknown => return false,
        }
        self.fulfils(condition)
    }

    /// Whether all is known that the condition speaks of, and the rig's state.
    pub(crate) fn is_enough_for(&self, condition: &Condition) -> bool {
        self.state.is_some()
            && condition.topics().iter().all(|topic| match topic {
                Topic::Samples => self.sample.is_some(),
                Topic::Timing => self.counts.is_some(),
                Topic::State | Topic::Log => true,
            })
    }

    /// The newest tick that is known.
    pub(crate) fn tick(&self) -> Option<u64> {
        let of_state = self.state.as_ref().map(|state| state.tick);
        of_state.max(self.sample.map(|sample| sample.tick))
    }

    fn fulfils(&self, condition: &Condition) -> bool {
        condition
            .comparisons
            .iter()
            .all(|comparison| self.holds(comparison).unwrap_or(false))
    }

    fn holds(&self, comparison: &Comparison) -> Option<bool> {
        let state = self.state.as_ref();
        match comparison.field {
            // A sample's state and revision are those of its own tick, so that a condition is judged at one moment.
            Field::State => {
                let found = self
                    .sample
                    .map(|sample| sample.state)
                    .or(state.map(|state| state.state))?;
                Some(comparison.word_holds(&found.to_string()))
            }
            Field::Sample(REVISION) if self.sample.is_none() => {
                #[expect(clippy::cast_precision_loss, reason = "a count below 2^53")]
                let revision = state?.revision as f64;
                Some(comparison.number_holds(revision))
            }
            Field::Scene => Some(comparison.word_holds(&state?.scene)),
            Field::Law => Some(comparison.word_holds(&state?.law)),
            Field::Sample(column) => Some(comparison.number_holds(COLUMNS[column].1(&self.sample?))),
            Field::Count(count) => Some(comparison.number_holds(COUNTS[count].1(self.counts.as_ref()?))),
            Field::Parameter(key) => {
                let found: &Directional = state?.params.get(key.parameter.info().name)?;
                Some(match key.direction {
                    Some(direction) => comparison.number_holds(found.get(direction)),
                    None => comparison.number_holds(found.positive) && comparison.number_holds(found.negative),
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_ipc::{SAMPLE_COLUMNS, SamplesEvent};

    fn state(state: RigState, revision: u64) -> Event {
        let mut scene = haptic_core::Scene::paper();
        scene.name = "steel and ice".into();
        Event::State(StateEvent {
            state,
            fault: None,
            tick: 5,
            revision,
            scene: scene.name.clone(),
            law: "karnopp".into(),
            params: haptic_ipc::params_of(&scene),
            undo_depth: 0,
            redo_depth: 0,
        })
    }

    fn sample(position: f64, contact: i8) -> Sample {
        Sample {
            tick: 9,
            t_s: 0.009,
            state: RigState::Engaged,
            contact,
            device_position_m: position,
            device_velocity_mps: 0.0,
            block_position_m: 0.0,
            block_velocity_mps: 0.0,
            coupling_force_n: 0.0,
            command_force_n: 0.0,
            revision: 42,
            wake_latency_ns: 0,
            tick_ns: 0,
            device_round_trip_ns: 0,
            ..Sample::default()
        }
    }

    fn condition(text: &str) -> Condition {
        text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    #[test]
    fn every_column_of_a_sample_is_a_field() {
        for column in SAMPLE_COLUMNS {
            assert!(fields().split(", ").any(|field| field == *column), "{column}");
        }
        assert_eq!((COLUMNS[REVISION].0, COLUMNS[CONTACT].0), ("revision", "contact"));
    }

    #[test]
    fn a_condition_holds_when_all_of_it_does() {
        let after = |event: Event, text: &str| Known::default().take(event, &condition(text));
        for (text, holds) in [
            ("state=engaged", true),
            ("state == engaged", true),
            ("state!=engaged", false),
            ("state=engaged and revision>=42", true),
            ("state=engaged and revision>42", false),
            ("state = engaged and revision <= 42 and revision < 43", true),
            ("scene='steel and ice'", true),
            ("scene=\"steel and ice\" and law=karnopp", true),
            ("scene!='steel and ice'", false),
            ("mass=0.5", true),
            ("mass=500g and M<1", true),
            ("Fs>=4 and Fs+=4N", true),
            ("Fs->4", false),
            ("stribeck_velocity>=0", true),
            ("contact_stiffness>0", false),
        ] {
            assert_eq!(after(state(RigState::Engaged, 42), text), holds, "{text}");
        }
    }

    #[test]
    fn any_sample_of_a_batch_fulfils_it() {
        let batch = || {
            Event::Samples(SamplesEvent {
                seq: 0,
                dropped: 0,
                rows: vec![sample(0.0, 0), sample(0.02, 1), sample(0.0, -1)],
            })
        };
        for (text, holds) in [
            ("device_position_m>0.01", true),
            ("device_position_m>0.01 and contact=1", true),
            ("device_position_m>0.01 and contact=0", false),
            ("contact=-1", true),
            ("device_position_m>1cm and contact='slides +'", true),
            ("device_position_m>=20mm", true),
            ("device_position_m>3cm", false),
            ("t_s<10ms and contact!=stuck", true),
            ("state=engaged and contact=-1", true),
            ("overruns=0", false),
        ] {
            assert_eq!(Known::default().take(batch(), &condition(text)), holds, "{text}");
        }
    }

    #[test]
    fn only_what_is_needed_is_subscribed_to() {
        assert_eq!(condition("state=idle and revision>3").topics(), [Topic::State]);
        assert_eq!(condition("contact=0").topics(), [Topic::State, Topic::Samples]);
        assert_eq!(condition("overruns>3").topics(), [Topic::State, Topic::Timing]);
    }

    #[test]
    fn a_stopped_rig_rules_out_what_waits_for_another_state() {
        for (text, ruled_out) in [
            ("state=engaged", true),
            ("state=stopped", false),
            ("state!=engaged", false),
            ("state!=stopped", true),
            ("contact=0", false),
        ] {
            assert_eq!(condition(text).is_ruled_out_by(RigState::Stopped), ruled_out, "{text}");
        }
    }

    #[test]
    fn what_is_no_condition_is_refused_by_what_is_wrong() {
        for (text, part) in [
            ("", "FIELD=VALUE"),
            ("=engaged", "FIELD=VALUE"),
            ("state", "followed by ="),
            ("state=", "followed by a value"),
            ("state=asleep", "disconnected, idle, engaging"),
            ("state>idle", "= and != only"),
            ("colour=red", "device_position_m"),
            ("contact=red", "not a finite number, nor one of `stuck`, `slides +`"),
            ("tick>5m", "tick has no unit"),
            ("device_position_m>5N", "m, cm, mm or um"),
            ("tick_ns>1,000", "has a comma"),
            ("mas=1", "did you mean `mass`?"),
            ("contct=0", "did you mean `contact`?"),
            ("device_position>0", "did you mean `device_position_m`?"),
            ("state=engagd", "did you mean `engaged`?"),
            ("law=karnop", "did you mean `karnopp`?"),
            ("t_s>inf", "not a finite number"),
            ("mass>5N", "kg, g or mg"),
            ("state=idle or contact=0", "joined by `and`"),
            ("state=idle and", "joined by `and`"),
            ("state=idle andcontact=0", "joined by `and`"),
            ("scene='steel", "not closed"),
        ] {
            let error = text.parse::<Condition>().expect_err(text);
            assert!(error.contains(part), "{text}: {error} lacks {part}");
        }
    }
}
