//! Reads the name of a parameter, and finds the name that a misspelt one was meant to be.

use super::error::SceneError;
use super::key::ParameterKey;
use super::table::TABLE;
use crate::direction::Direction;
use alloc::string::ToString;
use core::str::FromStr;

impl FromStr for ParameterKey {
    type Err = SceneError;

    /// Reads a name or a symbol with an optional trailing `+` or `-`.
    ///
    /// # Errors
    /// [`SceneError::UnknownParameter`], with the nearest name, or [`SceneError::NotDirectional`].
    fn from_str(text: &str) -> Result<Self, SceneError> {
        let (base, direction) = match text.as_bytes().last() {
            Some(b'+') => (&text[..text.len() - 1], Some(Direction::Positive)),
            Some(b'-') => (&text[..text.len() - 1], Some(Direction::Negative)),
            _ => (text, None),
        };
        let Some(info) = TABLE.iter().find(|row| row.is_called(base)) else {
            return Err(SceneError::UnknownParameter {
                name: text.to_string(),
                nearest: nearest_name(base),
            });
        };
        if direction.is_some() && !info.directional {
            return Err(SceneError::NotDirectional {
                param: info.parameter,
                given: text.to_string(),
            });
        }
        Ok(Self {
            parameter: info.parameter,
            direction,
        })
    }
}

/// Bytes of the longest text for which a name is looked for.
const LONGEST_NAME: usize = 64;

/// The name or symbol that `text` was most likely meant to be, when one is near enough to say so.
fn nearest_name(text: &str) -> Option<&'static str> {
    // No name is near to a longer one; and looking takes time that grows with it, while anybody may
    // send one of any length.
    if text.len() > LONGEST_NAME {
        return None;
    }
    let wanted = text.to_ascii_lowercase();
    let mut best: Option<(usize, &'static str)> = None;
    for row in &TABLE {
        for candidate in [row.name, row.symbol] {
            let distance = edit_distance(&wanted, &candidate.to_ascii_lowercase());
            if best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, candidate));
            }
        }
    }
    // A third of the letters may be wrong; a one-letter symbol must match but for its case.
    best.filter(|(distance, name)| *distance <= name.len() / 3)
        .map(|(_, name)| name)
}

/// Levenshtein distance in bytes; both texts are short.
fn edit_distance(a: &str, b: &str) -> usize {
    let mut row: alloc::vec::Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.bytes().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.bytes().enumerate() {
            let substituted = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Parameter;

    #[test]
    fn every_parameter_has_its_own_row_name_and_symbol() {
        for (index, row) in TABLE.iter().enumerate() {
            assert_eq!(row.parameter.info(), row);
            assert!(row.min <= row.slider_min && row.slider_min < row.slider_max && row.slider_max <= row.max);
            for other in &TABLE[index + 1..] {
                assert_ne!(row.name, other.name);
                assert_ne!(row.symbol, other.symbol);
            }
        }
    }

    #[test]
    fn names_symbols_and_directions_are_read() {
        let both: ParameterKey = "Fs".parse().expect("a symbol");
        assert_eq!(both, Parameter::StaticForce.into());
        let negative: ParameterKey = "dynamic_force-".parse().expect("a name with a direction");
        assert_eq!(negative.direction, Some(Direction::Negative));
        assert_eq!(negative.to_string(), "dynamic_force-");
    }

    #[test]
    fn a_misspelt_name_is_answered_with_the_nearest() {
        let error = "static_forse".parse::<ParameterKey>().expect_err("no such name");
        assert!(error.to_string().contains("did you mean `static_force`"), "{error}");
        let error = "fs".parse::<ParameterKey>().expect_err("symbols keep their case");
        assert!(error.to_string().contains("did you mean `Fs`"), "{error}");
        let error = "colour".parse::<ParameterKey>().expect_err("no such name");
        assert!(!error.to_string().contains("did you mean"), "{error}");
    }

    #[test]
    fn a_direction_on_a_parameter_without_one_is_refused() {
        let error = "M+".parse::<ParameterKey>().expect_err("mass has no direction");
        assert!(error.to_string().contains("mass"), "{error}");
    }
}
