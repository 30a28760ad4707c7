//! The end of a soak before its time: by SIGTERM, SIGINT and SIGHUP it ends its daemons, files and control groups.
#![allow(
    unsafe_code,
    reason = "a handler: a blocked signal would be blocked in every program that it starts"
)]

use nix::sys::signal::{SigHandler, Signal, signal};
use std::sync::atomic::{AtomicI32, Ordering};

/// The signal that has asked it to end, or 0.
static SIGNAL: AtomicI32 = AtomicI32::new(0);

/// Hears these signals from now on.
pub(super) fn listen() {
    for one in [Signal::SIGTERM, Signal::SIGINT, Signal::SIGHUP] {
        // SAFETY: the handler stores a number or ends the process, which it may at any moment.
        unsafe { signal(one, SigHandler::Handler(note_signal)) }.expect("a handler can be set");
    }
}

extern "C" fn note_signal(number: i32) {
    // A second signal does not wait for what hangs.
    if SIGNAL.swap(number, Ordering::SeqCst) != 0 {
        // SAFETY: it may be called at any moment, and runs nothing of this program.
        unsafe { libc::_exit(exit_code(number)) }
    }
}

/// The exit code for the signal that has asked it to end, if one has.
pub(super) fn asked() -> Option<i32> {
    let number = SIGNAL.load(Ordering::SeqCst);
    (number != 0).then(|| exit_code(number))
}

/// As a shell reports a program that a signal has ended.
const fn exit_code(number: i32) -> i32 {
    128 + number
}
