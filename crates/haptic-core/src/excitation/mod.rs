//! The motion of a rig by its own motor, from which it is identified.
//!
//! A reference goes along a [`Course`], and a virtual spring and damper draw the handle after it.
//!
//! ```text
//! F = K (r - x) + B (r' - v),   |F| <= limit,   |F(k) - F(k-1)| <= slew * period
//! ```
//!
//! It is rendered in the place of a scene, and is bounded by itself in force, slew, time, travel,
//! speed and distance from its reference. It gives zero force for ever once it has ended, been
//! interrupted, or been given more energy by the handle than a handle gives that the motor moves. It
//! is a function of the elapsed time and the samples alone. The limits of the rig hold behind it as
//! behind every scene.

mod course;

pub use course::Course;

use crate::block::{BlockState, Contact, EventSink, Moving, Rendered};
use crate::bound_error::BoundError;
use crate::directional::Direction;
use crate::snapshot::Archive;

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

/// A course, and the bounds within which the handle is drawn along it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Excitation {
    /// The course of the reference.
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
    /// Damping between reference and handle, N s/m.
    #[cfg_attr(feature = "serde", serde(rename = "damping_Ns_per_m"))]
    pub damping_ns_per_m: f64,
    /// The force ends at once when the handle is farther than this from its first place, m.
    pub travel_limit_m: f64,
    /// The force ends at once when the handle is faster than this, m/s.
    pub speed_limit_mps: f64,
    /// The force ends at once when the handle is farther than this from the reference, m.
    pub lag_limit_m: f64,
    /// The force ends at once when the handle has, from the beginning, moved this far against the
    /// largest force, or farther against a smaller one, m.
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

    /// Whether a sample this far from the first place, at this speed, so far from the reference (m,
    /// m/s) lets it continue. NaN does not.
    fn allows(&self, way_m: f64, velocity_mps: f64, lag_m: f64) -> bool {
        way_m.abs() <= self.travel_limit_m
            && velocity_mps.abs() <= self.speed_limit_mps
            && lag_m.abs() <= self.lag_limit_m
    }
}

/// A tick counts for this many periods at most: after a stall the reference goes on where the handle still is, and is not
/// out of its reach at once.
const MAX_STEP_PERIODS: f64 = 5.0;

/// How far an excitation has come.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// Nobody has said yet where the handle is.
    Unplaced,
    /// It begins with the next tick.
    Armed,
    /// It is under way.
    Running,
    /// It gives no force any more, whatever happens.
    Spent,
}

/// Whether the handle moves with the force.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sign {
    /// Not known yet: the work that the force has done so far, J.
    Unknown(f64),
    /// It has moved with the force. What it gives back from now on is the energy of its motion.
    Right,
}

/// An excitation on the device itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Follower {
    excitation: Excitation,
    /// Nominal time of a tick, s.
    period_s: f64,
    phase: Phase,
    sign: Sign,
    /// Time since the beginning by the device's clock, and the least that the ticks count for, s.
    elapsed_s: f64,
    least_s: f64,
    origin: f64,
    position: f64,
    velocity: f64,
    reference: (f64, f64),
    force: f64,
}

impl Follower {
    pub(crate) fn new(excitation: Excitation, period_s: f64) -> Self {
        Self {
            excitation,
            period_s,
            phase: Phase::Unplaced,
            sign: Sign::Unknown(0.0),
            elapsed_s: 0.0,
            least_s: 0.0,
            origin: 0.0,
            position: 0.0,
            velocity: 0.0,
            reference: (0.0, 0.0),
            force: 0.0,
        }
    }

    fn end(&mut self) {
        self.phase = Phase::Spent;
        self.force = 0.0;
        self.reference = (self.position, self.velocity);
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
    fn draw(&self, gone_s: f64) -> f64 {
        let shape = &self.excitation;
        let (place, speed) = self.reference;
        let drawn =
            shape.stiffness_n_per_m * (place - self.position) + shape.damping_ns_per_m * (speed - self.velocity);
        let left = ((shape.duration_s() - gone_s) / FADE_S).clamp(0.0, 1.0);
        let most = shape.slew_limit_n_per_s * self.period_s;
        (left * drawn)
            .clamp(-shape.force_limit_n, shape.force_limit_n)
            .clamp(self.force - most, self.force + most)
    }
}

impl Moving for Follower {
    fn advance(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        _sink: &mut (impl EventSink + ?Sized),
    ) -> Rendered {
        let moved = position - self.position;
        (self.position, self.velocity) = (position, velocity);
        match self.phase {
            Phase::Armed => self.phase = Phase::Running,
            Phase::Running => {
                self.elapsed_s += elapsed_s.clamp(0.0, MAX_STEP_PERIODS * self.period_s);
                self.least_s += MIN_SHARE_OF_A_TICK * self.period_s;
            }
            Phase::Unplaced | Phase::Spent => return Rendered::default(),
        }
        let gone_s = self.elapsed_s.max(self.least_s);
        let (place, speed) = self
            .excitation
            .course
            .at(gone_s.min(self.excitation.course.duration_s()));
        self.reference = (self.origin + place, speed);
        let (way, lag) = (position - self.origin, self.reference.0 - position);
        let is_over = gone_s >= self.excitation.duration_s() || !self.excitation.allows(way, velocity, lag);
        if is_over || self.goes_the_wrong_way(moved) {
            self.end();
            return Rendered::default();
        }
        self.force = self.draw(gone_s);
        Rendered {
            // The hand feels the coupling force the other way round.
            coupling_force: -self.force,
            ..Rendered::default()
        }
    }

    /// Its block is the reference, which slides; stuck, it has ended.
    fn state(&self) -> BlockState {
        let (place, speed) = self.reference;
        let mut state = BlockState::new(place, speed, self.position, self.velocity);
        state.contact = match self.phase {
            Phase::Spent => Contact::Stuck,
            Phase::Unplaced | Phase::Armed | Phase::Running => Contact::Sliding(Direction::of(speed)),
        };
        state
    }

    /// The first call says where it begins. After that it has been interrupted: no force
    /// flowed, or another motion was meant.
    fn set_state(&mut self, state: BlockState) {
        (self.position, self.velocity) = (state.device_position, state.device_velocity);
        self.origin = self.position;
        if self.phase == Phase::Unplaced {
            self.phase = Phase::Armed;
            self.reference = (self.position, 0.0);
        } else {
            self.end();
        }
    }

    /// None, for whatever follows: the force of an excitation that is replaced ends at once and does
    /// not fade.
    /// A motion of its own is never gone on with.
    fn archive(&mut self, _archive: &mut Archive<'_>) {}

    fn coupling_force(&self) -> f64 {
        0.0
    }
}

#[cfg(test)]
mod tests;
