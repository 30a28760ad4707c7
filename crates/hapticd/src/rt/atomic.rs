//! What the hand-over is built on. The models (`rt/model.rs`) put loom's counterparts in their
//! place and compile the same source again.

pub(crate) use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
