//! Sums and extremes over a time of a tape: whole chunks from what they keep, the rest sample by sample. An
//! hour costs what its 3516 chunks and the samples of two of them cost.

use super::chunk::{CHUNK, Chunk, LEVELS, Sums};
use super::signal::Signal;
use super::{Range, Tape};

/// The level of a bucket that is a whole chunk.
const WHOLE: usize = LEVELS.len() - 1;

/// What consecutive samples of a signal sum up to, in the unit of the signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Summary {
    pub(crate) sums: Sums,
    pub(crate) least: f64,
    pub(crate) greatest: f64,
}

impl Tape {
    /// Sums and extremes of a signal from one time to another, s on the daemon's clock, both included.
    /// `None` without a sample.
    pub(crate) fn summary(&self, signal: Signal, from_s: f64, to_s: f64) -> Option<Summary> {
        let mut summary = Summary {
            sums: Sums::default(),
            least: f64::INFINITY,
            greatest: f64::NEG_INFINITY,
        };
        for (chunk, within) in self.parts(self.places(from_s, to_s)) {
            if let Some((sums, bucket)) = whole(chunk, signal, &within) {
                summary.sums.join(sums);
                summary.least = summary.least.min(bucket[0]);
                summary.greatest = summary.greatest.max(bucket[1]);
                continue;
            }
            for (before, sample) in within.filter_map(|place| chunk.pair(place)) {
                let value = signal.of(before, sample);
                summary.sums.add(value);
                summary.least = summary.least.min(value);
                summary.greatest = summary.greatest.max(value);
            }
        }
        (summary.sums.count > 0.0).then_some(summary)
    }

    /// The first sample from which on a signal stays in a band up to `to_s`: its time, s on the daemon's
    /// clock. `None` if the last sample is outside.
    pub(crate) fn stays_within(&self, signal: Signal, from_s: f64, to_s: f64, band: (f64, f64)) -> Option<f64> {
        let is_within = |value: f64| (band.0..=band.1).contains(&value);
        let mut stays = None;
        for (chunk, within) in self.parts(self.places(from_s, to_s)).into_iter().rev() {
            if let Some((_, extremes)) = whole(chunk, signal, &within)
                && extremes.into_iter().all(is_within)
            {
                stays = chunk.samples().first().map(|sample| sample.t_s);
                continue;
            }
            for (before, sample) in within.rev().filter_map(|place| chunk.pair(place)) {
                if !is_within(signal.of(before, sample)) {
                    return stays;
                }
                stays = Some(sample.t_s);
            }
        }
        stays
    }

    /// The chunks of a range of places, each with its places in the chunk.
    fn parts(&self, Range { start, end }: Range<usize>) -> Vec<(&Chunk, Range<usize>)> {
        let chunks = start / CHUNK..end.div_ceil(CHUNK);
        let part = |number: usize| {
            let chunk = self.chunks.get(number)?;
            let begin = number * CHUNK;
            Some((&**chunk, start.saturating_sub(begin)..(end - begin).min(CHUNK)))
        };
        chunks.filter_map(part).collect()
    }
}

/// Sums and extremes of a chunk that is full and wanted as a whole.
fn whole<'a>(chunk: &'a Chunk, signal: Signal, within: &Range<usize>) -> Option<(&'a Sums, [f64; 2])> {
    if *within != (0..CHUNK) {
        return None;
    }
    let extremes = chunk.bucket_at(WHOLE, 0)?.extremes(signal);
    Some((chunk.sums(signal)?, extremes.map(|(value, _)| value)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tape::tests::at;
    use haptic_ipc::Sample;
    use proptest::prelude::*;

    proptest! {
        /// Whole chunks give what their samples give one by one.
        #[test]
        fn a_summary_is_that_of_the_samples(
            values in prop::collection::vec(-9.0..9.0f64, 1..5000),
            ends in (0.0..1.0f64, 0.0..1.0f64),
            band in 0.0..9.0f64,
        ) {
            let rows = values.iter().enumerate().map(|(tick, value)| Sample {
                coupling_force_n: *value,
                ..at(tick as f64)
            });
            let tape = Tape::recorded(rows);
            let length = values.len() as f64;
            let (from_s, to_s) = (ends.0.min(ends.1) * length, ends.0.max(ends.1) * length);
            let seen: Vec<f64> = tape.within(from_s, to_s).map(|sample| sample.coupling_force_n).collect();
            let signal = Signal::COUPLING_FORCE;
            let Some(summary) = tape.summary(signal, from_s, to_s) else {
                prop_assert!(seen.is_empty());
                return Ok(());
            };
            let sum: f64 = seen.iter().sum();
            prop_assert_eq!(summary.sums.count, seen.len() as f64);
            prop_assert!((summary.sums.value - sum).abs() < 1e-9 * length);
            prop_assert_eq!(Some(summary.least), seen.iter().copied().reduce(f64::min));
            prop_assert_eq!(Some(summary.greatest), seen.iter().copied().reduce(f64::max));
            let outside = seen.iter().rposition(|value| value.abs() > band);
            let stays = outside.map_or(0, |place| place + 1);
            let first = from_s.ceil();
            let expected = (stays < seen.len()).then_some(first + stays as f64);
            prop_assert_eq!(tape.stays_within(signal, from_s, to_s, (-band, band)), expected);
        }
    }
}
