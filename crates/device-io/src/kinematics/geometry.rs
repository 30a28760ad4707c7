//! How two motors move the hand, in each of the geometries.

use super::dual::Dual;
use super::five_bar::FiveBar;
use super::{Jacobian, Pose, Reading};
use haptic_core::planar::Plane;

/// Least gain in the worst direction, as a share of the gain in the best, and of the length of a proximal link. A
/// condition alone is not enough: elsewhere a five-bar has 3 mm a radian at a condition of 4.
const MIN_GAIN: f64 = 0.25;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Geometry {
    Linear(Linear),
    FiveBar(FiveBar),
}

impl Geometry {
    pub(super) fn are_rotary(&self) -> bool {
        matches!(self, Self::FiveBar(_))
    }

    pub(super) fn reading(&self, motors: [f64; 2]) -> Reading {
        let motors = Dual::of_motors(motors);
        let hand = match self {
            Self::Linear(linear) => Some(linear.hand(motors)),
            Self::FiveBar(five_bar) => five_bar.hand(motors),
        };
        let Some([x, y]) = hand else {
            return Reading::CannotClose;
        };
        let pose = Pose {
            position: Plane::new(x.value, y.value),
            jacobian: Jacobian {
                columns: [0, 1].map(|motor| Plane::new(x.slopes[motor], y.slopes[motor])),
            },
        };
        if !(x.value.is_finite() && y.value.is_finite()) {
            return Reading::CannotClose;
        }
        let (least, largest) = pose.jacobian.gains();
        // A derivative that is not a number is not enough.
        if least >= self.least_allowed_gain(largest) && largest.is_finite() {
            Reading::Position(pose)
        } else {
            Reading::Singular(pose)
        }
    }

    pub(super) fn motors(&self, hand: Plane) -> Option<[f64; 2]> {
        match self {
            Self::Linear(linear) => Some(linear.motors(hand)),
            Self::FiveBar(five_bar) => five_bar.motors(hand),
        }
    }

    /// Whether the links close at motor angles, rad, with the elbows outside and the hand on the same side of the
    /// motors as a place, m: swapped angles put it on the other.
    pub(super) fn closes(&self, motors: [f64; 2], place: Plane) -> bool {
        let Some(pose) = self.reading(motors).pose() else {
            return false;
        };
        let apart = |motor: usize, other: f64| 1.0 - libm::cos(motors[motor] - other);
        // A ten-thousandth of a radian, in any turn.
        pose.position.y * place.y >= 0.0
            && self
                .motors(pose.position)
                .is_some_and(|[first, second]| apart(0, first).max(apart(1, second)) < 0.5e-8)
    }

    /// Least gain in the worst direction at which force may flow, by the gain in the best.
    pub(super) fn least_allowed_gain(&self, largest: f64) -> f64 {
        let length = match self {
            Self::Linear(_) => 0.0,
            Self::FiveBar(five_bar) => five_bar.proximal_m,
        };
        MIN_GAIN * largest.max(length)
    }
}

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
