//! Cases of the whole system whose outcome depends on when the machine runs their threads.
//!
//! What such a case shows is proved below without a clock, in the servo or the tick; the whole system has one case of
//! it, which only the long run takes.

use std::cell::Cell;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::time::Duration;

/// Times that a case is run at most.
const TRIES: u32 = 2;

/// Time in which a daemon answers that is not hung.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(2);

thread_local! {
    /// Periods that the daemons of a failed case missed or overran, by their own count.
    static MISSED: Cell<u64> = const { Cell::new(0) };
}

/// Runs a case that depends on the machine's time, in the long run alone; the short one says that `what` was left out.
/// A case that fails is run once more if its own daemon has counted missed periods or overruns, and else has failed.
pub fn timed(what: &str, case: impl Fn()) {
    if test_run::is_long_for(what) {
        excused(case);
    }
}

/// Runs a case, and once more if it fails and its own daemon has counted missed periods or overruns.
fn excused(case: impl Fn()) {
    for tries_left in (0..TRIES).rev() {
        MISSED.set(0);
        let Err(failure) = catch_unwind(AssertUnwindSafe(&case)) else {
            return;
        };
        if tries_left == 0 || MISSED.get() == 0 {
            resume_unwind(failure);
        }
        println!("once more: its daemon missed or overran {} periods", MISSED.get());
    }
}

/// Counts the periods that a daemon missed or overran; none where it does not answer.
pub(crate) fn count_missed(socket: &Path) {
    let missed = missed(socket).unwrap_or(0);
    if missed > 0 {
        println!("its daemon missed or overran {missed} periods");
    }
    MISSED.set(MISSED.get() + missed);
}

/// Counts what the log of a daemon that has ended says of periods that it missed.
pub fn count_logged(log: &str) {
    let logged = u64::try_from(log.matches(" missed periods").count()).unwrap_or(u64::MAX);
    MISSED.set(MISSED.get() + logged);
}

fn missed(socket: &Path) -> Option<u64> {
    let mut stream = UnixStream::connect(socket).ok()?;
    stream.set_read_timeout(Some(ANSWER_TIMEOUT)).ok()?;
    stream.write_all(b"{\"id\":1,\"op\":\"timing\"}\n").ok()?;
    // After the greeting.
    let answer = BufReader::new(stream).lines().nth(1)?.ok()?;
    let answer: serde_json::Value = serde_json::from_str(&answer).ok()?;
    Some(answer["ok"]["missed_periods"].as_u64()? + answer["ok"]["overruns"].as_u64()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a case whose daemon misses so many periods in each try and that fails in its first tries; how often it was
    /// run, and whether it passed.
    fn tried(missed: u64, fails: u32) -> (u32, bool) {
        let times = Cell::new(0);
        let case = || {
            times.set(times.get() + 1);
            MISSED.set(missed);
            assert!(times.get() > fails, "too late");
        };
        let passed = catch_unwind(AssertUnwindSafe(|| excused(case))).is_ok();
        (times.get(), passed)
    }

    #[test]
    fn only_missed_periods_excuse_a_failure_and_only_once() {
        assert_eq!(tried(0, 0), (1, true));
        assert_eq!(tried(7, 0), (1, true), "it has passed");
        assert_eq!(tried(0, 1), (1, false), "nothing excuses it");
        assert_eq!(tried(7, 1), (2, true));
        assert_eq!(tried(7, 9), (2, false));
    }
}
