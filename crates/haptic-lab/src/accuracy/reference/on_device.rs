//! The true force of a law on the device itself, under a hand with constant acceleration between
//! two samples: where it turns is then known, and how fast it is everywhere.

use super::course::{Course, Driver};
use super::equations::{Law, Mode};
use crate::motion::DeviceSample;
use crate::simulate::{SimulatedRow, Simulation};
use haptic_core::Direction;
use haptic_core::friction::Friction;
use twofloat::TwoFloat;

/// The hand's acceleration, m/s^2.
struct Hand(f64);

impl Driver for Hand {
    fn acceleration(&self, _t: f64, _displacement: f64, _velocity: f64, _friction: f64) -> f64 {
        self.0
    }

    fn load(&self, _t: f64) -> Option<(f64, f64)> {
        None
    }

    fn sizes(&self) -> [f64; 2] {
        // The motion is given: nothing is left out of it.
        [0.0, 0.0]
    }

    fn advance(&mut self, _t: f64, _displacement: f64) {}
}

/// Solves with a tolerance, N: see [`TOLERANCE_N`](super::course::TOLERANCE_N).
pub(super) fn solve(law: &Friction, motion: &[DeviceSample], tolerance_n: f64) -> Simulation {
    let mut rows = Vec::with_capacity(motion.len());
    let first_velocity = motion.first().map_or(0.0, |sample| sample.velocity_mps);
    let (mode, z) = match law {
        Friction::Karnopp(_) | Friction::ResetIntegrator(_) | Friction::SalcudeanVlaar(_) => (Mode::Spring, 0.0),
        _ => Law(law).moving(Direction::of(first_velocity), 0.0, first_velocity, 0.0),
    };
    let mut course = Course::new(law, tolerance_n, first_velocity, mode, z);
    let mut last = motion.first().copied();
    for sample in motion {
        if let Some(last) = last.filter(|last| sample.t_s > last.t_s) {
            let elapsed_s = sample.t_s - last.t_s;
            course.w = TwoFloat::from(last.velocity_mps);
            let mut hand = Hand((sample.velocity_mps - last.velocity_mps) / elapsed_s);
            course.follow(&mut hand, 0.0, elapsed_s, |_, _, _| {});
        }
        let (force, _) = course
            .law
            .friction(sample.velocity_mps, f64::from(course.z), course.mode);
        rows.push(SimulatedRow {
            device: *sample,
            block_position_m: sample.position_m,
            block_velocity_mps: sample.velocity_mps,
            coupling_force_n: force,
            contact: course.contact(),
            at_bound: false,
        });
        last = Some(*sample);
    }
    Simulation {
        rows,
        ..Simulation::default()
    }
}
