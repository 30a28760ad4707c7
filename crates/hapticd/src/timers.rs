//! The times at which the control thread looks: again and again, or right after each tick.
#![allow(
    unsafe_code,
    reason = "tokio requires that the timer stays open; see AnswerTimer::new"
)]

use crate::rt::clock::now_ns;
use haptic_ipc::{ErrorCode, WireError};
use rustix::fd::OwnedFd;
use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, timerfd_create, timerfd_settime,
};
use std::time::{Duration, Instant};
use tokio::io::unix::AsyncFd;
use tokio::time::{Interval, MissedTickBehavior, interval};

/// A tick now, and then one each period. After a time in which the thread was held up there is one, not all that were
/// missed: those would come at once, and a stop would wait for the work of each.
pub(crate) fn every(period: Duration) -> Interval {
    let mut ticks = interval(period);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    ticks
}

/// Usual time after a deadline at which a tick on the fake rig has ended, with the wake-up, ns.
const AFTER_DEADLINE_NS: u64 = 40_000;

/// Time between two further looks, until the next deadline, ns.
const LOOK_AGAIN_NS: u64 = 80_000;

/// Timeout of an answer from the real-time thread.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// Further looks for an answer after the timeout: this thread itself may have been held up, and the real-time thread
/// may not have run since.
const FINAL_CHECKS: u32 = 20;

/// Times to look for an answer, until it is late: shortly after each deadline of the loop, then periodically. Tokio's
/// own timers count whole milliseconds, which are whole ticks.
#[derive(Debug)]
pub(crate) struct AnswerTimer {
    asked: Instant,
    final_checks: u32,
    period_ns: u64,
    /// One deadline of the loop; the others differ by multiples of the period.
    deadline_ns: u64,
    timer: Option<AsyncFd<OwnedFd>>,
}

impl AnswerTimer {
    /// A timer for the loop's deadlines, from one of them if one is known.
    pub(crate) fn new(period_ns: u64, deadline_ns: Option<u64>) -> Self {
        let made = timerfd_create(
            TimerfdClockId::Monotonic,
            TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC,
        );
        // SAFETY: only the AsyncFd owns the descriptor, and it only lends it.
        let register = |timer| unsafe { AsyncFd::register(timer) }.ok();
        Self {
            asked: Instant::now(),
            final_checks: FINAL_CHECKS,
            period_ns,
            deadline_ns: deadline_ns.unwrap_or(0),
            // Without a descriptor the coarse timer is used.
            timer: made.ok().and_then(register),
        }
    }

    /// Waits for the next time to look. The real-time thread wakes no other: that would be a system call.
    ///
    /// # Errors
    /// The real-time thread has not answered in time.
    pub(crate) async fn next(&mut self) -> Result<(), WireError> {
        let is_late = self.asked.elapsed() > ANSWER_TIMEOUT;
        if is_late && self.final_checks == 0 {
            let message = format!(
                "the real-time thread has not answered for {} ms; cut the power of the motor if it still pulls",
                ANSWER_TIMEOUT.as_millis()
            );
            return Err(WireError::new(ErrorCode::NotResponding, message));
        }
        self.final_checks -= u32::from(is_late);
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
        Ok(())
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
        // It need not be read: setting it again clears it.
        fired.clear_ready();
        Some(())
    }
}
