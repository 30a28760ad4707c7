//! Whether a device's clock can be believed before force flows: nothing is made of its errors without force, and
//! they, and those that were a fault, are reported to whoever wants to engage.

use crate::sample_clock::ClockError;
use crate::snapshot::Archive;

/// Time in which errors are counted, and for which a clock is in doubt after the last of them, ns.
const MEMORY_NS: u64 = 1_000_000_000;

/// Jumps in that time without a doubt: a device that began again makes one. A clock that wraps around at 16 bits of
/// microseconds jumps fifteen times.
const MAX_JUMPS: u32 = 4;

/// The errors of a clock.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ClockDoubt {
    since_ns: u64,
    jumps: u32,
    doubted: Option<(ClockError, u64)>,
}

impl ClockDoubt {
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.count("clock_errors_since_ns", &mut self.since_ns, u64::MAX);
        archive.count_u32("clock_jumps", &mut self.jumps);
        let blank = (ClockError::Jumped, 0);
        archive.option("clock_doubted", &mut self.doubted, blank, |archive, (error, at_ns)| {
            archive.choice("clock_error", error, &ClockError::ALL);
            archive.count("clock_error_ns", at_ns, u64::MAX);
        });
    }

    /// An error, at a time of ours.
    pub(super) fn add(&mut self, error: ClockError, now_ns: u64) {
        if now_ns.saturating_sub(self.since_ns) > MEMORY_NS {
            self.since_ns = now_ns;
            self.jumps = 0;
        }
        self.jumps += u32::from(error == ClockError::Jumped);
        if error != ClockError::Jumped || self.jumps > MAX_JUMPS {
            self.doubted = Some((error, now_ns));
        }
    }

    /// What is wrong with the clock, at a time of ours.
    pub(super) fn error(&self, now_ns: u64) -> Option<ClockError> {
        let (error, at_ns) = self.doubted?;
        (now_ns.saturating_sub(at_ns) <= MEMORY_NS).then_some(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    // hazard: H3
    #[test]
    fn drift_is_doubted_for_a_second_jumps_only_if_repeated() {
        for error in [ClockError::Drifts, ClockError::StoodStill] {
            let mut doubt = ClockDoubt::default();
            doubt.add(error, 5000 * MS);
            assert_eq!(doubt.error(6000 * MS), Some(error));
            assert_eq!(doubt.error(6001 * MS), None, "it is over");
        }
        // A clock of 16 bits that counts microseconds jumps every 65.5 ms.
        let mut doubt = ClockDoubt::default();
        let mut doubted_ms = 0;
        for ms in 0..10_000_u64 {
            if ms % 66 == 65 {
                doubt.add(ClockError::Jumped, ms * MS);
            }
            doubted_ms += u64::from(doubt.error(ms * MS) == Some(ClockError::Jumped));
        }
        assert!(doubted_ms > 9600, "in doubt all the time: {doubted_ms} ms");
        // One now and then.
        let mut doubt = ClockDoubt::default();
        for ms in (0..60_000_u64).step_by(251) {
            doubt.add(ClockError::Jumped, ms * MS);
            assert_eq!(doubt.error(ms * MS), None, "{ms} ms");
        }
    }
}
