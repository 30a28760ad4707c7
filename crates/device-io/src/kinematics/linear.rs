//! Two linear motors: a gantry, and an H-shaped belt.

use super::dual::Dual;
use haptic_core::planar::Plane;

/// How two linear motors move the hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Linear {
    /// A gantry: each motor moves one axis.
    Xy,
    /// One belt around both motors (CoreXY, H-Man): `x = (a + b)/2`, `y = (a - b)/2`.
    HBelt,
}

impl Linear {
    pub(super) fn hand(self, [a, b]: [Dual; 2]) -> [Dual; 2] {
        match self {
            Self::Xy => [a, b],
            Self::HBelt => [(a + b) * 0.5, (a - b) * 0.5],
        }
    }

    pub(super) fn motors(self, hand: Plane) -> [f64; 2] {
        match self {
            Self::Xy => [hand.x, hand.y],
            Self::HBelt => [hand.x + hand.y, hand.x - hand.y],
        }
    }
}
