//! Waiting for the next tick to end, as nearly as an ordinary thread can: tokio's own timers count
//! whole milliseconds, which are whole ticks.
#![allow(
    unsafe_code,
    reason = "tokio wants to be promised that the timer stays open; see Pulse::new"
)]

use crate::rt::clock::now_ns;
use rustix::fd::OwnedFd;
use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, timerfd_create, timerfd_settime,
};
use std::time::Duration;
use tokio::io::unix::AsyncFd;

/// A tick on the fake rig, and waking up, are over after so long, most of the time.
const AFTER_DEADLINE_NS: u64 = 40_000;

/// Looks from then on, until the next deadline.
const LOOK_AGAIN_NS: u64 = 80_000;

/// Times to look: shortly after each deadline of the loop, then again and again.
#[derive(Debug)]
pub(super) struct Pulse {
    period_ns: u64,
    /// A deadline of the loop; the others are multiples of the period away.
    deadline_ns: u64,
    timer: Option<AsyncFd<OwnedFd>>,
}

impl Pulse {
    /// The loop's deadlines from one of them, where one is known.
    pub(super) fn new(period_ns: u64, deadline_ns: Option<u64>) -> Self {
        let made = timerfd_create(
            TimerfdClockId::Monotonic,
            TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC,
        );
        // SAFETY: the descriptor is owned by the AsyncFd alone, which never hands it out but to be
        // borrowed.
        let register = |timer| unsafe { AsyncFd::register(timer) }.ok();
        Self {
            period_ns,
            deadline_ns: deadline_ns.unwrap_or(0),
            // Out of descriptors: the coarse timer has to do.
            timer: made.ok().and_then(register),
        }
    }

    /// Waits for the next time to look.
    pub(super) async fn next(&mut self) {
        let now = now_ns();
        let within = now.saturating_sub(self.deadline_ns) % self.period_ns;
        let wait_ns = if within < AFTER_DEADLINE_NS {
            AFTER_DEADLINE_NS - within
        } else {
            (self.period_ns - within + AFTER_DEADLINE_NS).min(LOOK_AGAIN_NS)
        };
        if self.sleep(wait_ns).await.is_none() {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }

    async fn sleep(&self, wait_ns: u64) -> Option<()> {
        let timer = self.timer.as_ref()?;
        let once = Itimerspec {
            it_interval: Timespec { tv_sec: 0, tv_nsec: 0 },
            it_value: Timespec {
                tv_sec: 0,
                tv_nsec: i64::try_from(wait_ns).ok()?,
            },
        };
        timerfd_settime(timer.get_ref(), TimerfdTimerFlags::empty(), &once).ok()?;
        let mut fired = timer.readable().await.ok()?;
        // Whether it has been read makes no difference: it is set anew.
        fired.clear_ready();
        Some(())
    }
}
