//! The servo: everything between a measurement and a force, as one value.
//!
//! ```text
//! Inputs -> stop, stall, lease -> scene -> command -> sensing -> Renderer::tick -> Compensator -> SafetyLimiter -> Outputs
//! ```
//!
//! A servo has no clock, no device and no shared memory. Two servos with the same [`Settings`] that
//! are stepped through the same scenes and [`Inputs`] give the same [`Outputs`] to the last bit, on
//! any machine and in any build: a recording of the inputs holds every force.
//!
//! In a loop, or in a timer's interrupt, that reads an encoder and drives a motor:
//!
//! ```
//! use haptic_core::limiter::Limits;
//! use haptic_core::passivity::RigLosses;
//! use haptic_core::sample::{DeviceError, ErrorCode, Measurement};
//! use haptic_core::servo::{Command, CompiledScene, Event, Events, Inputs, Outputs, RigState, Servo, Settings};
//! use haptic_core::{Renderer, Scene, Scheme, velocity};
//!
//! const PERIOD_NS: u64 = 1_000_000;
//!
//! /// One tick: what the encoder reported becomes the force to command until the next tick.
//! fn tick(
//!     servo: &mut Servo,
//!     encoder: Result<Measurement, DeviceError>,
//!     events: Events,
//!     command: Option<Command>,
//! ) -> Outputs {
//!     let inputs = Inputs {
//!         elapsed_ns: PERIOD_NS,
//!         sample: encoder,
//!         device_resolution_m: 1e-6,
//!         device_force_limit_n: f64::INFINITY,
//!         events,
//!         command,
//!     };
//!     servo.step(&inputs, None)
//! }
//!
//! // Before the loop, as this allocates.
//! let settings = Settings {
//!     period_s: 1e-3,
//!     ramp_s: 0.1,
//!     limits: Limits { force_n: 5.0, ..Limits::default() },
//!     losses: RigLosses { damping: 0.0, friction: 0.0 },
//!     passivity_control_n: 0.0,
//!     velocity: velocity::Method::default(),
//!     stale_ns: 5 * PERIOD_NS,
//!     stop_button: None,
//!     enable_button: None,
//!     workspace: None,
//!     compensation: None,
//! };
//! let renderer = Renderer::new(&Scene::light_block(), Scheme::Exact, settings.period_s)?;
//! let mut servo = Servo::new(settings, Box::new(CompiledScene::at_once(renderer, 1)));
//!
//! // A hand that moves at 0.1 m/s, and a person who engages the rig in tick 10.
//! let mut force_on_hand_n = 0.0;
//! for k in 0..1000_u32 {
//!     let encoder = Measurement::new(k, u64::from(k) * PERIOD_NS, 1e-4 * f64::from(k));
//!     let command = (k == 10).then_some(Command::Engage);
//!     force_on_hand_n = tick(&mut servo, Ok(encoder), Events::default(), command).force_n;
//! }
//! assert_eq!(servo.state(), RigState::Engaged);
//! assert!((force_on_hand_n + 3.5).abs() < 0.01, "the block's friction pulls the hand back");
//!
//! // The encoder fails: zero force in that tick, and a fault that names the reason until a reset.
//! let outputs = tick(&mut servo, Err(DeviceError::Failed(ErrorCode::Sensor.into())), Events::default(), None);
//! assert!(!outputs.enabled && outputs.force_n == 0.0);
//! assert_eq!(servo.fault().map(|fault| fault.code()), Some("device"));
//!
//! // A stop overtakes everything, and a stopped rig refuses to engage.
//! let encoder = Measurement::new(1001, 1001 * PERIOD_NS, 0.1);
//! tick(&mut servo, Ok(encoder), Events::default(), Some(Command::Reset));
//! let encoder = Measurement::new(1002, 1002 * PERIOD_NS, 0.1);
//! let outputs = tick(&mut servo, Ok(encoder), Event::Stop.into(), Some(Command::Engage));
//! assert!(outputs.refused && servo.state() == RigState::Stopped);
//! # Ok::<(), haptic_core::SceneError>(())
//! ```
//!
//! Another scene goes into [`Servo::step`] as a [`CompiledScene`]; the one before is to be taken by
//! [`take_retired`](Servo::take_retired) and freed outside the loop.

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

/// Version of what a servo makes of its inputs; it changes with the rules of limits and doubt, as the forces do. 2: a
/// change of sign is one step for the slew limit, and a stiff surface doubts less than 0.3 mm. 3: a change of scene
/// carries the slide and the rest of a contact on.
pub const VERSION: u32 = 3;

pub use inputs::{Event, Events, InputWord, Inputs};
pub use sensing::{DECAY_S, SILENT_PERIODS};
pub use servo::{Servo, Settings};
pub use state::{Command, Fault, RigState};
pub use step::{OFF_TIMEOUT_NS, Outputs};
pub use transition::{CompiledScene, Steps, Transition};

#[cfg(test)]
mod tests;
