//! A parameter, or one direction of it, as an address.

use super::parameter::Parameter;
use crate::directional::Direction;
use core::fmt;

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
