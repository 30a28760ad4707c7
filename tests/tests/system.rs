//! Whole-system tests that run side by side: each has daemons of its own, and most of its time it waits.

mod acceptance;
mod adapters;
mod blocked_output;
mod changes;
mod check_rig;
mod commission;
mod commission_pulse;
mod compare;
mod control;
mod cost;
mod ctl;
mod ctl_change;
mod ctl_doctor;
mod ctl_identify;
mod ctl_lease;
mod ctl_record;
mod ctl_recording;
mod ctl_requests;
mod ctl_stop;
mod ctl_top;
mod ctl_wait;
mod examples;
mod firmware;
mod forbidden_locks;
mod hazard_log;
mod identify_rig;
mod identify_truth;
mod laws;
mod layout;
mod lease;
mod library;
mod life;
mod link;
mod link_health;
mod log;
mod machine_record;
mod outside_files;
mod replay;
mod rig_friction;
mod safety;
mod schedule;
mod schema;
mod service;
mod simulate;
mod systemd;
mod transcripts;
mod usb_kernel;
mod window;

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Waits until at most one other test runs that boots an init or depends on a link's time: more of them together, and
/// the one that simulates a microcontroller, would keep the processors too busy for real time.
fn one_of_two() -> MutexGuard<'static, ()> {
    static RUNNING: [Mutex<()>; 2] = [const { Mutex::new(()) }; 2];
    let [first, second] = &RUNNING;
    first
        .try_lock()
        .unwrap_or_else(|_| second.lock().unwrap_or_else(PoisonError::into_inner))
}
