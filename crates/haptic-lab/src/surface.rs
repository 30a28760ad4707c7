//! A real surface, simulated: what a lab would record of it.
//!
//! The mass is moved by the reference solver, which shares no line with the daemon's scheme: so a
//! record of it can stand for a surface that hapticd has never rendered.

use crate::accuracy::reference;
use crate::identify::Record;
use crate::identify::study::{Experiment, Movement, Sensors, Truth};
use crate::motion::DeviceSample;
use crate::simulate::Start;
use haptic_core::Scene;
use haptic_core::friction::Friction;
use haptic_core::scene::{Block, Coupling};

/// What the hand holds the mass by. It is soft enough that the slip after a breakaway, of twice the fall
/// of the force over the stiffness, is several steps of an encoder.
pub const GRIP: Coupling = Coupling {
    stiffness: 5000.0,
    damping: 30.0,
};

/// What a lab does with a surface: a rest, in which a rig can be engaged that replays the motion,
/// strokes of 30 mm at 0.5 to 3 Hz, and ramps of 1 mm/s for the static friction.
#[must_use]
pub fn experiment(mass_kg: f64, friction: Friction, sensors: Sensors) -> Experiment {
    let truth = Truth {
        mass_kg,
        friction,
        offset_n: 0.0,
    };
    Experiment {
        sensors,
        grip: GRIP,
        ..Experiment::thorough(truth)
    }
    .with_movements(&[
        Movement::Rest { duration_s: 2.0 },
        Movement::Chirp {
            from_hz: 0.5,
            to_hz: 3.0,
            stroke_m: 0.03,
            duration_s: 12.0,
        },
        Movement::Rest { duration_s: 0.5 },
        Movement::Ramp {
            speed_mps: 0.001,
            stroke_m: 0.0015,
            duration_s: 12.0,
        },
        Movement::Rest { duration_s: 0.5 },
    ])
}

/// What a lab has recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct LabRecord {
    /// The mass and the force that drives it, as their sensors see them.
    pub mass: Record,
    /// Motion of the hand, which holds the mass by the grip.
    pub hand: Vec<DeviceSample>,
}

/// The record of an experiment: the true motion, as its sensors see it.
///
/// # Panics
/// The truth is not valid as a scene.
#[must_use]
pub fn record(experiment: &Experiment, seed: u64) -> LabRecord {
    let scene = Scene {
        name: String::new(),
        block: Some(Block {
            mass: experiment.truth.mass_kg,
        }),
        coupling: Some(experiment.grip),
        friction: experiment.truth.friction,
    };
    let hand = experiment.hand();
    let truth = reference::solve(&scene, &hand, Start::default());
    let motion = Record {
        t_s: truth.rows.iter().map(|row| row.device.t_s).collect(),
        position_m: truth.rows.iter().map(|row| row.block_position_m).collect(),
        force_n: truth
            .rows
            .iter()
            .map(|row| row.coupling_force_n + experiment.truth.offset_n)
            .collect(),
        ..Record::default()
    };
    LabRecord {
        mass: experiment.sensors.watch(&motion, seed),
        hand,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::friction::Karnopp;

    #[test]
    fn the_record_is_that_of_the_law_as_its_sensors_see_it() {
        let friction = Friction::Karnopp(Karnopp::new(2.2, 2.0));
        let mut experiment = experiment(1.0, friction, Sensors::USUAL);
        // The ramps alone, and no noise.
        experiment.movements.drain(..2);
        experiment.sensors.force_noise_n = 0.0;
        let record = record(&experiment, 1).mass;
        assert_eq!(record.t_s.len(), 13_001);
        let greatest = record.force_n.iter().copied().fold(0.0, f64::max);
        let least = record.force_n.iter().copied().fold(0.0, f64::min);
        // A pull of 5 N/mm at 1 mm/s rises by 0.005 N from sample to sample, and continues to rise until the
        // mass is as fast, within 5 ms.
        for limit in [greatest, -least] {
            assert!((2.19..2.22).contains(&limit), "{limit}");
        }
        let counts = record.position_m.iter().map(|position| position / 1e-5);
        assert!(counts.clone().all(|count| (count - count.round()).abs() < 1e-6));
        assert!(counts.fold(0.0, f64::max) > 100.0);
    }
}
