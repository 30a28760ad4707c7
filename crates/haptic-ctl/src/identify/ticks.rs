//! Every tick of an identification, as a record of force and motion.

use haptic_ipc::{Sample, SamplesEvent};
use haptic_lab::identify::Record;

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
        record(&self.rows[first..last.max(first)], resolution_m)
    }

    /// Position (m), velocity of the reference (m/s) and force (N) of a sweep's ticks.
    pub(super) fn sweep(&self, from: u64, to: u64) -> Vec<(f64, f64, f64)> {
        let rows = self.rows.iter().filter(|row| (from..=to).contains(&row.tick));
        rows.map(|row| (row.sample_position_m, row.block_velocity_mps, row.command_force_n))
            .collect()
    }
}

/// Positions at the times of the device's clock, each with the mean of the forces before and after it.
fn record(rows: &[Sample], resolution_m: f64) -> Record {
    let mut record = Record {
        resolution_m: (resolution_m > 0.0).then_some(resolution_m),
        ..Record::default()
    };
    let mut last: Option<&Sample> = None;
    for row in rows {
        let is_sample = row
            .input_word()
            .sample(row.device_sequence, row.device_time_ns, row.sample_position_m)
            .is_ok();
        // A sample that a tick has repeated is one sample.
        let is_new = last
            .is_none_or(|last| last.device_sequence != row.device_sequence && last.device_time_ns < row.device_time_ns);
        if !is_sample || !is_new {
            continue;
        }
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a run")]
        record.t_s.push(row.device_time_ns as f64 * 1e-9);
        record.position_m.push(row.sample_position_m);
        // The force of a tick acts until the next one.
        let before_n = last.map_or(0.0, |last| last.command_force_n);
        record.force_n.push(0.5 * (before_n + row.command_force_n));
        last = Some(row);
    }
    record
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_has_each_sample_once_with_the_force_around_it() {
        let row = |tick: u64, sequence: u32, force: f64| Sample {
            tick,
            device_sequence: sequence,
            device_time_ns: u64::from(sequence) * 1_000_000,
            sample_position_m: f64::from(sequence) * 1e-3,
            command_force_n: force,
            ..Sample::default()
        };
        let mut ticks = Ticks::default();
        ticks.take(&SamplesEvent {
            dropped: 3,
            rows: vec![
                row(7, 1, 0.0),
                row(8, 2, 1.0),
                row(9, 2, 2.0),
                row(10, 3, 3.0),
                row(11, 4, 3.0),
            ],
            ..SamplesEvent::default()
        });
        let record = ticks.record(7, 10, 1e-5);
        assert_eq!(record.t_s, [0.001, 0.002, 0.003]);
        assert_eq!(record.position_m, [0.001, 0.002, 0.003]);
        assert_eq!(record.force_n, [0.0, 0.5, 2.0]);
        assert_eq!((record.resolution_m, ticks.lost()), (Some(1e-5), 3));
    }
}
