//! Finds missing rows and missed periods between two rows.

use crate::metadata::Metadata;
use haptic_ipc::Sample;

/// What lies between a row and the one before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Gap {
    /// Rows that are missing and were not announced.
    pub(crate) lost: u64,
    /// Periods that the loop missed.
    pub(crate) missed: u64,
}

/// Follows ticks and deadlines from row to row.
#[derive(Debug)]
pub(crate) struct Gaps {
    /// Ticks from one row to the next.
    every: u64,
    period_s: f64,
    /// Tick and deadline of the last row, s.
    last: Option<(u64, f64)>,
    /// Missing rows that the daemon reported since.
    announced: u64,
}

impl Gaps {
    pub(crate) fn new(metadata: &Metadata) -> Self {
        let every = (metadata.loop_rate_hz / metadata.rate_hz).round();
        Self {
            // Saturates; not a number becomes 0.
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 1")]
            every: every.max(1.0) as u64,
            period_s: metadata.loop_rate_hz.recip(),
            last: None,
            announced: 0,
        }
    }

    /// Takes the number of missing rows that the daemon reports.
    pub(crate) fn announce(&mut self, rows: u64) {
        self.announced = self.announced.saturating_add(rows);
    }

    /// Takes the next row. The loop's deadlines are whole periods apart, and a tick each has one:
    /// more periods than ticks between two rows were missed.
    pub(crate) fn next(&mut self, row: &Sample) -> Gap {
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53 ns")]
        let deadline_s = row.t_s - row.wake_latency_ns as f64 * 1e-9;
        let announced = std::mem::take(&mut self.announced);
        let Some((last_tick, last_s)) = self.last.replace((row.tick, deadline_s)) else {
            return Gap::default();
        };
        // A daemon that was started again counts from the beginning.
        let Some(ticks @ 1..) = row.tick.checked_sub(last_tick) else {
            return Gap::default();
        };
        let lost = (ticks / self.every).saturating_sub(1);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates; not a number becomes 0"
        )]
        let periods = ((deadline_s - last_s) / self.period_s).round() as u64;
        Gap {
            lost: lost.saturating_sub(announced),
            missed: periods.saturating_sub(ticks),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{metadata, sample};

    fn row(tick: u64, deadline_ms: f64, wake_latency_ns: u64) -> Sample {
        Sample {
            tick,
            t_s: deadline_ms * 1e-3 + wake_latency_ns as f64 * 1e-9,
            wake_latency_ns,
            ..sample(0)
        }
    }

    #[test]
    fn absent_ticks_are_lost_rows_unless_announced() {
        let mut gaps = Gaps::new(&metadata());
        let mut lost = |announced, tick: u64| {
            gaps.announce(announced);
            gaps.next(&row(tick, tick as f64, 0)).lost
        };
        assert_eq!(lost(0, 100), 0, "what came before the first row is not missing");
        assert_eq!(lost(0, 101), 0);
        assert_eq!(lost(0, 105), 3);
        assert_eq!(lost(3, 109), 0);
        assert_eq!(lost(2, 113), 1);
        assert_eq!(lost(0, 114), 0, "an announcement is for the next row");
        assert_eq!(lost(0, 5), 0, "the daemon was started again");
        assert_eq!(lost(0, 7), 1);
    }

    #[test]
    fn a_thinned_recording_lacks_only_rows_of_its_own_rate() {
        let mut gaps = Gaps::new(&Metadata {
            rate_hz: 100.0,
            ..metadata()
        });
        let gap = |gaps: &mut Gaps, tick: u64, deadline_ms| gaps.next(&row(tick, deadline_ms, 0));
        assert_eq!(gap(&mut gaps, 10, 10.0), Gap::default());
        assert_eq!(gap(&mut gaps, 20, 20.0), Gap::default());
        assert_eq!(gap(&mut gaps, 50, 57.0), Gap { lost: 2, missed: 7 });
    }

    #[test]
    fn late_tick_misses_periods_only_for_skipped_deadlines() {
        let mut gaps = Gaps::new(&metadata());
        let mut missed = |tick, deadline_ms, late_ns| gaps.next(&row(tick, deadline_ms, late_ns)).missed;
        assert_eq!(missed(1, 1.5, 0), 0);
        assert_eq!(missed(2, 2.5, 900_000), 0, "late, and within its period");
        assert_eq!(missed(3, 3.5, 2_300_000), 0);
        assert_eq!(missed(4, 6.5, 0), 2, "the tick before took until after two deadlines");
        assert_eq!(missed(5, 7.5, 100), 0);
    }
}
