//! The true motion of a block under any law, between samples on a straight line of `K p + B v`.

use super::course::{Course, Driver};
use super::equations::{Law, Mode, has_stuck_state};
use crate::motion::DeviceSample;
use crate::simulate::{ContactChange, SimulatedRow, Simulation, Start};
use haptic_core::Direction;
use haptic_core::friction::Friction;
use haptic_core::scene::Coupling;
use twofloat::TwoFloat;

/// A rest, s, after which no limit rises any more.
const LONG_REST_S: f64 = 1e9;

fn exact(value: f64) -> TwoFloat {
    TwoFloat::from(value)
}

/// The coupling's pull on a block.
struct Pull {
    mass: f64,
    stiffness: f64,
    damping: f64,
    /// Newtons for a meter a second, of which a force is made at most.
    per_speed: f64,
    /// `K p + B v` at the start of the tick, N, and its slope, N/s.
    at_start: TwoFloat,
    slope: TwoFloat,
    /// Block position, m.
    x: TwoFloat,
    /// The load at rest at the start of the piece, N, and when that is, s.
    load: f64,
    since: f64,
}

impl Pull {
    /// The pull on a block at a position, m, before its first tick.
    fn new(mass: f64, coupling: &Coupling, law: &Friction, position_m: f64) -> Self {
        let (stiffness, damping) = (coupling.stiffness, coupling.damping);
        Self {
            mass,
            stiffness,
            damping,
            per_speed: damping + ((stiffness + law.contact_stiffness(false)) * mass).sqrt(),
            at_start: exact(0.0),
            slope: exact(0.0),
            x: exact(position_m),
            load: 0.0,
            since: 0.0,
        }
    }

    /// `K p + B v` of a sample, N.
    fn drive(&self, sample: &DeviceSample) -> TwoFloat {
        exact(self.stiffness) * exact(sample.position_m) + exact(self.damping) * exact(sample.velocity_mps)
    }

    /// Begins a tick: from one sample to the next, `elapsed_s` later.
    fn begin_tick(&mut self, from: &DeviceSample, to: &DeviceSample, elapsed_s: f64) {
        self.at_start = self.drive(from);
        self.slope = (self.drive(to) - self.drive(from)) / exact(elapsed_s);
        self.set_out(0.0);
    }

    /// The coupling's force, N, on a block of velocity `w`, m/s, at a sample.
    fn force(&self, sample: &DeviceSample, w: TwoFloat) -> f64 {
        let force = exact(self.stiffness) * (exact(sample.position_m) - self.x)
            + exact(self.damping) * (exact(sample.velocity_mps) - w);
        f64::from(force)
    }

    fn set_out(&mut self, t: f64) {
        let load = self.at_start + self.slope * exact(t) - exact(self.stiffness) * self.x;
        (self.load, self.since) = (f64::from(load), t);
    }
}

impl Driver for Pull {
    fn acceleration(&self, t: f64, displacement: f64, velocity: f64, friction: f64) -> f64 {
        let load = self.load + f64::from(self.slope) * (t - self.since) - self.stiffness * displacement;
        (load - self.damping * velocity - friction) / self.mass
    }

    fn load(&self, t: f64) -> Option<(f64, f64)> {
        let load = self.at_start + self.slope * exact(t) - exact(self.stiffness) * self.x;
        Some((f64::from(load), f64::from(self.slope)))
    }

    fn sizes(&self) -> [f64; 2] {
        [self.stiffness, self.per_speed]
    }

    fn advance(&mut self, t: f64, displacement: f64) {
        self.x += exact(displacement);
        self.set_out(t);
    }
}

/// The mode of the contact at the start, and its own state.
fn mode_at_start(law: &Friction, start: Start, first: &DeviceSample) -> (Mode, f64) {
    let equations = Law(law);
    match law {
        Friction::Karnopp(_) if start.velocity_mps == 0.0 => (Mode::Rigid, 0.0),
        Friction::ResetIntegrator(_) | Friction::SalcudeanVlaar(_) if start.velocity_mps == 0.0 => (Mode::Spring, 0.0),
        _ => {
            let direction = Direction::of(if start.velocity_mps == 0.0 {
                first.velocity_mps
            } else {
                start.velocity_mps
            });
            equations.moving(
                direction,
                equations.limit(direction, LONG_REST_S),
                start.velocity_mps,
                0.0,
            )
        }
    }
}

/// Solves with a tolerance, N: see [`TOLERANCE_N`](super::course::TOLERANCE_N).
pub(super) fn solve(
    mass: f64,
    coupling: &Coupling,
    law: &Friction,
    motion: &[DeviceSample],
    start: Start,
    tolerance_n: f64,
) -> Simulation {
    let (mut rows, mut events) = (Vec::with_capacity(motion.len()), Vec::new());
    let first = motion.first().copied().unwrap_or_default();
    let equations = Law(law);
    let (mode, z) = mode_at_start(law, start, &first);
    let mut course = Course::new(law, tolerance_n, start.velocity_mps, mode, z);
    let mut pull = Pull::new(mass, coupling, law, start.position_m.unwrap_or(first.position_m));
    let mut last = first;
    for sample in motion {
        let elapsed_s = sample.t_s - last.t_s;
        if elapsed_s > 0.0 {
            pull.begin_tick(&last, sample, elapsed_s);
            course.follow(&mut pull, 0.0, elapsed_s, |at, from, to| {
                let (from, to) = (equations.contact(0.0, 0.0, from), equations.contact(0.0, 0.0, to));
                if from != to && has_stuck_state(law) {
                    events.push(ContactChange {
                        t_s: last.t_s + at,
                        from,
                        to,
                    });
                }
            });
        }
        rows.push(SimulatedRow {
            device: *sample,
            block_position_m: f64::from(pull.x),
            block_velocity_mps: f64::from(course.w),
            coupling_force_n: pull.force(sample, course.w),
            contact: course.contact(),
            at_bound: false,
        });
        last = *sample;
    }
    Simulation {
        rows,
        events,
        ..Simulation::default()
    }
}
