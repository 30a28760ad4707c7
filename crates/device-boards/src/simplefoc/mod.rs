//! A board with SimpleFOC's Commander, version 2.3 and 2.4. Tried against a fake, never on a real
//! board.
//!
//! Source: SimpleFOC's documentation, "Commander interface" and "Motor commands"
//! (docs.simplefoc.com).
//!
//! Its Commander has no watchdog: if the host dies, the motor keeps its last torque.
//! docs/adapters.md has a few lines for the firmware that fix this.

mod dialect;
mod greeting;
mod options;
mod target_unit;
#[cfg(test)]
mod tests;
mod words;

pub use options::SimpleFocOptions;
pub use target_unit::TargetUnit;
