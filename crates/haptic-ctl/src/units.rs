//! Values with units: `500g`, `2mm/s`, `25N/mm`.

use haptic_core::ParameterKey;

/// A unit that is accepted, and the power of ten that turns it into the SI unit.
type Accepted = (&'static str, i32);

/// For each SI unit of the parameter table, the units accepted in its place, without spaces.
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
    ("1", &[("%", -2)]),
];

/// Reads the value of a parameter, in the parameter's SI unit. Without a unit it is in that unit already.
pub(crate) fn value(name: &str, text: &str) -> Result<f64, String> {
    let (number, unit) = split(text).ok_or_else(|| format!("{name} = `{text}` is not a finite number"))?;
    let shift = if unit.is_empty() { 0 } else { shift(name, text, unit)? };
    scaled(number, shift)
        .filter(|value| value.is_finite())
        .ok_or_else(|| format!("{name} = `{text}` is not a finite number"))
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

fn shift(name: &str, text: &str, unit: &str) -> Result<i32, String> {
    let key: ParameterKey = name.parse().map_err(|error| format!("{error}"))?;
    let si = key.parameter.info().unit;
    let plain: String = unit
        .chars()
        .filter(|letter| !letter.is_whitespace() && !"*.·⋅".contains(*letter))
        .map(|letter| if "µμ".contains(letter) { 'u' } else { letter })
        .collect();
    let accepted = UNITS
        .iter()
        .find(|(of, _)| *of == si)
        .map_or(&[][..], |(_, units)| units);
    accepted
        .iter()
        .find(|(accepted, _)| *accepted == plain)
        .map(|(_, shift)| *shift)
        .ok_or_else(|| {
            format!(
                "{name} = `{text}`: {name} is in {}; `{unit}` is not accepted",
                names(si, accepted)
            )
        })
}

fn names(si: &str, accepted: &[Accepted]) -> String {
    let mut names: Vec<&str> = accepted.iter().map(|(name, _)| *name).collect();
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

/// Moves the decimal point in the text, so that 7g is the number nearest to 0.007 kg and not a rounding error beside it.
fn scaled(number: &str, shift: i32) -> Option<f64> {
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let exponent = exponent.parse::<i32>().ok()?.checked_add(shift)?;
    format!("{mantissa}e{exponent}").parse().ok()
}

/// A unit behind a number: a bare number has none.
pub(crate) fn shown(si: &str) -> &str {
    if si == "1" { "" } else { si }
}

/// The units, for the help text.
pub(crate) fn help() -> String {
    let rows: Vec<String> = UNITS
        .iter()
        .map(|(si, accepted)| format!("  {si:6} {}", names(si, accepted)))
        .collect();
    format!("Units, SI without one:\n{}", rows.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::parameters::TABLE;

    #[test]
    fn every_unit_of_the_parameter_table_is_there_and_means_itself() {
        for row in &TABLE {
            let (_, accepted) = UNITS
                .iter()
                .find(|(si, _)| *si == row.unit)
                .unwrap_or_else(|| panic!("{} has the unit {}", row.name, row.unit));
            if row.unit != "1" {
                assert_eq!(value(row.name, &format!("2 {}", row.unit)), Ok(2.0), "{}", row.name);
                assert_eq!(accepted[0].1, 0);
            }
        }
    }

    #[test]
    fn values_are_read_in_the_units_that_people_use() {
        for (name, text, expected) in [
            ("mass", "500g", 0.5),
            ("M", "7g", 0.007),
            ("mass", "1.1 kg", 1.1),
            ("mass", "250000mg", 0.25),
            ("DV", "2mm/s", 0.002),
            ("DV", "0.3cm/s", 0.003),
            ("DV", "50µm/s", 50e-6),
            ("K", "25N/mm", 25_000.0),
            ("K", "0.5kN/m", 500.0),
            ("Fs", "4N", 4.0),
            ("Fs+", "4500mN", 4.5),
            ("Fs-", "+3e0N", 3.0),
            ("b", "2Ns/m", 2.0),
            ("b", "2 N s/m", 2.0),
            ("b", "2N*s/m", 2.0),
            ("b", "2N·s/mm", 2000.0),
            ("gamma", "5/s", 5.0),
            ("zba", "70%", 0.7),
            ("mass", "1.5e-1", 0.15),
            ("anything", "3", 3.0),
        ] {
            assert_eq!(value(name, text), Ok(expected), "{name}={text}");
        }
    }

    #[test]
    fn a_unit_of_something_else_is_refused_by_those_that_are_accepted() {
        for (name, text, parts) in [
            ("mass", "5N", vec!["kg, g or mg", "`N`"]),
            ("Fs", "5kg", vec!["N, mN or kN"]),
            ("K", "5N", vec!["N/mm"]),
            ("mass", "5G", vec!["kg, g or mg"]),
            ("Fs", "5MN", vec!["N, mN or kN"]),
            ("zba", "0.5N", vec!["a bare number or %"]),
            ("masss", "5kg", vec!["did you mean `mass`"]),
            ("mass", "heavy", vec!["not a finite number"]),
            ("mass", "inf", vec!["not a finite number"]),
            ("mass", "nankg", vec!["not a finite number"]),
            ("mass", "1e400kg", vec!["not a finite number"]),
            ("mass", "", vec!["not a finite number"]),
        ] {
            let error = value(name, text).expect_err(text);
            for part in parts {
                assert!(error.contains(part), "{error} lacks {part}");
            }
        }
    }
}
