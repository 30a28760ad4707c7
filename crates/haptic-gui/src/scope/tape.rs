//! Samples in the order of time: the last minute of a live rig, or a recording.

use haptic_ipc::Sample;
use std::collections::VecDeque;
use std::ops::Range;

/// How much of a live rig's past is kept, s.
pub(crate) const KEPT_S: f64 = 60.0;

/// Samples of a live rig kept at most, whatever rate the daemon sends: a minute of 4 kHz.
const MAX_LIVE_SAMPLES: usize = 240_000;

/// Samples, oldest first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tape {
    samples: VecDeque<Sample>,
}

impl Tape {
    /// The whole of a recording. A row with a number that is none is left out: it cannot be drawn.
    pub(crate) fn recorded(rows: impl IntoIterator<Item = Sample>) -> Self {
        let mut tape = Self::default();
        for row in rows {
            tape.push(row);
        }
        tape
    }

    /// Adds a batch of a live rig, and drops what is too old.
    pub(crate) fn extend(&mut self, rows: impl IntoIterator<Item = Sample>) {
        for row in rows {
            self.push(row);
        }
        let Some(newest) = self.newest_s() else {
            return;
        };
        while self
            .samples
            .front()
            .is_some_and(|first| first.t_s < newest - KEPT_S || self.samples.len() > MAX_LIVE_SAMPLES)
        {
            self.samples.pop_front();
        }
    }

    fn push(&mut self, row: Sample) {
        if !is_finite(&row) {
            return;
        }
        if self.samples.back().is_some_and(|last| row.t_s < last.t_s) {
            // The loop's clock began anew; older rows belong to another life of it.
            self.samples.clear();
        }
        self.samples.push_back(row);
    }

    /// The newest sample.
    pub(crate) fn last(&self) -> Option<&Sample> {
        self.samples.back()
    }

    /// Time of the newest sample, s on the daemon's clock.
    pub(crate) fn newest_s(&self) -> Option<f64> {
        self.samples.back().map(|sample| sample.t_s)
    }

    /// Time of the oldest sample, s on the daemon's clock.
    pub(crate) fn oldest_s(&self) -> Option<f64> {
        self.samples.front().map(|sample| sample.t_s)
    }

    /// The samples from one time to another, s on the daemon's clock, both included.
    pub(crate) fn within(&self, from_s: f64, to_s: f64) -> impl Iterator<Item = &Sample> + Clone {
        self.samples.range(self.places(from_s, to_s))
    }

    /// The same with one more at either side, so that a line reaches the edges of what is seen.
    pub(crate) fn around(&self, from_s: f64, to_s: f64) -> impl Iterator<Item = &Sample> + Clone {
        let Range { start, end } = self.places(from_s, to_s);
        self.samples
            .range(start.saturating_sub(1)..(end + 1).min(self.samples.len()))
    }

    /// What was so at a time: the newest sample that is not after it.
    pub(crate) fn at(&self, t_s: f64) -> Option<&Sample> {
        let after = self.samples.partition_point(|sample| sample.t_s <= t_s);
        self.samples.get(after.checked_sub(1)?)
    }

    fn places(&self, from_s: f64, to_s: f64) -> Range<usize> {
        let start = self.samples.partition_point(|sample| sample.t_s < from_s);
        let end = self.samples.partition_point(|sample| sample.t_s <= to_s);
        start..end.max(start)
    }
}

fn is_finite(sample: &Sample) -> bool {
    [
        sample.t_s,
        sample.device_position_m,
        sample.device_velocity_mps,
        sample.block_position_m,
        sample.block_velocity_mps,
        sample.coupling_force_n,
        sample.command_force_n,
    ]
    .iter()
    .all(|value| value.is_finite())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use haptic_ipc::RigState;

    pub(crate) fn at(t_s: f64) -> Sample {
        Sample {
            tick: 0,
            t_s,
            state: RigState::Engaged,
            contact: 0,
            device_position_m: 0.0,
            device_velocity_mps: 0.0,
            block_position_m: 0.0,
            block_velocity_mps: 0.0,
            coupling_force_n: 0.0,
            command_force_n: 0.0,
            revision: 1,
            wake_latency_ns: 0,
            tick_ns: 0,
            device_round_trip_ns: 0,
        }
    }

    fn times(tape: &Tape) -> Vec<f64> {
        tape.samples.iter().map(|sample| sample.t_s).collect()
    }

    #[test]
    fn only_the_last_minute_of_a_live_rig_is_kept() {
        let mut tape = Tape::default();
        tape.extend([0.0, 10.0, 65.0].map(at));
        assert_eq!(times(&tape), [10.0, 65.0]);
        tape.extend((0..250_000).map(|i| at(66.0 + f64::from(i) * 1e-6)));
        assert_eq!(times(&tape).len(), MAX_LIVE_SAMPLES);
        assert_eq!(times(&Tape::recorded([0.0, 10.0, 500.0].map(at))).len(), 3);
    }

    #[test]
    fn a_row_that_is_no_number_is_left_out() {
        let mut tape = Tape::default();
        let mut bad = at(1.0);
        bad.command_force_n = f64::NAN;
        tape.extend([at(0.5), bad, at(f64::INFINITY)]);
        assert_eq!(times(&tape), [0.5]);
    }

    #[test]
    fn a_clock_that_begins_anew_clears_the_past() {
        let mut tape = Tape::default();
        tape.extend([at(100.0), at(0.001)]);
        assert_eq!(times(&tape), [0.001]);
    }

    #[test]
    fn a_while_is_found_with_or_without_its_neighbours() {
        let tape = Tape::recorded((0..10).map(|i| at(f64::from(i))));
        let seen = |samples: Vec<&Sample>| samples.iter().map(|sample| sample.t_s).collect::<Vec<_>>();
        assert_eq!(seen(tape.within(2.0, 4.0).collect()), [2.0, 3.0, 4.0]);
        assert_eq!(seen(tape.around(2.0, 4.0).collect()), [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(seen(tape.around(-5.0, 40.0).collect()).len(), 10);
        assert_eq!(seen(tape.within(4.2, 4.4).collect()), [0.0; 0]);
        assert_eq!(seen(tape.within(4.0, 2.0).collect()), [0.0; 0], "the wrong way round");
        assert_eq!(tape.at(4.9).map(|sample| sample.t_s), Some(4.0));
        assert!(tape.at(-0.1).is_none());
    }
}
