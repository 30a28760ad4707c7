//! The hand on the fake rig.

use super::motion::Motion;
use std::fmt;

/// Who moves the carriage.
#[derive(Clone, Debug)]
pub enum Hand {
    /// Nobody: the carriage is free.
    Free,
    /// A hand so strong that the carriage goes where it goes.
    Prescribed(Motion),
    /// A hand that pulls through an arm, and can be held back.
    Arm {
        /// Stiffness of the arm, N/m.
        stiffness_n_per_m: f64,
        /// Damping of the arm, N s/m.
        damping_ns_per_m: f64,
        /// Where the hand means to go.
        motion: Motion,
    },
}

impl fmt::Display for Hand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Free => f.write_str("none"),
            Self::Prescribed(motion) => write!(f, "{motion}"),
            Self::Arm {
                stiffness_n_per_m,
                damping_ns_per_m,
                motion,
            } => write!(
                f,
                "{motion}, through an arm of {stiffness_n_per_m} N/m and {damping_ns_per_m} N s/m"
            ),
        }
    }
}
