//! Numbers as people type them: `500g`, `2 mm/s`, `25 N/mm`.
//!
//! A bare number is in the SI unit of the parameter table. A unit must measure the same quantity.

use haptic_core::nearest::{nearest, suggestion};
use haptic_core::parameters::TABLE;
use thiserror::Error;

/// A unit that is accepted, and the power of ten that turns it into the SI unit.
type Accepted = (&'static str, i32);

/// For each unit of the parameter table and of a sample, the units accepted in its place, without
/// spaces.
const UNITS: &[(&str, &[Accepted])] = &[
    ("kg", &[("kg", 0), ("g", -3), ("mg", -6)]),
    ("N", &[("N", 0), ("mN", -3), ("kN", 3)]),
    ("m/s", &[("m/s", 0), ("cm/s", -2), ("mm/s", -3), ("um/s", -6)]),
    (
        "N s/m",
        &[
            ("Ns/m", 0),
            ("Ns/cm", 2),
            ("Ns/mm", 3),
            ("mNs/m", -3),
            ("mNs/mm", 0),
            ("kg/s", 0),
        ],
    ),
    (
        "N/m",
        &[
            ("N/m", 0),
            ("N/cm", 2),
            ("N/mm", 3),
            ("N/um", 6),
            ("mN/mm", 0),
            ("kN/m", 3),
        ],
    ),
    ("1/s", &[("1/s", 0), ("/s", 0), ("Hz", 0), ("1/ms", 3)]),
    ("Hz", &[("Hz", 0), ("kHz", 3)]),
    ("1", &[("%", -2)]),
    ("m", &[("m", 0), ("cm", -2), ("mm", -3), ("um", -6)]),
    ("s", &[("s", 0), ("ms", -3), ("us", -6), ("ns", -9)]),
    ("ns", &[("ns", 0), ("us", 3), ("ms", 6), ("s", 9)]),
];

/// Why a text is not a quantity.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum BadQuantity {
    /// It does not begin with a number, or with one that no computer holds.
    #[error("`{text}` is not a finite number")]
    NotANumber {
        /// What was given.
        text: String,
    },
    /// It has a comma, which would be a decimal point to some and separate thousands to others.
    #[error("`{text}` has a comma: write a decimal point, and no separator between thousands")]
    Comma {
        /// What was given.
        text: String,
    },
    /// Its unit measures something else.
    #[error("`{given}` is not a unit of this{} give {accepted}", suggestion(*.meant))]
    WrongUnit {
        /// The unit given.
        given: String,
        /// The units accepted, as a list for people.
        accepted: String,
        /// The one that was probably meant.
        meant: Option<&'static str>,
    },
}

/// Reads a number with or without a unit, and gives it in `si`, a unit of the parameter table or of
/// a sample.
///
/// # Errors
/// It is not a finite number, it has a comma, or its unit measures something else.
pub fn parse(text: &str, si: &str) -> Result<f64, BadQuantity> {
    let text = text.trim();
    let bad = || BadQuantity::NotANumber { text: text.to_owned() };
    let (number, unit) = split(text).ok_or_else(bad)?;
    if unit.contains(',') {
        return Err(BadQuantity::Comma { text: text.to_owned() });
    }
    let plain = plain(unit);
    // A unit that is in no table means itself.
    let shift = if plain.is_empty() || plain == self::plain(si) {
        0
    } else {
        let known = units(si).iter().find(|(accepted, _)| *accepted == plain);
        let (_, shift) = known.ok_or_else(|| BadQuantity::WrongUnit {
            given: unit.to_owned(),
            accepted: accepted(si),
            meant: meant(si, unit),
        })?;
        *shift
    };
    scaled(number, shift).filter(|value| value.is_finite()).ok_or_else(bad)
}

/// The exact value in as few digits as identify it.
#[must_use]
pub fn number(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-5..1e7).contains(&size) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}

/// A value for people: up to 12 digits, so that 4 times 1.1 is 4.4.
#[must_use]
pub fn readable(value: f64) -> String {
    number(rounded(value, 12))
}

/// A value to a number of digits.
#[must_use]
pub fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits.saturating_sub(1))
        .parse()
        .unwrap_or(value)
}

/// The unit behind a number; empty for a bare number.
#[must_use]
pub fn unit_of(text: &str) -> &str {
    split(text.trim()).map_or("", |(_, unit)| unit)
}

/// The units accepted in the place of `si`, as a list for people.
#[must_use]
pub fn accepted(si: &str) -> String {
    let mut names: Vec<&str> = units(si).iter().map(|(name, _)| *name).collect();
    if si == "1" {
        names.insert(0, "a bare number");
    }
    let last = names.pop().unwrap_or(si);
    if names.is_empty() {
        last.to_owned()
    } else {
        format!("{} or {last}", names.join(", "))
    }
}

/// The unit that was probably meant by another word. Letters alone do not say: `MN` may be meganewtons.
fn meant(si: &str, unit: &str) -> Option<&'static str> {
    let names: Vec<&'static str> = units(si).iter().map(|(name, _)| *name).collect();
    nearest(unit, &names).filter(|name| !name.eq_ignore_ascii_case(unit))
}

