//! A condition and its comparisons, read from text.

use super::field::{Field, Value};
use haptic_ipc::{RigState, Topic};
use std::fmt;
use std::str::FromStr;

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Condition {
    text: String,
    pub(super) comparisons: Vec<Comparison>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Comparison {
    pub(super) field: Field,
    operator: Operator,
    value: Value,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operator {
    Equal,
    NotEqual,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
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

/// The columns of a sample that are zero while no force may flow.
const ZERO_WITHOUT_FORCE: [&str; 5] = [
    "command_force_N",
    "coupling_force_N",
    "contact",
    "command_force_y_N",
    "coupling_force_y_N",
];

impl Condition {
    pub(crate) fn in_state(state: RigState) -> Self {
        Self {
            text: format!("state={state}"),
            comparisons: vec![Comparison {
                field: Field::State,
                operator: Operator::Equal,
                value: Value::Word(state.to_string()),
            }],
        }
    }

    /// The topics to subscribe to. The state is always one: it says that the rig is stopped.
    pub(crate) fn topics(&self) -> Vec<Topic> {
        let mut topics = vec![Topic::State];
        let wants = |wanted: fn(&Field) -> bool| self.comparisons.iter().any(|one| wanted(&one.field));
        if wants(|field| match field {
            Field::Sample(column) => *column != "revision",
            Field::SecondAxis(_) => true,
            _ => false,
        }) {
            topics.push(Topic::Samples);
        }
        if wants(|field| matches!(field, Field::Count(_))) {
            topics.push(Topic::Timing);
        }
        topics
    }

    /// Whether a rig of as many axes has all that it compares.
    ///
    /// # Errors
    /// The column that the rig lacks.
    pub(crate) fn check_axes(&self, axes: u8) -> Result<(), String> {
        let second = self.comparisons.iter().find_map(|one| match one.field {
            Field::SecondAxis(column) => Some(column),
            _ => None,
        });
        match second {
            Some(column) if axes == 1 => Err(format!("{column}: the rig has one axis, and this is of a second one")),
            _ => Ok(()),
        }
    }

    /// Whether it cannot hold while the rig is in this state, without force: it wants another state, or a force.
    pub(crate) fn is_ruled_out_by(&self, state: RigState) -> bool {
        self.comparisons.iter().any(|one| match one.field {
            Field::State => !one.matches_word(&state.to_string()),
            Field::Sample(column) | Field::SecondAxis(column) => {
                ZERO_WITHOUT_FORCE.contains(&column) && !one.number_holds(0.0)
            }
            _ => false,
        })
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

/// Reads a comparison; returns the rest of the text.
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
    let field: Field = name.parse()?;
    let rest = rest.trim_start();
    let (sign, operator) = *OPERATORS
        .iter()
        .find(|(sign, _)| rest.starts_with(sign))
        .ok_or_else(|| format!("`{name}` must be followed by = != < <= > or >=, and a value, as in state=engaged"))?;
    let rest = rest[sign.len()..].trim_start();
    let (word, rest) = word(rest)?;
    if word.is_empty() {
        return Err(format!("`{name}{sign}` must be followed by a value"));
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

impl Comparison {
    pub(super) fn matches_word(&self, found: &str) -> bool {
        let equal = match &self.value {
            Value::Word(word) => word == found,
            Value::Number(_) => false,
        };
        equal == (self.operator == Operator::Equal)
    }

    pub(super) fn number_holds(&self, found: f64) -> bool {
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

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in crate::condition) fn condition(text: &str) -> Condition {
        text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    #[test]
    fn only_what_is_needed_is_subscribed_to() {
        assert_eq!(condition("state=idle and revision>3").topics(), [Topic::State]);
        for text in ["contact=0", "device_position_y_m>2cm and contact=0"] {
            assert_eq!(condition(text).topics(), [Topic::State, Topic::Samples], "{text}");
        }
        assert_eq!(condition("overruns>3").topics(), [Topic::State, Topic::Timing]);
    }

    #[test]
    fn a_stopped_rig_rules_out_another_state_and_a_force() {
        for (text, ruled_out) in [
            ("state=engaged", true),
            ("state=stopped", false),
            ("state!=engaged", false),
            ("state!=stopped", true),
            ("contact=0", false),
            ("contact!=stuck", true),
            ("command_force_N>1N and revision>2", true),
            ("coupling_force_N<-1", true),
            ("command_force_y_N>1N", true),
            ("command_force_y_N<1N", false),
            ("command_force_N<1N", false),
            ("device_position_m>1cm", false),
        ] {
            assert_eq!(condition(text).is_ruled_out_by(RigState::Stopped), ruled_out, "{text}");
        }
    }

    #[test]
    fn a_malformed_condition_is_refused_with_the_reason() {
        for (text, part) in [
            ("", "FIELD=VALUE"),
            ("=engaged", "FIELD=VALUE"),
            ("state", "followed by ="),
            ("state=", "followed by a value"),
            ("state=asleep", "disconnected, idle, engaging"),
            ("engaged", "write state=engaged"),
            ("stuck", "write contact=stuck"),
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
