//! What a friction law compiles to: a surface behind one virtual call, behind a block or on the
//! device itself.

mod behind_block;
mod device;
mod surface;

pub(crate) use behind_block::BehindBlock;
pub(crate) use device::{ViscousSurface, YieldingSurface};
pub(crate) use surface::Surface;
