//! Values with units: `500g`, `2mm/s`, `25N/mm`; rates, and durations: `50ms`, `5s`, `1.5min`; and words for values.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use haptic_core::ParameterKey;
use haptic_ipc::quantity::{self, BadQuantity};
use std::time::Duration;

/// Reads the value of a parameter, in the parameter's SI unit. Without a unit it is in that unit
/// already.
pub(crate) fn value(name: &str, text: &str) -> Result<f64, String> {
    let si = match name.parse::<ParameterKey>() {
        Ok(key) => key.parameter.info().unit,
        // A bare number needs no parameter to be read; the daemon says that there is none.
        Err(_) if quantity::unit_of(text).is_empty() || text.contains(',') => "",
        Err(error) => return Err(error.to_string()),
    };
    value_in(name, text, si)
}

/// Reads a quantity in an SI unit, or in one that measures the same.
pub(crate) fn value_in(name: &str, text: &str, si: &str) -> Result<f64, String> {
    quantity::parse(text, si).map_err(|error| match error {
        BadQuantity::NotANumber { .. } => format!("{name} = `{text}` is not a finite number"),
        comma @ BadQuantity::Comma { .. } => format!("{name} = {comma}"),
        BadQuantity::WrongUnit { given, accepted, .. } if accepted.is_empty() => {
            format!("{name} = `{text}`: {name} has no unit; `{given}` is not accepted")
        }
        BadQuantity::WrongUnit { given, accepted, meant } => {
            let meant = meant.map_or_else(String::new, |meant| format!(", did you mean `{meant}`?"));
            format!("{name} = `{text}`: {name} is in {accepted}; `{given}` is not accepted{meant}")
        }
    })
}

/// Reads a rate, Hz.
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    value_in("rate", text, "Hz")
}

/// Reads a duration. A bare number is refused: nobody knows whether it is of seconds or of
/// milliseconds.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    let refused = || format!("`{text}` is not a duration: write a number with its unit, as in 50ms, 5s or 1.5min");
    let read: jiff::SignedDuration = text.parse().map_err(|_| refused())?;
    Duration::try_from(read).map_err(|_| format!("`{text}` is negative: a duration is 0s or more, as in 50ms"))
}

/// Takes one of some words, each of which stands for a value.
pub(crate) fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    words: [(&'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(words.map(|(word, _)| word)).try_map(move |given| {
        let found = words.iter().find(|(word, _)| *word == given);
        found.map(|(_, value)| *value).ok_or("unknown word")
    })
}

/// A unit behind a number: a bare number has none.
pub(crate) fn shown(si: &str) -> &str {
    if si == "1" { "" } else { si }
}

/// The units, for the help text.
pub(crate) fn help() -> String {
    let rows: Vec<String> = quantity::si_units()
        .map(|si| format!("  {si:6} {}", quantity::accepted(si)))
        .collect();
    format!("Units; a bare number is in SI units:\n{}", rows.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_in_the_units_of_their_parameters() {
        for (name, text, expected) in [
            ("mass", "500g", 0.5),
            ("K", "25N/mm", 25_000.0),
            ("Fs+", "4500mN", 4.5),
            ("anything", "3", 3.0),
        ] {
            assert_eq!(value(name, text), Ok(expected), "{name}={text}");
        }
        for (name, text, part) in [
            ("mass", "5N", "mass is in kg, g or mg; `N`"),
            ("zba", "0.5N", "a bare number or %"),
            ("masss", "5kg", "did you mean `mass`"),
            ("mass", "heavy", "not a finite number"),
            ("K", "25,000", "K = `25,000` has a comma"),
            ("anything", "3,5", "has a comma"),
        ] {
            let error = value(name, text).expect_err(text);
            assert!(error.contains(part), "{error} lacks {part}");
        }
    }

    #[test]
    fn durations_need_a_unit() {
        assert_eq!(duration("50ms"), Ok(Duration::from_millis(50)));
        assert_eq!(duration("5s"), Ok(Duration::from_secs(5)));
        assert_eq!(duration("1.5min"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("1h 30s"), Ok(Duration::from_secs(3630)));
        assert_eq!(duration("0s"), Ok(Duration::ZERO));
        for bad in ["5", "", "-5s", "soon", "5kg", "5 5s"] {
            let error = duration(bad).expect_err(bad);
            assert!(error.contains("50ms"), "{error}");
        }
    }
}
