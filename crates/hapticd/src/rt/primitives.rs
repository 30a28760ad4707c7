//! What the hand-over is built on. The models (`rt/model.rs`) put loom's counterparts in their place and compile the same sources again.

pub(crate) use crossbeam::epoch::{Atomic, Owned, Shared as Pointer, unprotected};
pub(crate) use crossbeam::queue::ArrayQueue;
pub(crate) use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
