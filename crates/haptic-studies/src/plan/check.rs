//! What is wrong with a plan.

use super::super::trial::Case;

/// Largest ratio of the cursor's motion to the handle's.
pub(super) const MAX_GAIN: f64 = 100.0;

/// What is wrong with a plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// It is not TOML, or lacks a field, or has an unknown one.
    #[error("{0}")]
    Toml(String),
    /// A value is out of its range.
    #[error("{field} = {value}{unit} is out of range: {low}{unit} to {high}{unit}")]
    OutOfRange {
        /// The field.
        field: String,
        /// Its value.
        value: f64,
        /// Its unit, after a blank; empty where it has none.
        unit: &'static str,
        /// Smallest permitted value.
        low: f64,
        /// Largest permitted value.
        high: f64,
    },
    /// Two of a list have one name.
    #[error("{list}: duplicate name `{name}`")]
    Twice {
        /// The list.
        list: &'static str,
        /// The name.
        name: String,
    },
    /// A name that cannot stand in a table.
    #[error("{list}: the name `{name}` is empty, or has a line break or another control character in it")]
    Name {
        /// The list.
        list: &'static str,
        /// The name.
        name: String,
    },
    /// A list is empty.
    #[error("{0} is empty: at least one is needed")]
    Empty(&'static str),
    /// Too few levels for a threshold.
    #[error("{field}: different levels: {count}; the analysis needs at least {least}")]
    FewLevels {
        /// The field.
        field: String,
        /// How many there are.
        count: usize,
        /// How many are needed.
        least: usize,
    },
    /// A level is in a list twice.
    #[error("{field}: {level_n} N is there twice: trials_per_level says how often a level is tested")]
    LevelTwice {
        /// The field.
        field: String,
        /// The level, N.
        level_n: f64,
    },
    /// Something that is named nowhere.
    #[error("baseline = `{name}` is not the name of a resistance; there are {known}")]
    NoBaseline {
        /// The name.
        name: String,
        /// The resistances that there are.
        known: String,
    },
    /// Both, or none, of two fields of which there must be one.
    #[error("{place}: either `{one}` or `{other}` is needed, and not both")]
    OneOf {
        /// Where.
        place: String,
        /// The one.
        one: &'static str,
        /// The other.
        other: &'static str,
    },
    /// A staircase without an end.
    #[error("{0}: `stop_after_trials` or `stop_after_reversals` is needed")]
    NoEnd(String),
    /// A scene that cannot be rendered.
    #[error("{place}: {why}")]
    Scene {
        /// Where it stands.
        place: String,
        /// Why.
        why: String,
    },
    /// A target that the handle does not reach.
    #[error(
        "conditions.{condition}: its targets take {needs_m} m of the handle to either side of rig.center_m, and rig.range_m \
         leaves {has_m} m: {}", enough(*.gain)
    )]
    OutOfReach {
        /// The condition.
        condition: String,
        /// What its targets take, m.
        needs_m: f64,
        /// What there is, m.
        has_m: f64,
        /// The gain that would do; infinite where rig.center_m is an end of the range.
        gain: f64,
    },
    /// A comparison with less friction than none.
    #[error("case {case:?}: a level of {level_n} N leaves less friction than none: the base has {base_n} N")]
    TooLow {
        /// The case.
        case: Case,
        /// The level, N.
        level_n: f64,
        /// Friction of the base, N.
        base_n: f64,
    },
    /// A change of the static friction that is not felt.
    #[error(
        "case B: static_force = {static_n} N of the base is below its dynamic_force = {dynamic_n} N, at which the \
         block lets go: a higher static friction would be felt less than its level says"
    )]
    NotFelt {
        /// Static friction of the base, N.
        static_n: f64,
        /// Dynamic friction of the base, N.
        dynamic_n: f64,
    },
}

fn enough(gain: f64) -> String {
    if gain > MAX_GAIN {
        return "move rig.center_m towards the middle of rig.range_m".to_owned();
    }
    format!("raise rig.gain to {gain} or more")
}

/// Checks a number against its range.
pub(super) fn within(
    field: impl Into<String>,
    value: f64,
    low: f64,
    high: f64,
    unit: &'static str,
) -> Result<(), PlanError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(PlanError::OutOfRange {
        field: field.into(),
        value,
        unit,
        low,
        high,
    })
}

/// Checks that a list has something in it, and every name once.
pub(super) fn names<'a>(list: &'static str, names: impl Iterator<Item = &'a str>) -> Result<(), PlanError> {
    let mut seen: Vec<&str> = Vec::new();
    for name in names {
        if name.trim().is_empty() || name.contains(char::is_control) {
            let name = name.escape_debug().to_string();
            return Err(PlanError::Name { list, name });
        }
        if seen.contains(&name) {
            let name = name.to_owned();
            return Err(PlanError::Twice { list, name });
        }
        seen.push(name);
    }
    if seen.is_empty() {
        return Err(PlanError::Empty(list));
    }
    Ok(())
}
