//! The last seconds of samples.

use haptic_ipc::Sample;
use std::collections::VecDeque;

/// How much of the past is kept and drawn, s.
pub(crate) const WINDOW_S: f64 = 5.0;

/// Samples kept at most, whatever rate the daemon sends: a loop of 4 kHz fits in full.
const MAX_SAMPLES: usize = 20_000;

/// Samples of the last [`WINDOW_S`], oldest first.
#[derive(Debug, Default)]
pub(crate) struct History {
    samples: VecDeque<Sample>,
}

impl History {
    /// Adds a batch. A row with a number that is none is left out: it cannot be drawn.
    pub(crate) fn extend(&mut self, rows: impl IntoIterator<Item = Sample>) {
        for row in rows {
            if !is_finite(&row) {
                continue;
            }
            if self.samples.back().is_some_and(|last| row.t_s < last.t_s) {
                // The loop's clock began anew; older rows belong to another life of it.
                self.samples.clear();
            }
            self.samples.push_back(row);
        }
        let Some(newest) = self.samples.back().map(|sample| sample.t_s) else {
            return;
        };
        while self
            .samples
            .front()
            .is_some_and(|first| first.t_s < newest - WINDOW_S || self.samples.len() > MAX_SAMPLES)
        {
            self.samples.pop_front();
        }
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.samples.clear();
    }

    /// The newest sample.
    pub(crate) fn last(&self) -> Option<&Sample> {
        self.samples.back()
    }

    /// Samples with their age as a negative time in s: 0 is the newest.
    pub(crate) fn with_age(&self) -> impl Iterator<Item = (f64, &Sample)> {
        let newest = self.last().map_or(0.0, |sample| sample.t_s);
        self.samples.iter().map(move |sample| (sample.t_s - newest, sample))
    }
}

fn is_finite(sample: &Sample) -> bool {
    [
        sample.t_s,
        sample.device_position_m,
        sample.block_position_m,
        sample.coupling_force_n,
        sample.command_force_n,
    ]
    .iter()
    .all(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_ipc::RigState;

    fn at(t_s: f64) -> Sample {
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

    fn times(history: &History) -> Vec<f64> {
        history.samples.iter().map(|sample| sample.t_s).collect()
    }

    #[test]
    fn only_the_window_is_kept() {
        let mut history = History::default();
        history.extend([0.0, 1.0, 5.5].map(at));
        assert_eq!(times(&history), [1.0, 5.5]);
        history.extend((0..30_000).map(|i| at(6.0 + f64::from(i) * 1e-6)));
        assert_eq!(history.samples.len(), MAX_SAMPLES);
    }

    #[test]
    fn a_row_that_is_no_number_is_left_out() {
        let mut history = History::default();
        let mut bad = at(1.0);
        bad.command_force_n = f64::NAN;
        history.extend([at(0.5), bad, at(f64::INFINITY)]);
        assert_eq!(times(&history), [0.5]);
    }

    #[test]
    fn a_clock_that_begins_anew_clears_the_past() {
        let mut history = History::default();
        history.extend([at(100.0), at(0.001)]);
        assert_eq!(times(&history), [0.001]);
    }
}