/// Every SI unit of the parameter table.
pub fn si_units() -> impl Iterator<Item = &'static str> {
    let measures_a_parameter = |si: &&str| TABLE.iter().any(|row| row.unit == *si);
    UNITS.iter().map(|(si, _)| *si).filter(measures_a_parameter)
}

fn units(si: &str) -> &'static [Accepted] {
    let found = UNITS.iter().find(|(of, _)| *of == si);
    found.map_or(&[], |(_, units)| units)
}

/// The number at the beginning, and what comes after it.
fn split(text: &str) -> Option<(&str, &str)> {
    let begins = text.trim_start_matches(['+', '-']);
    // Rust reads `inf` and `nan` as numbers, and `infinity` would lose its tail to a unit.
    if !begins.starts_with(|first: char| first.is_ascii_digit() || first == '.') {
        return None;
    }
    let mut ends = text.char_indices().map(|(at, _)| at).chain([text.len()]);
    let end = ends.rfind(|&end| text[..end].parse::<f64>().is_ok())?;
    Some((&text[..end], text[end..].trim()))
}

/// A unit without what people write differently: spaces, dots, stars, and two letters for micro.
fn plain(unit: &str) -> String {
    let kept = unit
        .chars()
        .filter(|letter| !letter.is_whitespace() && !"*.·⋅".contains(*letter));
    kept.map(|letter| if "µμ".contains(letter) { 'u' } else { letter })
        .collect()
}

/// Moves the decimal point in the text, so that 7g is the number nearest to 0.007 kg and not a
/// rounding error beside it.
fn scaled(number: &str, shift: i32) -> Option<f64> {
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let exponent = exponent.parse::<i32>().ok()?.checked_add(shift)?;
    format!("{mantissa}e{exponent}").parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_are_read_as_people_type_them() {
        for (text, si, value) in [
            ("500g", "kg", 0.5),
            ("7g", "kg", 0.007),
            (" 2 mm/s ", "m/s", 0.002),
            ("200 µm/s", "m/s", 0.0002),
            ("25N/mm", "N/m", 25_000.0),
            ("2Ns/m", "N s/m", 2.0),
            ("2 N·s/m", "N s/m", 2.0),
            ("1e-3 kN", "N", 1.0),
            ("70%", "1", 0.7),
            ("5 Hz", "1/s", 5.0),
            ("1 cm", "m", 0.01),
            ("20 µs", "ns", 20_000.0),
            ("10ms", "s", 0.01),
            ("7 furlongs", "furlongs", 7.0),
        ] {
            assert_eq!(parse(text, si), Ok(value), "{text}");
        }
        assert_eq!([unit_of("5 mm"), unit_of("5"), unit_of("heavy")], ["mm", "", ""]);
    }

    #[test]
    fn what_is_none_is_refused_with_what_would_be_one() {
        for (text, si, part) in [
            ("heavy", "kg", "`heavy` is not a finite number"),
            ("", "kg", "not a finite number"),
            ("NaN", "N", "not a finite number"),
            ("infinity", "N", "not a finite number"),
            ("1e999", "N", "not a finite number"),
            ("25,000", "N/m", "`25,000` has a comma: write a decimal point"),
            ("0,5", "kg", "has a comma"),
            ("1,000.5 N", "N", "no separator between thousands"),
            (",5", "kg", "not a finite number"),
            ("5 mm", "kg", "`mm` is not a unit of this; give kg, g or mg"),
            ("5 MN", "N", "give N, mN or kN"),
            ("0.5N", "1", "give a bare number or %"),
            ("5kgs", "kg", "did you mean `kg`? give"),
            ("2 newtons", "N", "did you mean `N`?"),
            ("2Ns/mm2", "N s/m", "did you mean `Ns/mm`?"),
        ] {
            let error = parse(text, si).expect_err(text).to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn every_unit_of_the_parameter_table_is_there_and_means_itself() {
        for row in &TABLE {
            assert!(!units(row.unit).is_empty(), "{} has the unit {}", row.name, row.unit);
            assert_eq!(parse(&format!("3 {}", row.unit), row.unit), Ok(3.0));
        }
    }

    #[test]
    fn numbers_are_written_exactly_or_without_rounding_error() {
        for (value, text) in [
            (0.0, "0"),
            (0.5, "0.5"),
            (25_000.0, "25000"),
            (1e-6, "1e-6"),
            (1e300, "1e300"),
        ] {
            assert_eq!(number(value), text);
        }
        for (value, text) in [
            (4.0 * 1.1, "4.4"),
            (0.1 + 0.2, "0.3"),
            (1.234_567_89, "1.23456789"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(readable(value), text);
        }
    }

    proptest::proptest! {
        #[test]
        fn no_text_panics(text in ".{0,40}") {
            drop(parse(&text, "kg"));
            proptest::prop_assert!(text.contains(unit_of(&text)));
        }
    }
}
