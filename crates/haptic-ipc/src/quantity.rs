//! Numbers as people type them: `500g`, `2 mm/s`, `25 N/mm`, `0,5`.
//!
//! A bare number is in the SI unit that the parameter table gives. A unit must be one of those that measure the same thing.

use thiserror::Error;

/// Units of what a scene is made of, grouped by the SI unit that each measures, with their size in it.
const UNITS: [(&str, &[(&str, f64)]); 9] = [
    ("kg", &[("kg", 1.0), ("g", 1e-3), ("mg", 1e-6)]),
    ("N", &[("N", 1.0), ("mN", 1e-3), ("kN", 1e3)]),
    (
        "N/m",
        &[
            ("N/m", 1.0),
            ("N/mm", 1e3),
            ("N/cm", 1e2),
            ("kN/m", 1e3),
            ("mN/mm", 1.0),
        ],
    ),
    (
        "N s/m",
        &[
            ("N s/m", 1.0),
            ("N s/mm", 1e3),
            ("mN s/mm", 1.0),
            ("mN s/m", 1e-3),
            ("kg/s", 1.0),
        ],
    ),
    ("m/s", &[("m/s", 1.0), ("mm/s", 1e-3), ("cm/s", 1e-2), ("um/s", 1e-6)]),
    ("m", &[("m", 1.0), ("mm", 1e-3), ("cm", 1e-2), ("um", 1e-6)]),
    ("s", &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("min", 60.0)]),
    ("1/s", &[("1/s", 1.0), ("/s", 1.0), ("1/ms", 1e3), ("Hz", 1.0)]),
    ("1", &[("1", 1.0), ("%", 1e-2)]),
];

/// Why a text is no quantity.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum BadQuantity {
    /// It does not begin with a number.
    #[error("`{text}` is not a number{}", wanted(.unit))]
    NotANumber {
        /// What was given.
        text: String,
        /// The unit that a number alone would have.
        unit: String,
    },
    /// Its unit measures something else.
    #[error("`{given}` is not a unit of this: give {}", accepted(.unit))]
    WrongUnit {
        /// The unit given.
        given: String,
        /// The SI unit of what was asked for.
        unit: String,
    },
}

fn wanted(unit: &str) -> String {
    if unit == "1" || unit.is_empty() {
        return String::new();
    }
    format!(" of {unit}")
}

/// The units that can stand for `unit`, as a list for messages.
#[must_use]
pub fn accepted(unit: &str) -> String {
    let names: Vec<&str> = units_of(unit).iter().map(|(name, _)| *name).collect();
    match names.as_slice() {
        [] => unit.to_owned(),
        names => names.join(", "),
    }
}

fn units_of(unit: &str) -> &'static [(&'static str, f64)] {
    let found = UNITS.iter().find(|(si, _)| *si == unit);
    found.map_or(&[], |(_, units)| units)
}

/// Reads a number with or without a unit, and gives it in `unit`, an SI unit of the parameter table. A decimal comma is one too.
///
/// # Errors
/// It is not a finite number, or its unit measures something else.
pub fn parse(text: &str, unit: &str) -> Result<f64, BadQuantity> {
    let trimmed = text.trim();
    let end = trimmed.find(|letter: char| !(letter.is_ascii_digit() || "+-.,eE".contains(letter)));
    let (number, given) = trimmed.split_at(end.unwrap_or(trimmed.len()));
    let bad = || BadQuantity::NotANumber {
        text: trimmed.to_owned(),
        unit: unit.to_owned(),
    };
    let value: f64 = number.replace(',', ".").parse().map_err(|_| bad())?;
    let given = given.trim();
    let scale = if given.is_empty() || plain(given) == plain(unit) {
        1.0
    } else {
        let known = units_of(unit).iter().find(|(name, _)| plain(name) == plain(given));
        let (_, scale) = known.ok_or_else(|| BadQuantity::WrongUnit {
            given: given.to_owned(),
            unit: unit.to_owned(),
        })?;
        *scale
    };
    // A division is exact where a multiplication by 1e-3 is not: 500 g are 0.5 kg.
    let value = if scale < 1.0 {
        value / (1.0 / scale).round()
    } else {
        value * scale
    };
    // JSON has no NaN or infinity.
    if value.is_finite() { Ok(value) } else { Err(bad()) }
}

/// A unit without what people write differently: spaces, dots, stars, and two letters for micro.
fn plain(unit: &str) -> String {
    let kept = unit
        .chars()
        .filter(|letter| !letter.is_whitespace() && !"·*⋅".contains(*letter));
    kept.map(|letter| if matches!(letter, 'µ' | 'μ') { 'u' } else { letter })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::parameters::TABLE;

    #[test]
    fn quantities_are_read_as_people_type_them() {
        for (text, unit, value) in [
            ("500g", "kg", 0.5),
            ("0,5", "kg", 0.5),
            (" 2 mm/s ", "m/s", 0.002),
            ("200 µm/s", "m/s", 0.0002),
            ("25N/mm", "N/m", 25_000.0),
            ("2Ns/m", "N s/m", 2.0),
            ("2 N·s/m", "N s/m", 2.0),
            ("1e-3 kN", "N", 1.0),
            ("70%", "1", 0.7),
            ("5 Hz", "1/s", 5.0),
            ("7 furlongs", "furlongs", 7.0),
        ] {
            assert_eq!(parse(text, unit), Ok(value), "{text}");
        }
    }

    #[test]
    fn what_is_none_is_refused_with_what_would_be_one() {
        for (text, unit, part) in [
            ("heavy", "kg", "`heavy` is not a number of kg"),
            ("", "kg", "not a number"),
            ("NaN", "N", "not a number"),
            ("1e999", "N", "not a number"),
            ("5 mm", "kg", "`mm` is not a unit of this: give kg, g, mg"),
            ("5 MN", "N", "give N, mN, kN"),
        ] {
            let error = parse(text, unit).expect_err(text).to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn every_parameters_unit_has_others_beside_it() {
        for row in &TABLE {
            assert!(units_of(row.unit).len() > 1, "{}", row.unit);
            assert_eq!(parse(&format!("3 {}", row.unit), row.unit), Ok(3.0));
        }
    }

    proptest::proptest! {
        #[test]
        fn no_text_panics(text in ".{0,40}") {
            drop(parse(&text, "kg"));
        }
    }
}
