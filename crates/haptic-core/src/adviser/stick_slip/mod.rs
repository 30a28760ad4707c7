//! Stick-slip of a hand that keeps its speed: how often the block lets go, and what the hand feels
//! of it.
//!
//! One period of the exact block itself is followed, from one breakaway to the next. Without
//! damping (`B`, `b`, `DV` all zero) and with a limit that is there at once it has a closed form. A
//! slide begins with `w = 0` and the pull `Fs`, and goes
//!
//! ```text
//! w = v (1 - cos w0 t) + D w0 sin w0 t,   D = (Fs - Fd)/K,   w0 = sqrt(K/M),
//! ```
//!
//! until `w = 0` again, at `theta = w0 t = 2 (pi - atan(D w0/v))`. The pull is then as far below
//! `Fd` as it was above, and grows by `2 (Fs - Fd)` at the rate `K v`:
//!
//! ```text
//! period = theta/w0 + 2 D/v
//! ```
//!
//! With damping there is a critical speed, from which on a slide never ends.

mod tuning;

pub use tuning::{static_force_for, stiffness_for};

use crate::block::EventSink;
use crate::bound_error::BoundError;
use crate::contact::Contact;
use crate::directional::Direction;
use crate::math::sqrt;
use crate::parameters::{Parameter, SceneError};
use crate::renderer::Renderer;
use crate::scene::Scene;
use crate::scheme::Scheme;
use core::f64::consts::TAU;
use thiserror::Error;

/// Speeds of a hand that are reckoned, m/s.
const SPEEDS_MPS: [f64; 2] = [1e-6, 10.0];

/// Ticks in a free period of the block: the mean force is summed over them.
const TICKS_A_TURN: f64 = 64.0;
/// Ticks of one length; the next so many are twice as long. A slide that takes them all does not
/// end.
const TICKS_OF_A_LENGTH: u32 = 1024;
const LENGTHS: u32 = 12;
/// A slide within this share of the hand's speed, for a whole turn, has settled.
const SETTLED: f64 = 1e-9;
/// Periods until one is like the one before, where the limit depends on the rest, and how alike.
const MAX_PERIODS: u32 = 400;
const MEAN_OF: u32 = 100;
const ALIKE: f64 = 1e-13;
/// A rest after which no limit rises any more, s.
const RESTED_S: f64 = 1e6;
/// A jump that is no more than this share of the limit is none.
const NO_JUMP: f64 = 1e-9;

/// Stick-slip at a steady speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StickSlip {
    /// Times that the block lets go, Hz.
    pub frequency_hz: f64,
    /// Time of a period in which it is stuck, s.
    pub stick_s: f64,
    /// And in which it slides, s.
    pub slip_s: f64,
    /// By how much the pull of the hand falls with each slide, N.
    pub jump_n: f64,
    /// Mean force of the hand along its motion, N.
    pub mean_force_n: f64,
}

/// Why there is no stick-slip to be reported.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StickSlipError {
    /// The contact gives way, or nothing pulls it.
    #[error("stick-slip is reckoned for a block on a rigid contact (karnopp) that a spring pulls; this scene has none")]
    NotRigid,
    /// A speed or a frequency is out of range.
    #[error(transparent)]
    OutOfRange(#[from] BoundError),
    /// The scene cannot be rendered.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// No value of a parameter gives a frequency.
    #[error("no {} gives {frequency_hz} Hz at this speed: the frequencies that it gives are {}", .parameter.info().name, reach_of(.reach))]
    OutOfReach {
        /// The parameter.
        parameter: Parameter,
        /// The frequency that is asked for, Hz.
        frequency_hz: f64,
        /// The least and the greatest that some value of it gives, Hz; `None` where none gives
        /// stick-slip.
        reach: Option<(f64, f64)>,
    },
}

fn reach_of(reach: &Option<(f64, f64)>) -> alloc::string::String {
    match reach {
        None => alloc::string::String::from("none"),
        Some((least, most)) => alloc::format!("{least:.4} to {most:.4} Hz"),
    }
}

