//! A parameter's identity, and the form of its row in the table.
//!
//! A key is a parameter or one direction of it. A misspelt name finds the one that was meant.

use crate::directional::{Direction, Directional};
use crate::nearest::nearest;
use crate::parameters::error::SceneError;
use crate::parameters::table::{Parameter, TABLE};
use alloc::string::ToString;
use alloc::vec::Vec;
use core::fmt;
use core::str::FromStr;

/// How a slider should spread a parameter's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal distances are equal differences.
    Linear,
    /// Equal distances are equal ratios.
    Logarithmic,
}

/// Description of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    /// Which parameter this row describes.
    pub parameter: Parameter,
    /// Name on the wire and in scene files.
    pub name: &'static str,
    /// Symbol in the paper, accepted wherever the name is.
    pub symbol: &'static str,
    /// Other symbols that the literature has for it, accepted as well.
    pub aliases: &'static [&'static str],
    /// SI unit; `1` for a bare number.
    pub unit: &'static str,
    /// The part of the scene that it belongs to.
    pub group: &'static str,
    /// Smallest accepted value.
    pub min: f64,
    /// Largest accepted value.
    pub max: f64,
    /// Lower end of a slider: the range that is of use on a desk-top rig.
    pub slider_min: f64,
    /// Upper end of a slider.
    pub slider_max: f64,
    /// Smallest useful step.
    pub step: f64,
    /// How a slider should spread its range.
    pub scale: Scale,
    /// Whether it may differ by direction (`Fs+`, `Fs-`).
    pub directional: bool,
    /// Feel of a larger value.
    pub feel: &'static str,
}

impl ParameterInfo {
    /// Whether `text` is the parameter's name or one of its symbols.
    #[must_use]
    pub fn is_called(&self, text: &str) -> bool {
        self.name == text || self.symbol == text || self.aliases.contains(&text)
    }
}

/// The place of a parameter's value.
#[derive(Debug)]
pub(crate) enum Slot<'a> {
    /// One value.
    One(&'a mut f64),
    /// A value for each direction.
    Two(&'a mut Directional),
}

/// A parameter, or one direction of it: `mass`, `M`, `static_force`, `Fs`, `Fs+`, `static_force-`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ParameterKey {
    /// The parameter.
    pub parameter: Parameter,
    /// One direction of it, or both.
    pub direction: Option<Direction>,
}

impl From<Parameter> for ParameterKey {
    fn from(parameter: Parameter) -> Self {
        Self {
            parameter,
            direction: None,
        }
    }
}

impl fmt::Display for ParameterKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.parameter.info().name)?;
        match self.direction {
            None => Ok(()),
            Some(Direction::Positive) => f.write_str("+"),
            Some(Direction::Negative) => f.write_str("-"),
        }
    }
}

impl Parameter {
    /// One direction of it.
    #[must_use]
    pub const fn in_direction(self, direction: Direction) -> ParameterKey {
        ParameterKey {
            parameter: self,
            direction: Some(direction),
        }
    }
}

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
        // Symbols keep their case.
        for (wrong, meant) in [("static_forse", "static_force"), ("fs", "Fs"), ("stiff", "stiffness")] {
            let error = wrong.parse::<ParameterKey>().expect_err("no such name").to_string();
            assert!(error.contains(&alloc::format!("did you mean `{meant}`")), "{error}");
        }
        let error = "colour".parse::<ParameterKey>().expect_err("no such name");
        assert!(!error.to_string().contains("did you mean"), "{error}");
    }

    #[test]
    fn a_direction_on_a_parameter_without_one_is_refused() {
        let error = "M+".parse::<ParameterKey>().expect_err("mass has no direction");
        assert!(error.to_string().contains("mass"), "{error}");
    }
}
