//! Every tick of an identification, as a record of force and motion.

use haptic_ipc::{Sample, SamplesEvent};
use haptic_lab::identify::Record;
use haptic_lab::identify::record_file::of_device;

/// The ticks so far. The force that drives the handle is the motor's, also while it is zero.
#[derive(Debug, Default)]
pub(super) struct Ticks {
    rows: Vec<Sample>,
    lost: u64,
}

impl Ticks {
    pub(super) fn take(&mut self, event: &SamplesEvent) {
        self.lost += event.dropped;
        self.rows.extend(&event.rows);
    }

    /// Leaves out what came after a tick: of a motion that was interrupted, and of the hand that put the handle back.
    pub(super) fn discard_after(&mut self, tick: Option<u64>) {
        self.rows
            .truncate(self.rows.partition_point(|row| Some(row.tick) <= tick));
    }

    pub(super) fn after(&self, tick: Option<u64>) -> &[Sample] {
        &self.rows[self.rows.partition_point(|row| Some(row.tick) <= tick)..]
    }

    pub(super) fn newest(&self) -> Option<u64> {
        self.rows.last().map(|row| row.tick)
    }

    /// Ticks that the daemon has not reported.
    pub(super) fn lost(&self) -> u64 {
        self.lost
    }

    /// The record from the first tick of a motion to the last, but for `from` and `to`.
    pub(super) fn record(&self, from: u64, to: u64, resolution_m: f64) -> Record {
        let first = self.rows.partition_point(|row| row.tick < from);
        let last = self.rows.partition_point(|row| row.tick <= to);
        of_device(&self.rows[first..last.max(first)], resolution_m)
    }

    /// Position (m), velocity of the reference (m/s) and force (N) of a sweep's ticks.
    pub(super) fn sweep(&self, from: u64, to: u64) -> Vec<(f64, f64, f64)> {
        let rows = self.rows.iter().filter(|row| (from..=to).contains(&row.tick));
        rows.map(|row| (row.sample_position_m, row.block_velocity_mps, row.command_force_n))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_ticks_are_counted_and_a_record_has_its_own_alone() {
        let mut ticks = Ticks::default();
        for (dropped, seen) in [(3, 6..9), (2, 9..13)] {
            let rows = seen.map(|tick| Sample {
                tick: tick.into(),
                t_s: f64::from(tick) * 1e-3,
                device_sequence: tick,
                device_time_ns: u64::from(tick) * 1_000_000,
                ..Sample::default()
            });
            ticks.take(&SamplesEvent {
                dropped,
                rows: rows.collect(),
                ..SamplesEvent::default()
            });
        }
        let record = ticks.record(7, 10, 1e-5);
        assert_eq!((ticks.lost(), record.t_s.len()), (5, 4), "{record:?}");
    }
}