/// Stick-slip of a scene under a hand that keeps its velocity, m/s (1e-6 to 10, of either sign).
/// `None` where the block slides on: above the critical speed, or where nothing falls. Where no
/// period is like the one before, as with a limit that rises in rest and next to no damping, it is
/// the mean of many.
///
/// # Errors
/// There is no block on a rigid contact in a spring, the scene is not valid, or the velocity is out
/// of range.
pub fn stick_slip(scene: &Scene, velocity: f64) -> Result<Option<StickSlip>, StickSlipError> {
    let [least, most] = SPEEDS_MPS;
    BoundError::check("speed", velocity.abs(), least, most, "m/s")?;
    let (Some(block), Some(coupling)) = (scene.block, scene.coupling) else {
        return Err(StickSlipError::NotRigid);
    };
    let law = scene.friction.as_law();
    let Some(kinetic) = law.rigid_friction().filter(|_| coupling.stiffness > 0.0) else {
        return Err(StickSlipError::NotRigid);
    };
    let direction = Direction::of(velocity);
    let limit = law.holding_force().get(direction);
    let turn_s = TAU * sqrt(block.mass / coupling.stiffness);
    let tick_s = turn_s / TICKS_A_TURN;
    let mut course = Course {
        renderer: Renderer::new(scene, Scheme::Exact, tick_s)?,
        velocity,
        stiffness: coupling.stiffness,
        damping: coupling.damping,
        limit,
        tick_s,
        time_s: 0.0,
        rested_s: 0.0,
    };
    // Without a fall a slide ends only by rounding.
    if limit <= kinetic.get(direction) {
        return Ok(None);
    }
    Ok(course.settles(
        scene
            .value(Parameter::RisingRate)
            .is_some_and(|rate| rate.greatest() > 0.0),
    ))
}

/// The course of a block that is pulled.
struct Course {
    renderer: Renderer,
    velocity: f64,
    stiffness: f64,
    damping: f64,
    /// The limit after a long rest, N.
    limit: f64,
    tick_s: f64,
    /// Since the hand was at the origin, s.
    time_s: f64,
    /// For how long the block has been stuck, s.
    rested_s: f64,
}

/// Rest and slide, s, fall of the pull, N, and the integral of the coupling force, N s.
type Period = [f64; 4];

impl Course {
    /// Pulls a rested block until a period is like the one before; the mean of the last periods
    /// where none is. Only a limit that rises in rest takes more than one.
    fn settles(&mut self, rises: bool) -> Option<StickSlip> {
        self.renderer.start_at(0.0, 0.0);
        // A long rest, and then the hand is at its speed.
        self.renderer.tick(RESTED_S, 0.0, 0.0);
        self.advance(self.tick_s, &mut ());
        // The first slide may have begun with that jerk.
        self.stick();
        self.slip()?;
        self.stick();
        let lasts = |period: &Period| period[0] + period[1];
        let mut last = self.period()?;
        let (mut sum, mut count) = (last, 1.0);
        let most = if rises { MAX_PERIODS } else { 0 };
        for k in 1..=most {
            let next = self.period()?;
            let alike = (lasts(&next) - lasts(&last)).abs() <= ALIKE * lasts(&next);
            if alike || k <= most - MEAN_OF {
                (sum, count) = (next, 1.0);
            } else {
                sum = core::array::from_fn(|i| sum[i] + next[i]);
                count += 1.0;
            }
            last = next;
            if alike {
                break;
            }
        }
        let [stick_s, slip_s, jump_n, impulse] = sum.map(|part| part / count);
        let period_s = stick_s + slip_s;
        (jump_n > NO_JUMP * self.limit).then_some(StickSlip {
            frequency_hz: 1.0 / period_s,
            stick_s,
            slip_s,
            jump_n,
            mean_force_n: impulse / period_s,
        })
    }

    /// From breakaway to breakaway.
    fn period(&mut self) -> Option<Period> {
        let before = self.pull();
        let (slip_s, impulse) = self.slip()?;
        let after = self.pull() - self.stiffness * self.velocity * self.rested_s;
        let stick_s = self.stick();
        let impulse = impulse + 0.5 * (after + self.pull()) * stick_s;
        let sign = Direction::of(self.velocity).sign();
        Some([stick_s, slip_s, sign * (before - after), sign * impulse])
    }

