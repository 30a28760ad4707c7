//! The standard error of a daemon, which is read, or not: then it fills up and takes nothing more.

use nix::fcntl::{FcntlArg, fcntl};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::{ioctl_fionread, read};
use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

/// Bytes that wait unread before a write stands still.
const ROOM: i32 = 4096;

/// The reader's end of an output. Its reader ends with the daemon.
#[derive(Debug)]
pub(super) struct Output {
    end: OwnedFd,
    is_held: Arc<AtomicBool>,
    bytes: Arc<AtomicU64>,
}

impl Output {
    /// Reads an output from now on.
    pub(super) fn of(end: &impl AsFd) -> Self {
        let end = end.as_fd().try_clone_to_owned().expect("a second handle");
        fcntl(&end, FcntlArg::F_SETPIPE_SZ(ROOM)).expect("a pipe");
        let output = Self {
            end: end.try_clone().expect("a third handle"),
            is_held: Arc::default(),
            bytes: Arc::default(),
        };
        let (is_held, bytes) = (Arc::clone(&output.is_held), Arc::clone(&output.bytes));
        thread::spawn(move || follow(&end, &is_held, &bytes));
        output
    }

    /// Stops reading, or goes on.
    pub(super) fn hold(&self, hold: bool) {
        self.is_held.store(hold, Ordering::SeqCst);
    }

    /// Whether a line more does not fit.
    pub(super) fn is_full(&self) -> bool {
        ioctl_fionread(&self.end).is_ok_and(|waiting| waiting > u64::from(ROOM.unsigned_abs()) * 9 / 10)
    }

    /// Bytes read so far.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::SeqCst)
    }
}

fn follow(end: &OwnedFd, is_held: &AtomicBool, bytes: &AtomicU64) {
    let mut buffer = [0; 4096];
    let soon = Timespec {
        tv_sec: 0,
        tv_nsec: 20_000_000,
    };
    loop {
        if is_held.load(Ordering::SeqCst) {
            thread::sleep(Duration::from_millis(5));
            continue;
        }
        // Not in a read that would take a line after it was asked to hold.
        let mut polled = [PollFd::new(end, PollFlags::IN)];
        if poll(&mut polled, Some(&soon)) == Ok(0) || is_held.load(Ordering::SeqCst) {
            continue;
        }
        match read(end, &mut buffer) {
            Ok(count @ 1..) => {
                bytes.fetch_add(count as u64, Ordering::SeqCst);
            }
            _ => return,
        }
    }
}
