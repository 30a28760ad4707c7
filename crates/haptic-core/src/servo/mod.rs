//! The servo: everything between a measurement and a force, as one value.
//!
//! ```text
//! Inputs -> stop, stall, lease -> scene -> command -> sensing -> Renderer::tick -> Compensator -> SafetyLimiter -> Outputs
//! ```
//!
//! A servo has no clock, no device and no shared memory. Two servos with the same [`Settings`] that
//! are stepped through the same scenes and [`Inputs`] give the same [`Outputs`] to the last bit, on
//! any machine and in any build: a recording of the inputs holds every force.

mod clock_doubt;
mod compile;
mod inputs;
mod rig;
mod sensing;
#[expect(clippy::module_inception, reason = "the value that the folder is named after")]
mod servo;
mod state;
mod step;
mod transition;

/// Version of what a servo makes of its inputs; it changes with the rules of limits and doubt, as the forces do. 2: a change
/// of sign is one step for the slew limit, and a stiff surface doubts less than 0.3 mm. 3: a change of scene carries the
/// slide and the rest of a contact on.
pub const VERSION: u32 = 3;

pub use inputs::{Event, Events, InputWord, Inputs};
pub use sensing::{DECAY_S, SILENT_PERIODS};
pub use servo::{Servo, Settings};
pub use state::{Command, Fault, RigState};
pub use step::{OFF_TIMEOUT_NS, Outputs};
pub use transition::{CompiledScene, Steps, Transition};

#[cfg(test)]
mod tests;
