//! The hand on the fake rig.

use super::motion::Motion;
use super::pointer::PointerArm;
use std::fmt;

/// The hand on the carriage.
#[derive(Clone, Debug)]
pub enum Hand {
    /// Nobody: the carriage is free.
    Free,
    /// A hand so strong that the carriage follows it whatever the force.
    Prescribed(Motion),
    /// A hand that pushes with `offset + amplitude sin(2 pi frequency t)` newtons, wherever the
    /// carriage goes.
    Push {
        /// Steady part, N.
        offset_n: f64,
        /// Alternating part, N.
        amplitude_n: f64,
        /// Turns a second, Hz.
        frequency_hz: f64,
    },
    /// A hand that pulls through an arm, and can be held back.
    Arm {
        /// Stiffness of the arm, N/m.
        stiffness_n_per_m: f64,
        /// Damping of the arm, N s/m.
        damping_ns_per_m: f64,
        /// Intended motion of the hand.
        motion: Motion,
    },
    /// A hand that pulls through an arm to where a person points, and lets go without news of that.
    Pointer(PointerArm),
}

impl fmt::Display for Hand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Free => f.write_str("none"),
            Self::Push {
                offset_n,
                amplitude_n,
                frequency_hz,
            } => write!(f, "a push of {offset_n} N and {amplitude_n} N at {frequency_hz} Hz"),
            Self::Prescribed(motion) => write!(f, "{motion}"),
            Self::Arm {
                stiffness_n_per_m,
                damping_ns_per_m,
                motion,
            } => write!(
                f,
                "{motion}, through an arm of {stiffness_n_per_m} N/m and {damping_ns_per_m} N s/m"
            ),
            Self::Pointer(arm) => {
                let (stiffness, damping) = arm.spring();
                write!(f, "a pointer, through an arm of {stiffness} N/m and {damping} N s/m")
            }
        }
    }
}
