//! Whole-system tests that run one after the other: they pin processors, starve the machine, measure, or boot another.
//! Each begins with [`alone`].

mod attacks;
mod firmware_ports;
mod firmware_rendering;
mod machines;
mod real_time_claims;

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Waits until no other test of this binary runs, and keeps the others waiting until the guard is dropped.
fn alone() -> MutexGuard<'static, ()> {
    static RUNNING: Mutex<()> = Mutex::new(());
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}
