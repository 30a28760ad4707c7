//! Signals are kept away from the threads that must not be interrupted by them.

use nix::sys::signal::{SigSet, Signal};

/// Signals that a thread's own fault raises. Blocked, they would end the process without a word.
const RAISED_BY_A_FAULT: [Signal; 7] = [
    Signal::SIGSEGV,
    Signal::SIGBUS,
    Signal::SIGFPE,
    Signal::SIGILL,
    Signal::SIGTRAP,
    Signal::SIGSYS,
    Signal::SIGABRT,
];

/// Blocks all signals in the calling thread but those that its own fault raises.
///
/// A signal to the process is for another thread: no handler runs in a tick. And a write itself can raise a signal that
/// would stop or kill the whole process with its loop: SIGTTOU in the background of a terminal, SIGXFSZ at the
/// limit of a file's size. With the signal blocked the write succeeds or fails.
pub(crate) fn block_signals() {
    let mut blocked = SigSet::all();
    for signal in RAISED_BY_A_FAULT {
        blocked.remove(signal);
    }
    // After a failure they stay as they were.
    blocked.thread_set_mask().unwrap_or_default();
}
