//! The motion of a rig by its own motor from which it is identified: a reference goes along a [`Course`], and a virtual
//! spring and damper draw the handle after it.
//!
//! ```text
//! F = K (r - x) + B (r' - v),   |F| <= limit,   |F(k) - F(k-1)| <= slew * period
//! ```
//!
//! It is a function of the elapsed time and the samples alone. It ends at the bounds of its
//! [`OwnMotion`](crate::OwnMotion), and where it is given more energy by the handle than a handle gives that the motor
//! moves.

mod course;

pub use course::Course;

use crate::bound_error::BoundError;
use crate::own_motion::{MotionEnd, broken};

/// Range of the distance from its first place within which a handle is kept, m.
pub const TRAVEL_M: (f64, f64) = (1e-5, 0.25);
/// Range of the speed below which a handle is kept, m/s.
pub const SPEED_MPS: (f64, f64) = (1e-4, 0.5);
/// Range of the stiffness of the spring, N/m: beyond it a light handle oscillates with a tick of
/// delay.
pub const STIFFNESS_N_PER_M: (f64, f64) = (1.0, 20_000.0);
/// Range of the damping, N s/m.
pub const DAMPING_NS_PER_M: (f64, f64) = (0.0, 100.0);
/// Range of the slew limit, N/s.
pub const SLEW_N_PER_S: (f64, f64) = (1.0, 2000.0);
/// Smallest force limit, N.
pub const MIN_FORCE_N: f64 = 0.001;

/// Time after the course in which the force fades out, s.
const FADE_S: f64 = 0.1;

/// Share of the nominal period that each tick counts for at least: a device whose clock stands still
/// does not prolong a course beyond twice its time, and one that is slower than the loop does not
/// shorten it.
const MIN_SHARE_OF_A_TICK: f64 = 0.5;

/// A course, and the bounds outside of which the force ends at once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Excitation {
    /// The course of the reference, from the handle's first place and back.
    pub course: Course,
    /// Largest force on the handle, N.
    #[cfg_attr(feature = "serde", serde(rename = "force_limit_N"))]
    pub force_limit_n: f64,
    /// Fastest change of the force, N/s; its end is at once.
    #[cfg_attr(feature = "serde", serde(rename = "slew_limit_N_per_s"))]
    pub slew_limit_n_per_s: f64,
    /// Stiffness of the spring between reference and handle, N/m.
    #[cfg_attr(feature = "serde", serde(rename = "stiffness_N_per_m"))]
    pub stiffness_n_per_m: f64,
    /// Its damping, N s/m.
    #[cfg_attr(feature = "serde", serde(rename = "damping_Ns_per_m"))]
    pub damping_ns_per_m: f64,
    /// Largest distance of the handle from its first place, m.
    pub travel_limit_m: f64,
    /// The speed limit, m/s.
    pub speed_limit_mps: f64,
    /// Largest distance of the handle from the reference, m.
    pub lag_limit_m: f64,
    /// Largest motion against the largest force at the beginning, m; farther against a smaller one.
    pub wrong_way_limit_m: f64,
}

impl Excitation {
    /// From the first force to the last, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.course.duration_s() + FADE_S
    }

    /// Work of the force on the handle from which on it is sure which way the motor moves it, J.
    #[must_use]
    pub fn sure_work_j(&self) -> f64 {
        self.force_limit_n * self.wrong_way_limit_m
    }

    /// Whether it is bounded as every excitation is. How large a force the rig may have, and how
    /// far its handle goes, is for the caller to check.
    ///
    /// # Errors
    /// The first quantity that is out of range, or not a number.
    pub fn check(&self) -> Result<(), BoundError> {
        let within = |field, value, (min, max), unit| BoundError::check(field, value, min, max, unit);
        within("force_limit_N", self.force_limit_n, (MIN_FORCE_N, f64::MAX), "N")?;
        within("slew_limit_N_per_s", self.slew_limit_n_per_s, SLEW_N_PER_S, "N/s")?;
        within("stiffness_N_per_m", self.stiffness_n_per_m, STIFFNESS_N_PER_M, "N/m")?;
        within("damping_Ns_per_m", self.damping_ns_per_m, DAMPING_NS_PER_M, "N s/m")?;
        within("travel_limit_m", self.travel_limit_m, TRAVEL_M, "m")?;
        within("speed_limit_mps", self.speed_limit_mps, SPEED_MPS, "m/s")?;
        within("lag_limit_m", self.lag_limit_m, TRAVEL_M, "m")?;
        within(
            "wrong_way_limit_m",
            self.wrong_way_limit_m,
            (0.0, self.travel_limit_m),
            "m",
        )?;
        self.course.check(self.travel_limit_m, self.speed_limit_mps)
    }
}

