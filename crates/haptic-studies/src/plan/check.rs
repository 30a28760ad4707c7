//! What is wrong with a plan.

/// What is wrong with a plan, with the field, its value and its limits.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct PlanError(pub(super) String);

/// Checks a number against its range. A unit stands after a blank.
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
    let field = field.into();
    Err(PlanError(format!(
        "{field} = {value}{unit} is out of range: {low}{unit} to {high}{unit}"
    )))
}

/// What says that there must be one of two fields.
pub(super) fn one_of(place: &str, one: &str, other: &str) -> PlanError {
    PlanError(format!("{place}: either `{one}` or `{other}` is needed, and not both"))
}

/// Checks that a list has something in it, and every name once.
pub(super) fn names<'a>(list: &'static str, names: impl Iterator<Item = &'a str>) -> Result<(), PlanError> {
    let mut seen: Vec<&str> = Vec::new();
    for name in names {
        if name.trim().is_empty() || name.contains(char::is_control) {
            let name = name.escape_debug();
            return Err(PlanError(format!(
                "{list}: the name `{name}` is empty, or has a line break or another control character in it"
            )));
        }
        if seen.contains(&name) {
            return Err(PlanError(format!("{list}: duplicate name `{name}`")));
        }
        seen.push(name);
    }
    if seen.is_empty() {
        return Err(PlanError(format!("{list} is empty: at least one is needed")));
    }
    Ok(())
}
