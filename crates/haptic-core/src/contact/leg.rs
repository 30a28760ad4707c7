//! A leg of the motion within a tick: one direction, constant acceleration.

use crate::directional::Direction;
use crate::math::sqrt;

/// A path in one direction, along which the speed grows or falls evenly with time, so that its
/// square does so with the distance. The distance and the speeds say all; the duration is for what
/// happens at rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leg {
    pub(crate) direction: Direction,
    /// m, not negative.
    pub(crate) distance: f64,
    /// Speed along the direction at the start, m/s.
    pub(crate) from_speed: f64,
    /// The same at the end.
    pub(crate) to_speed: f64,
    /// Time that it takes, s.
    pub(crate) duration_s: f64,
}

impl Leg {
    /// Speed, m/s, after a distance.
    pub(crate) fn speed_at(&self, distance: f64) -> f64 {
        let (from, to) = (self.from_speed * self.from_speed, self.to_speed * self.to_speed);
        let share = if self.distance > 0.0 {
            distance / self.distance
        } else {
            1.0
        };
        sqrt((from + (to - from) * share).max(0.0))
    }

    /// The distance at which the speed passes `speed`, upwards or downwards; `None` where it does
    /// not.
    pub(crate) fn passes(&self, speed: f64) -> Option<f64> {
        if (self.from_speed < speed) == (self.to_speed < speed) {
            return None;
        }
        let (from, to) = (self.from_speed * self.from_speed, self.to_speed * self.to_speed);
        let share = (speed * speed - from) / (to - from);
        Some(share.clamp(0.0, 1.0) * self.distance)
    }

    /// The first part of it, up to a distance, and the rest.
    pub(crate) fn split(&self, distance: f64) -> (Self, Self) {
        let distance = distance.clamp(0.0, self.distance);
        let speed = self.speed_at(distance);
        let duration_s = self.duration_s * self.time_share(distance, speed);
        let first = Self {
            distance,
            to_speed: speed,
            duration_s,
            ..*self
        };
        let rest = Self {
            distance: self.distance - distance,
            from_speed: speed,
            duration_s: self.duration_s - duration_s,
            ..*self
        };
        (first, rest)
    }

    /// The distance after a share of its time.
    pub(crate) fn distance_after(&self, time_share: f64) -> f64 {
        let sum = self.from_speed + self.to_speed;
        if sum == 0.0 {
            return self.distance * time_share;
        }
        let gained = self.from_speed + 0.5 * (self.to_speed - self.from_speed) * time_share;
        self.distance * time_share * (gained / (0.5 * sum))
    }

    /// The share of its time that a distance takes, which is left with `speed`.
    fn time_share(&self, distance: f64, speed: f64) -> f64 {
        if self.distance == 0.0 {
            return 1.0;
        }
        let share = distance / self.distance;
        let sum = self.from_speed + speed;
        if sum == 0.0 {
            share
        } else {
            (share * (self.from_speed + self.to_speed) / sum).min(1.0)
        }
    }
}
