//! A five-bar linkage (pantograph): two rotary motors, a proximal link on each, and two distal links that meet in the
//! hand. Campion, Wang and Hayward, "The Pantograph Mk-II: a haptic instrument", IROS 2005.
//!
//! ```text
//!              hand
//!             /    \        distal_m
//!     elbow 1       elbow 2
//!            \     /        proximal_m
//!      motor 1 --- motor 2  base_m; the origin is in the middle, x points to motor 2
//! ```
//!
//! The angle of a motor is that of its proximal link, from the x axis, growing to the left. The hand lies to the left
//! of the line from elbow 1 to elbow 2, and the elbows lie outside.

use super::dual::Dual;
use haptic_core::planar::Plane;

/// Largest distance between a position and the one that its motor angles give, m, as rounding makes it.
const ROUNDING_M: f64 = 1e-9;

/// Lengths of the linkage, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FiveBar {
    /// Between the axes of the two motors.
    pub(super) base_m: f64,
    /// Of the links on the motors.
    pub(super) proximal_m: f64,
    /// Of the links that meet in the hand.
    pub(super) distal_m: f64,
}

impl FiveBar {
    /// The hand's position, m, at two motor angles, rad: the left one of the two points where the circles of the distal
    /// links around the elbows meet. Nothing where they do not meet, or have the same centre.
    pub(super) fn hand(&self, [first, second]: [Dual; 2]) -> Option<[Dual; 2]> {
        let [x1, y1] = self.elbow(first, -0.5 * self.base_m);
        let [x2, y2] = self.elbow(second, 0.5 * self.base_m);
        // Half of the line from elbow 1 to elbow 2, and the height of the hand over it.
        let (half_x, half_y) = ((x2 - x1) * 0.5, (y2 - y1) * 0.5);
        let half_squared = half_x * half_x + half_y * half_y;
        let height_squared = Dual::constant(self.distal_m * self.distal_m) - half_squared;
        if !(height_squared.value >= 0.0 && half_squared.value > 0.0) {
            return None;
        }
        let height = (height_squared / half_squared).sqrt();
        Some([x1 + half_x - half_y * height, y1 + half_y + half_x * height])
    }

    fn elbow(&self, motor: Dual, motor_x_m: f64) -> [Dual; 2] {
        let (sin, cos) = motor.sin_cos();
        [cos * self.proximal_m + Dual::constant(motor_x_m), sin * self.proximal_m]
    }

    /// The motor angles, rad, that put the hand to a position, with the elbows outside. Nothing where the links are too
    /// short or too long, or would close on the other side.
    pub(super) fn motors(&self, hand: Plane) -> Option<[f64; 2]> {
        let angles = [
            self.motor(Plane::new(hand.x + 0.5 * self.base_m, hand.y), 1.0)?,
            self.motor(Plane::new(hand.x - 0.5 * self.base_m, hand.y), -1.0)?,
        ];
        let [x, y] = self.hand(Dual::of_motors(angles))?;
        let apart = Plane::new(x.value, y.value) - hand;
        (apart.length() <= ROUNDING_M).then_some(angles)
    }

    /// The angle of a motor, rad, by the line from it to the hand, with its elbow on one `side` of that line: 1 for the
    /// left.
    fn motor(&self, to_hand: Plane, side: f64) -> Option<f64> {
        let distance = to_hand.length();
        let links = self.proximal_m * self.proximal_m - self.distal_m * self.distal_m;
        // The law of cosines.
        let cos = (distance * distance + links) / (2.0 * distance * self.proximal_m);
        (cos.abs() <= 1.0).then(|| libm::atan2(to_hand.y, to_hand.x) + side * libm::acos(cos))
    }
}