/// A tick counts for this many periods at most: after a stall the reference goes on where the handle still is, and is
/// not out of its reach at once.
const MAX_STEP_PERIODS: f64 = 5.0;

/// Whether the handle moves with the force.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sign {
    /// Not known yet: the work that the force has done so far, J.
    Unknown(f64),
    /// It has moved with the force. What it gives back from now on is the energy of its motion.
    Right,
}

/// An excitation under way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Follower {
    excitation: Excitation,
    sign: Sign,
    /// Time since the beginning by the device's clock, and the least that the ticks count for, s.
    elapsed_s: f64,
    least_s: f64,
    reference: (f64, f64),
    force: f64,
}

impl Follower {
    pub(crate) fn new(excitation: Excitation) -> Self {
        Self {
            excitation,
            sign: Sign::Unknown(0.0),
            elapsed_s: 0.0,
            least_s: 0.0,
            reference: (0.0, 0.0),
            force: 0.0,
        }
    }

    /// Position (m) and speed (m/s) of the reference.
    pub(crate) fn reference(&self) -> (f64, f64) {
        self.reference
    }

    /// Ends the force, with the reference at a place (m) and a speed (m/s).
    pub(crate) fn rest(&mut self, reference: (f64, f64)) {
        (self.reference, self.force) = (reference, 0.0);
    }

    /// Lets a time go by, s, since the tick before; `None` in the first one.
    pub(crate) fn go_on(&mut self, elapsed_s: Option<f64>, period_s: f64) {
        if let Some(elapsed_s) = elapsed_s {
            self.elapsed_s += elapsed_s.clamp(0.0, MAX_STEP_PERIODS * period_s);
            self.least_s += MIN_SHARE_OF_A_TICK * period_s;
        }
    }

    /// The force (N) on a handle at a position (m) and velocity (m/s) that has moved since the tick before (m), or why
    /// the excitation ends there.
    pub(crate) fn force(
        &mut self,
        origin: f64,
        moved: f64,
        handle: (f64, f64),
        period_s: f64,
    ) -> Result<f64, MotionEnd> {
        let Excitation { course, .. } = self.excitation;
        let gone_s = self.elapsed_s.max(self.least_s);
        let (place, speed) = course.at(gone_s.min(course.duration_s()));
        self.reference = (origin + place, speed);
        let (position, velocity) = handle;
        let limits = self.excitation;
        let bounds = [
            (!self.goes_the_wrong_way(moved), MotionEnd::WrongWay),
            ((position - origin).abs() <= limits.travel_limit_m, MotionEnd::Travel),
            (velocity.abs() <= limits.speed_limit_mps, MotionEnd::Speed),
            (
                (self.reference.0 - position).abs() <= limits.lag_limit_m,
                MotionEnd::Lag,
            ),
            (gone_s < limits.duration_s(), MotionEnd::Time),
        ];
        if let Some(end) = broken(bounds) {
            self.rest(handle);
            return Err(end);
        }
        self.force = self.draw(gone_s, handle, period_s);
        Ok(self.force)
    }

    /// Whether the handle has moved against the force, by the force's work on a motion, m.
    fn goes_the_wrong_way(&mut self, moved: f64) -> bool {
        let Sign::Unknown(before_j) = self.sign else {
            return false;
        };
        let work_j = before_j + self.force * moved;
        let sure_j = self.excitation.sure_work_j();
        self.sign = if work_j >= sure_j {
            Sign::Right
        } else {
            Sign::Unknown(work_j)
        };
        work_j <= -sure_j
    }

    /// The force that draws the handle after the reference, N.
    fn draw(&self, gone_s: f64, (position, velocity): (f64, f64), period_s: f64) -> f64 {
        let shape = &self.excitation;
        let (place, speed) = self.reference;
        let drawn = shape.stiffness_n_per_m * (place - position) + shape.damping_ns_per_m * (speed - velocity);
        let left = ((shape.duration_s() - gone_s) / FADE_S).clamp(0.0, 1.0);
        let most = shape.slew_limit_n_per_s * period_s;
        (left * drawn)
            .clamp(-shape.force_limit_n, shape.force_limit_n)
            .clamp(self.force - most, self.force + most)
    }
}

#[cfg(test)]
mod tests;
