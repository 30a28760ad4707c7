//! Whole-system tests that run one after the other: they pin processors, starve the machine or measure. Each begins
//! with [`alone`].

mod attacks;
mod firmware_rendering;
mod held_bytes;
mod processor_share;
mod real_time_claims;
mod rt_purity;

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Waits until no other test of this binary runs, and keeps the others waiting until the guard is dropped.
fn alone() -> MutexGuard<'static, ()> {
    static RUNNING: Mutex<()> = Mutex::new(());
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}
