//! The compiled form of a friction law: a surface behind one virtual call, under a block or on the
//! device itself.

mod block_setup;
mod device;
mod surface;

pub(crate) use block_setup::BlockSetup;
pub(crate) use device::{ViscousSurface, YieldingSurface};
pub(crate) use surface::Surface;
