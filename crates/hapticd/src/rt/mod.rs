//! The real-time thread and everything that touches it.
//!
//! Nothing here allocates, locks, logs, formats or waits for anyone once the loop runs; its only
//! system calls are the sleep and the device's own.
// clippy.toml lists what waits. Tests may: they wait for each other.
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

pub(crate) mod clock;
pub(crate) mod handoff;
pub(crate) mod inbox;
pub(crate) mod lateness;
#[cfg(all(test, feature = "loom", not(miri)))]
mod model;
pub(crate) mod outbox;
#[cfg(all(test, target_os = "linux", not(miri)))]
mod panic_tests;
pub(crate) mod privileges;
#[cfg(all(test, target_os = "linux", not(miri)))]
mod purity_tests;
pub(crate) mod schedule;
pub(crate) mod shared;
pub(crate) mod space;
pub(crate) mod thread;
pub(crate) mod tick;
#[cfg(all(test, target_arch = "x86_64", target_os = "linux", not(miri)))]
mod tick_budget_tests;

/// What the hand-over is built on. The models (`model.rs`) put loom's counterparts in their place and compile the same
/// source again.
mod atomic {
    pub(crate) use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
}
