//! Offline work on scenes and recordings: the very code that the daemon runs, fed with a motion
//! from a file instead of a rig.
#![forbid(unsafe_code)]

pub mod accuracy;
pub mod compare;
pub mod cost;
pub mod drawing;
mod gaps;
pub mod identify;
pub mod motion;
pub mod replay;
mod robust_fit;
pub mod row;
pub mod simulate;
mod smoothing;
pub mod stats;
pub mod surface;
mod two_clocks;
