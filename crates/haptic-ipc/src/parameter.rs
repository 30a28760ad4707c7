//! The value of a parameter: a number, or one for each direction.

use crate::error::WireError;
use crate::object::{FieldValue, Object};
use crate::{quantity, refusal};
use haptic_core::parameters::ParameterInfo;
use haptic_core::{Directional, ParameterKey};

/// Reads the value of the parameter that the field is named after, by name or symbol.
///
/// # Errors
/// There is no such parameter, or the value is not a number, nor a pair of them where a pair is
/// allowed.
pub(crate) fn read(given: &FieldValue<'_>, pair: bool) -> Result<Directional, WireError> {
    // The first unknown name ends it: a guess at what was meant takes time, a line has room for
    // thousands of names, and a stop may wait behind it.
    let info = given.name.parse::<ParameterKey>()?.parameter.info();
    if pair {
        if let Some(value) = given.json() {
            return Ok(value);
        }
        if let Some(directions) = Object::of(given) {
            directions.no_field_twice()?;
            let not_a_number = directions.values().find(|value| value.text.parse::<f64>().is_err());
            let text = not_a_number.map_or(given.text, |value| value.text);
            return Err(not_a_value(&FieldValue { text, ..*given }, info));
        }
    } else if let Some(value) = given.json::<f64>() {
        return Ok(Directional::both(value));
    }
    if given.text.parse::<f64>().is_err() {
        return Err(not_a_value(given, info));
    }
    let error = refusal::too_large(&given.path(), given.name, given.text, info.unit);
    Err(error.within(f64::INFINITY, info.min, info.max, info.unit))
}

fn not_a_value(given: &FieldValue<'_>, info: &ParameterInfo) -> WireError {
    let unit = info.unit;
    let mut error = given.is_not(&expected(unit, info.directional));
    if let Some(meant) = given
        .json::<String>()
        .and_then(|text| quantity::parse(&text, unit).ok())
    {
        error.message.push_str(&format!("; write {meant}"));
    }
    error
}

/// What a parameter takes.
pub(crate) fn expected(unit: &str, directional: bool) -> String {
    let number = if unit == "1" {
        "a number".to_owned()
    } else {
        format!("a number in {unit}")
    };
    if directional {
        format!(r#"{number}, or one for each direction as in {{"positive":5,"negative":3}}"#)
    } else {
        number
    }
}
