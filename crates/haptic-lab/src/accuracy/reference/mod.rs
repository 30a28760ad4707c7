//! The block's true motion, by solvers that share nothing with the ticks that they judge: no closed
//! form, no formula for an event, no code of a law.

mod equations;
mod fine;
mod taylor;

use crate::motion::DeviceSample;
use crate::simulate::{Simulation, Start};
use haptic_core::Scene;
use haptic_core::friction::{Friction, Karnopp};

/// The true motion of a block under any law.
///
/// Under Karnopp's law, without its options, and under drag it is true to the last digit that a
/// number has; under the others, whose equations have no series of a few terms, to about 1e-9 of
/// the forces.
///
/// # Panics
/// The scene has no block, is not valid, or has a law whose equations are not written down here.
#[must_use]
pub fn solve(scene: &Scene, motion: &[DeviceSample], start: Start) -> Simulation {
    let (block, coupling) = (scene.block.expect("a block"), scene.coupling.expect("a coupling"));
    match &scene.friction {
        Friction::Karnopp(law) if law.stribeck_velocity == 0.0 && law.rising_rate == 0.0 => {
            taylor::solve(block.mass, &coupling, law, motion, start)
        }
        Friction::Viscous(law) => {
            let drag = Karnopp {
                viscous: law.viscous,
                ..Karnopp::new(0.0, 0.0)
            };
            taylor::solve(block.mass, &coupling, &drag, motion, start)
        }
        law => fine::solve(block.mass, &coupling, law, motion, start),
    }
}
