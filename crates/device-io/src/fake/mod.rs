//! A rig without hardware: a carriage with mass and friction, an encoder, and a hand that moves it.

mod fake_rig;
mod fault;
mod faulty_line;
mod firmware;
#[cfg(test)]
mod firmware_tests;
mod hand;
mod misbehaviour;
mod motion;
mod plant;
mod pointer;
mod program;
mod script;
mod terminal;

pub use fake_rig::FakeRig;
pub use fault::{Channel, Fault, Quality, TimedFault};
pub use faulty_line::FaultyLine;
pub use firmware::{Firmware, FirmwareProperties};
pub use hand::Hand;
pub use misbehaviour::{ClockFault, Misbehaviour};
pub use motion::{EndBehaviour, Motion, RETURN_S, Recording, TooShort};
pub use plant::{Plant, RigProperties, SUB_STEP_S};
pub use pointer::{LETS_GO_AFTER_MS, Pointer, PointerArm};
pub use program::{ProgramOptions, run};
pub use script::Order;
pub use terminal::{Terminal, plug_in};
