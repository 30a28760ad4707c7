//! The compiled form of a friction law: a surface behind one virtual call, under a block or on the
//! device itself.

mod behind_block;
mod device;
mod surface;

pub(crate) use behind_block::BehindBlock;
pub(crate) use device::{ViscousSurface, YieldingSurface};
pub(crate) use surface::Surface;
