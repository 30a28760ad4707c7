//! The plain types of fields: numbers, flags, texts and words.

use crate::error::WireError;
use crate::object::{Field, FieldValue, Limits};
use crate::{quantity, refusal};
use serde::de::value::StrDeserializer;
use serde::de::{self, DeserializeOwned};
use std::fmt;

impl<T: Field> Field for Option<T> {
    fn expected(name: &str, limits: Option<Limits>) -> String {
        T::expected(name, limits)
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        if given.text == "null" {
            return Ok(None);
        }
        T::read(given).map(Some)
    }
}

impl Field for bool {
    fn expected(_: &str, _: Option<Limits>) -> String {
        "true or false".to_owned()
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        given.json().ok_or_else(|| given.is_not("true or false"))
    }
}

impl Field for String {
    fn expected(_: &str, _: Option<Limits>) -> String {
        "a text in quotes".to_owned()
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        given.json().ok_or_else(|| given.is_not("a text in quotes"))
    }
}

impl Field for f64 {
    fn expected(name: &str, _: Option<Limits>) -> String {
        format!("a number of {}", unit(name))
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        let unit = unit(given.name);
        let Some(number) = given.json::<Self>() else {
            return Err(match given.text.parse::<Self>() {
                Ok(_) => refusal::too_large(&given.path(), given.name, given.text, unit),
                Err(_) => given.is_not(&Self::expected(given.name, None)),
            });
        };
        within(given, number, &quantity::number(number))?;
        Ok(number)
    }
}

impl Field for u64 {
    fn expected(name: &str, limits: Option<Limits>) -> String {
        match limits {
            Some(limits) => format!("a whole number {}", range(limits, unit(name))),
            None => "a whole number from 0 on".to_owned(),
        }
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        match given.json::<Self>() {
            #[expect(clippy::cast_precision_loss, reason = "limits are far below 2^53")]
            Some(number) => within(given, number as f64, given.text).map(|()| number),
            None if is_whole(given.text) => Err(beyond(given)),
            None => Err(given.is_not(&Self::expected(given.name, given.limits))),
        }
    }
}

impl Field for u32 {
    fn expected(name: &str, limits: Option<Limits>) -> String {
        u64::expected(name, limits)
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        Self::try_from(u64::read(given)?).map_err(|_| beyond(given))
    }
}

impl Field for usize {
    fn expected(name: &str, limits: Option<Limits>) -> String {
        u64::expected(name, limits)
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        Self::try_from(u64::read(given)?).map_err(|_| beyond(given))
    }
}

/// Refuses an unknown word; `kind` is the kind of such words, as in "topic".
pub(crate) fn word(given: &FieldValue<'_>, kind: &str, word: &str, known: &[&str]) -> Result<(), WireError> {
    if known.contains(&word) {
        return Ok(());
    }
    Err(refusal::unknown_word(&given.path(), given.name, kind, word, known))
}

/// The words of an enum, as serde lists them.
pub(crate) fn words<T: DeserializeOwned>() -> &'static [&'static str] {
    T::deserialize(StrDeserializer::new("")).map_or_else(|Words(known)| known, |_: T| &[])
}

/// The known words in serde's error about an unknown one.
#[derive(Debug)]
struct Words(&'static [&'static str]);

impl de::Error for Words {
    fn custom<T: fmt::Display>(_: T) -> Self {
        Self(&[])
    }

    fn unknown_variant(_: &str, known: &'static [&'static str]) -> Self {
        Self(known)
    }
}

impl std::error::Error for Words {}

impl fmt::Display for Words {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join(", "))
    }
}

/// The unit at the end of a field's name.
fn unit(name: &str) -> &'static str {
    match name.rsplit('_').next() {
        Some("ms") => "ms",
        Some("hz") => "Hz",
        Some("N") => "N",
        Some("m") => "m",
        _ => "1",
    }
}

fn range(limits: Limits, unit: &str) -> String {
    let unit = refusal::shown(unit);
    let zero = limits.zero.map_or_else(String::new, |what| format!(", or 0 {what}"));
    format!("from {} to {}{unit}{zero}", limits.min, limits.max)
}

fn within(given: &FieldValue<'_>, number: f64, shown: &str) -> Result<(), WireError> {
    let Some(limits) = given.limits else { return Ok(()) };
    let (min, max) = (f64::from(limits.min), f64::from(limits.max));
    if (min..=max).contains(&number) || (limits.zero.is_some() && number == 0.0) {
        return Ok(());
    }
    let unit = unit(given.name);
    let error = refusal::out_of_range(&given.path(), given.name, shown, unit, &range(limits, unit));
    Err(error.within(number, min, max, unit))
}

/// Refuses a whole number that its type cannot hold.
fn beyond(given: &FieldValue<'_>) -> WireError {
    let number = given.text.parse().unwrap_or(f64::NAN);
    if let Err(error) = within(given, number, given.text) {
        return error;
    }
    let range = format!("from 0 to {}", u64::MAX);
    #[expect(clippy::cast_precision_loss, reason = "the largest number there is")]
    let max = u64::MAX as f64;
    refusal::out_of_range(&given.path(), given.name, given.text, "1", &range).within(number, 0.0, max, "1")
}

/// Whether JSON's text of a number is that of a whole one, however long and of either sign.
pub(crate) fn is_whole(text: &str) -> bool {
    let digits = text.strip_prefix('-').unwrap_or(text);
    !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_digit())
}
