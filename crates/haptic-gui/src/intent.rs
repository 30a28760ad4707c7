//! What the user asked for.

use haptic_core::Direction;
use haptic_ipc::Request;
use std::fmt;

/// A parameter, or one direction of it, by its name on the wire.
///
/// The names come from the daemon's `describe`, so a parameter that this program has never heard of can be tuned too.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Target {
    /// Name of the parameter.
    pub name: String,
    /// One direction of it, or both.
    pub direction: Option<Direction>,
}

impl fmt::Display for Target {
    /// Writes the key as the protocol takes it: `mass`, `static_force+`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)?;
        f.write_str(match self.direction {
            None => "",
            Some(Direction::Positive) => "+",
            Some(Direction::Negative) => "-",
        })
    }
}

/// Something that the user wants of the daemon.
#[derive(Clone, Debug, PartialEq)]
pub enum Intent {
    /// Ramp the force up.
    Engage,
    /// Ramp the force down.
    Release,
    /// Zero force at once.
    Stop,
    /// Clear a stop or a fault.
    Reset,
    /// Change a parameter.
    Set {
        /// Which one.
        target: Target,
        /// Its new value, in the parameter's unit.
        value: f64,
    },
}

impl Intent {
    /// The intent as a request of the protocol.
    #[must_use]
    pub fn request(&self) -> Request {
        match self {
            Self::Engage => Request::Engage {},
            Self::Release => Request::Release {},
            Self::Stop => Request::Stop {},
            Self::Reset => Request::Reset {},
            Self::Set { target, value } => Request::set([(target.to_string(), *value)].into_iter().collect()),
        }
    }
}

impl fmt::Display for Intent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Engage => f.write_str("engage"),
            Self::Release => f.write_str("release"),
            Self::Stop => f.write_str("stop"),
            Self::Reset => f.write_str("reset"),
            Self::Set { target, value } => write!(f, "set {target} = {value}"),
        }
    }
}