    /// The coupling force if the block stood still, N.
    fn pull(&self) -> f64 {
        let state = self.renderer.state();
        self.stiffness * state.deflection() + self.damping * self.velocity
    }

    /// Moves on by a time, s.
    fn advance(&mut self, time_s: f64, listener: &mut dyn EventSink) {
        self.time_s += time_s;
        self.renderer
            .tick_with_events(time_s, self.velocity * self.time_s, self.velocity, listener);
    }

    /// Rests until the contact lets go; how long since it stuck, s.
    fn stick(&mut self) -> f64 {
        let sign = Direction::of(self.velocity).sign();
        let left = self.limit - sign * self.pull();
        // A little more than it can take, and less than a slide.
        let most_s = left.max(0.0) / (self.stiffness * self.velocity.abs()) + self.tick_s;
        let (renderer, from_s) = (self.renderer.clone(), self.time_s);
        let mut lets_go_s = most_s;
        self.advance(most_s, &mut |at_s: f64, from: Contact, _: Contact| {
            if from == Contact::Stuck {
                lets_go_s = lets_go_s.min(at_s);
            }
        });
        // Up to there and no further.
        (self.renderer, self.time_s) = (renderer, from_s);
        self.advance(lets_go_s, &mut ());
        core::mem::take(&mut self.rested_s) + lets_go_s
    }

    /// Moves on by a time, s, or into the rest that begins meanwhile; when that is, s.
    fn slide(&mut self, time_s: f64) -> Option<f64> {
        let (renderer, from_s) = (self.renderer.clone(), self.time_s);
        let (mut sticks_s, mut lets_go_s) = (None, time_s);
        self.advance(time_s, &mut |at_s: f64, from: Contact, to: Contact| {
            if to == Contact::Stuck {
                sticks_s = sticks_s.or(Some(at_s));
            } else if from == Contact::Stuck && sticks_s.is_some() {
                lets_go_s = lets_go_s.min(at_s);
            }
        });
        let sticks_s = sticks_s?;
        if lets_go_s < time_s {
            (self.renderer, self.time_s) = (renderer, from_s);
            self.advance(0.5 * (sticks_s + lets_go_s), &mut ());
        }
        self.rested_s = self.time_s - from_s - sticks_s;
        Some(sticks_s)
    }

    /// Slides until the contact sticks: for how long, s, and the integral of the coupling force
    /// meanwhile, N s. `None` where it never does.
    fn slip(&mut self) -> Option<(f64, f64)> {
        let (mut slip_s, mut impulse) = (0.0, 0.0);
        let (mut tick_s, mut settled) = (self.tick_s, 0.0);
        for length in 0..LENGTHS * TICKS_OF_A_LENGTH {
            if length > 0 && length.is_multiple_of(TICKS_OF_A_LENGTH) {
                tick_s *= 2.0;
            }
            let from = self.stretch();
            let ended = self.slide(tick_s);
            let lasted_s = ended.unwrap_or(tick_s);
            let (mut to, speed) = (self.stretch(), self.renderer.state().velocity);
            to.0 -= self.velocity * self.rested_s;
            // The trapezoid rule with the slopes at both ends (Euler and Maclaurin).
            let stretched = 0.5 * lasted_s * (from.0 + to.0) + lasted_s * lasted_s / 12.0 * (from.1 - to.1);
            impulse += self.stiffness * stretched + self.damping * (to.0 - from.0);
            slip_s += lasted_s;
            if ended.is_some() {
                return Some((slip_s, impulse));
            }
            let steady = (speed - self.velocity).abs() <= SETTLED * self.velocity.abs();
            settled = if steady { settled + 1.0 } else { 0.0 };
            if settled >= TICKS_A_TURN {
                return None;
            }
        }
        None
    }

    /// How far the hand is ahead of the block, m, and by how much that grows, m/s.
    fn stretch(&self) -> (f64, f64) {
        let state = self.renderer.state();
        (state.deflection(), self.velocity - state.velocity)
    }
}
