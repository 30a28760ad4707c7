//! A rig without hardware: a carriage on a line, or a mass in the plane, with friction, encoders, and a hand that moves
//! it.

mod fake_rig;
mod fault;
mod faulty_line;
mod firmware;
#[cfg(test)]
mod firmware_tests;
mod hand;
mod mechanics;
mod misbehaviour;
mod path;
mod planar_fake;
mod planar_rig;
mod plant;
mod pointer;
mod port;
mod program;

pub use fake_rig::FakeRig;
pub use fault::{Channel, Fault, Quality, TimedFault};
pub use faulty_line::{FaultyLine, Order};
pub use firmware::{Firmware, FirmwareProperties, complaint};
pub use hand::{Hand, HandMotion, Recording};
pub use mechanics::Mechanics;
pub use misbehaviour::{ClockFault, Misbehaviour};
pub use path::{Figure, Path};
pub use planar_fake::PlanarFake;
pub use planar_rig::{PlanarProperties, PlanarRig};
pub use plant::{Plant, RigProperties, SUB_STEP_S};
pub use pointer::{LETS_GO_AFTER_MS, Pointer, PointerArm};
pub use port::{Place, Port, PortClosed};
pub use program::{ProgramOptions, run};
