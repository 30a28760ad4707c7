//! Time, and waiting for the next deadline.

use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

const NS_PER_S: u64 = 1_000_000_000;

/// The monotonic clock, ns.
pub(crate) fn now_ns() -> u64 {
    read_ns(ClockId::Monotonic)
}

fn read_ns(clock: ClockId) -> u64 {
    let time = clock_gettime(clock);
    // These clocks count from boot and are never negative.
    time.tv_sec.cast_unsigned() * NS_PER_S + time.tv_nsec.cast_unsigned()
}

fn sleep_until(deadline_ns: u64) {
    let request = Timespec {
        tv_sec: i64::try_from(deadline_ns / NS_PER_S).unwrap_or(i64::MAX),
        tv_nsec: i64::try_from(deadline_ns % NS_PER_S).unwrap_or(0),
    };
    // A signal may end the sleep early; the deadline stands.
    while clock_nanosleep_absolute(ClockId::Monotonic, &request) == Err(rustix::io::Errno::INTR) {}
}

/// How the last stretch before a deadline is waited for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting {
    /// Asleep up to this long before the deadline, ns, and spinning from there: waking up takes its
    /// time. Zero sleeps to the end.
    pub(crate) spin_ns: u64,
}

/// A grid of deadlines. A deadline that has passed is skipped and counted, never made up for: ticks
/// do not come back to back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    period_ns: u64,
    deadline_ns: u64,
    missed: u64,
}

/// When a tick was due and when it began.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wake {
    pub(crate) deadline_ns: u64,
    pub(crate) began_ns: u64,
    /// How long the machine has been suspended since it was booted, ns: the monotonic clock stands
    /// still meanwhile.
    pub(crate) asleep_ns: u64,
}

impl Grid {
    /// A grid that begins a period or two after `now_ns`, with its deadlines `phase_ns` after the
    /// multiples of the period: the kernel's own tick sits on those.
    pub(crate) fn new(period_ns: u64, phase_ns: u64, now_ns: u64) -> Self {
        let deadline_ns = (now_ns / period_ns + 2) * period_ns + phase_ns;
        Self {
            period_ns,
            deadline_ns,
            missed: 0,
        }
    }

    /// Deadlines skipped so far.
    pub(crate) fn missed(&self) -> u64 {
        self.missed
    }

    /// Waits for the next deadline.
    pub(crate) fn wait(&self, waiting: Waiting) -> Wake {
        sleep_until(self.deadline_ns.saturating_sub(waiting.spin_ns));
        // In this order a loop that is held up between the two readings has slept less, and not more.
        let since_boot_ns = read_ns(ClockId::Boottime);
        let asleep_ns = since_boot_ns.saturating_sub(now_ns());
        let mut began_ns = now_ns();
        // Without the processor's pause instruction: a hypervisor takes many of those for a lock
        // that is waited for, and the core away.
        while began_ns < self.deadline_ns {
            began_ns = now_ns();
        }
        Wake {
            deadline_ns: self.deadline_ns,
            began_ns,
            asleep_ns,
        }
    }

    /// Moves on to the next deadline after `now_ns`.
    pub(crate) fn advance(&mut self, now_ns: u64) {
        self.deadline_ns += self.period_ns;
        if now_ns >= self.deadline_ns {
            let skipped = (now_ns - self.deadline_ns) / self.period_ns + 1;
            self.missed += skipped;
            self.deadline_ns += skipped * self.period_ns;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn duration(clock: ClockId) -> Duration {
        Duration::try_from(clock_gettime(clock)).expect("since boot")
    }

    /// How often this thread has gone to sleep.
    fn sleeps() -> u64 {
        std::fs::read_to_string("/proc/thread-self/status")
            .expect("a Linux")
            .lines()
            .find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"))
            .and_then(|count| count.trim().parse().ok())
            .expect("it is counted")
    }

    #[test]
    fn wait_ends_at_its_deadline_and_sleeps_until_it_spins() {
        // A spin long enough for a busy machine to wake up within it.
        for spin_ns in [0, 20_000_000] {
            // Deadlines a fifth of a second apart, in the middle of a second or at its end.
            let mut grid = Grid::new(200_000_000, 100_000_000, now_ns());
            let slept = sleeps();
            for _ in 0..3 {
                let worked = duration(ClockId::ThreadCPUTime);
                let wake = grid.wait(Waiting { spin_ns });
                let worked = duration(ClockId::ThreadCPUTime) - worked;
                assert!(wake.began_ns >= wake.deadline_ns, "{wake:?}");
                assert!(worked < Duration::from_millis(50), "it worked for {worked:?}");
                grid.advance(now_ns());
            }
            // Where others keep it from the processor it does not work for long even if it spins.
            assert!(sleeps() > slept, "it never slept");
        }
    }

    #[test]
    fn a_stall_is_counted_to_the_period_and_not_made_up_for() {
        let mut grid = Grid::new(1_000_000, 500_000, 0);
        let first = grid.deadline_ns;
        grid.advance(first + 20_000);
        assert_eq!((grid.deadline_ns, grid.missed()), (first + 1_000_000, 0));
        // The tick due at first + 1 ms ends 5.2 ms late: the deadlines at +2, +3, +4, +5 and +6 ms
        // have passed.
        grid.advance(first + 6_200_000);
        assert_eq!((grid.deadline_ns, grid.missed()), (first + 7_000_000, 5));
        // Exactly on a deadline, that deadline has passed.
        grid.advance(first + 8_000_000);
        assert_eq!((grid.deadline_ns, grid.missed()), (first + 9_000_000, 6));
    }
}
