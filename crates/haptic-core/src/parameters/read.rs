//! Reads the name of a parameter, and finds the name that a misspelt one was meant to be.

use super::error::SceneError;
use super::key::ParameterKey;
use super::table::TABLE;
use crate::directional::Direction;
use crate::nearest::nearest;
use alloc::string::ToString;
use alloc::vec::Vec;
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

/// The name or symbol that `text` was most likely meant to be.
fn nearest_name(text: &str) -> Option<&'static str> {
    let known: Vec<&str> = TABLE.iter().flat_map(|row| [row.name, row.symbol]).collect();
    nearest(text, &known)
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
        let error = "stiff".parse::<ParameterKey>().expect_err("no such name");
        assert!(error.to_string().contains("did you mean `stiffness`"), "{error}");
        let error = "colour".parse::<ParameterKey>().expect_err("no such name");
        assert!(!error.to_string().contains("did you mean"), "{error}");
    }

    #[test]
    fn a_direction_on_a_parameter_without_one_is_refused() {
        let error = "M+".parse::<ParameterKey>().expect_err("mass has no direction");
        assert!(error.to_string().contains("mass"), "{error}");
    }
}
