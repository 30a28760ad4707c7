//! The compiled form of a friction law: a surface behind one virtual call, under a block or on the
//! device itself.

mod block_setup;
mod device;
mod legs;
mod surface;

pub(crate) use block_setup::BlockSetup;
pub(crate) use device::{DeviceSurface, ViscousSurface};
pub(crate) use legs::TickMotion;
pub(crate) use surface::{Surface, VisibleState};
