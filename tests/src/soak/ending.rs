//! The end of a soak before its time: SIGTERM, SIGINT and SIGHUP let it end its daemons, its files and its control groups.

use nix::sys::signal::{SigSet, Signal};
use std::sync::OnceLock;
use std::thread;

/// What has told it to end.
static TOLD: OnceLock<Signal> = OnceLock::new();

/// Hears these signals from now on, in every thread that is started later.
///
/// # Panics
/// The system does not let it.
pub(super) fn listen() {
    let mut signals = SigSet::empty();
    for signal in [Signal::SIGTERM, Signal::SIGINT, Signal::SIGHUP] {
        signals.add(signal);
    }
    // Its children begin with none blocked: the standard library sees to that.
    signals.thread_block().expect("signals can be blocked");
    thread::spawn(move || {
        while let Ok(signal) = signals.wait() {
            // Who says so twice does not wait for what hangs.
            if TOLD.set(signal).is_err() {
                std::process::exit(exit_code(signal));
            }
            eprintln!("{signal}: the soak ends its daemons, and has no report");
        }
    });
}

/// The signal that has told it to end, if one has.
pub(super) fn told() -> Option<Signal> {
    TOLD.get().copied()
}

/// As a shell tells of a program that a signal has ended.
pub(super) fn exit_code(signal: Signal) -> i32 {
    128 + signal as i32
}
