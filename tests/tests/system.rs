//! Whole-system tests that run side by side: each has daemons of its own, and most of its time it waits.

mod adapters;
mod blocked_output;
mod book;
mod book_figures;
mod book_reference;
mod chatter;
mod check_rig;
mod commission;
mod compare;
mod control;
mod copied_command;
mod ctl;
mod ctl_all;
mod ctl_change;
mod ctl_doctor;
mod ctl_identify;
mod ctl_lease;
mod ctl_outputs;
mod ctl_record;
mod ctl_requests;
mod ctl_stop;
mod ctl_terse;
mod ctl_top;
mod ctl_wait;
mod examples;
mod firmware;
mod firmware_library;
mod forbidden_locks;
mod hand;
mod hazard_log;
mod identify_interrupted;
mod identify_rig;
mod identify_truth;
mod laws;
mod layout;
mod lease;
mod life;
mod link;
mod link_health;
mod log;
mod metrics;
mod other_programs;
mod outside_files;
mod package;
mod parquet_types;
mod plane;
mod recording_set;
mod release;
mod reload;
mod replay;
mod rig_friction;
mod safety;
mod schedule;
mod schema;
mod service;
mod simulate;
mod study;
mod systemd;
mod transcripts;
mod window;

use std::sync::{Condvar, Mutex, PoisonError};

/// Waits until at most one other test runs that boots an init or depends on a link's time: more of them together, and
/// the one that simulates a microcontroller, would keep the processors too busy for real time.
fn one_of_two() -> OneOfTwo {
    let running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
    let mut running = ENDED
        .wait_while(running, |running| *running == 2)
        .unwrap_or_else(PoisonError::into_inner);
    *running += 1;
    OneOfTwo
}

static RUNNING: Mutex<u32> = Mutex::new(0);
static ENDED: Condvar = Condvar::new();

/// One of two tests that may run at the same time, until it is dropped.
struct OneOfTwo;

impl Drop for OneOfTwo {
    fn drop(&mut self) {
        *RUNNING.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
        ENDED.notify_one();
    }
}
