//! The words of a refusal: the field, its value, the limits, the unit, and a guess at what was
//! meant, in a sentence for people and in fields for programs.

use crate::error::{ErrorCode, WireError};
use haptic_core::nearest::meant_or_semicolon;

/// A value of the wrong type.
pub(crate) fn wrong_type(path: &str, name: &str, value: &str, expected: &str) -> WireError {
    let message = format!("{path} = {} is not {expected}", shortened(value));
    let error = WireError::new(ErrorCode::BadRequest, message).about(name);
    match value.parse::<f64>() {
        Ok(number) => error.given(number),
        Err(_) => error,
    }
}

/// A number outside of its limits, which `range` says.
pub(crate) fn out_of_range(path: &str, name: &str, value: &str, unit: &str, range: &str) -> WireError {
    let message = format!(
        "{path} = {}{} is out of range: it must be {range}",
        shortened(value),
        shown(unit)
    );
    WireError::new(ErrorCode::OutOfRange, message).about(name)
}

/// A number that a double cannot hold.
pub(crate) fn too_large(path: &str, name: &str, value: &str, unit: &str) -> WireError {
    let message = format!(
        "{path} = {}{} is out of range: it exceeds the largest number",
        shortened(value),
        shown(unit)
    );
    WireError::new(ErrorCode::BadRequest, message).about(name)
}

/// A field that is given twice, or a parameter under two names.
pub(crate) fn given_twice(name: &str) -> WireError {
    WireError::new(ErrorCode::GivenTwice, format!("{} is given twice", shortened(name))).about(name)
}

/// A required field that is missing.
pub(crate) fn missing(object: &str, name: &str, expected: &str) -> WireError {
    WireError::new(ErrorCode::BadRequest, format!("{object} lacks `{name}`: {expected}")).about(name)
}

/// Of fields that exclude each other none is given, or more than one.
pub(crate) fn not_one_of(object: &str, known: &[&str]) -> WireError {
    let message = format!("{object} must have either `{}`", known.join("` or `"));
    WireError::new(ErrorCode::BadRequest, message).about(known.first().copied().unwrap_or(object))
}

/// A field that the object does not have.
pub(crate) fn unknown_field(object: &str, name: &str, known: &[&str]) -> WireError {
    let (shown, meant) = (shortened(name), meant_or_semicolon(name, known));
    let has = if known.is_empty() {
        "its fields are `id` and `op`".to_owned()
    } else {
        format!("its fields are {}", known.join(", "))
    };
    let message = format!("`{object}` has no field `{shown}`{meant} {has}");
    WireError::new(ErrorCode::UnknownField, message).about(name)
}

/// An operation that does not exist.
pub(crate) fn unknown_operation(op: &str, known: &[&str]) -> WireError {
    let message = format!("unknown operation {}", unknown(op, "operations", known));
    WireError::new(ErrorCode::UnknownOp, message).about("op")
}

/// An unknown word of a kind, as in "unknown topic `weather`".
pub(crate) fn unknown_word(path: &str, name: &str, kind: &str, word: &str, known: &[&str]) -> WireError {
    let message = format!("{path}: unknown {kind} {}", unknown(word, &format!("{kind}s"), known));
    WireError::new(ErrorCode::BadRequest, message).about(name)
}

fn unknown(word: &str, kinds: &str, known: &[&str]) -> String {
    let meant = meant_or_semicolon(word, known);
    format!("`{}`{meant} the {kinds} are {}", shortened(word), known.join(", "))
}

/// A unit behind a number; a bare number has none.
pub(crate) fn shown(unit: &str) -> String {
    if unit == "1" { String::new() } else { format!(" {unit}") }
}

/// As much of a client's text as a message can hold.
fn shortened(text: &str) -> String {
    const MAX_CHARACTERS: usize = 80;
    match text.char_indices().nth(MAX_CHARACTERS) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
