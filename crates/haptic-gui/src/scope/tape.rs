//! Samples in the order of time: the last minute of a live rig, or a recording.
//!
//! A tape is a row of chunks that are shared, not copied: to freeze what is seen or to hand it to the thread that exports it takes microseconds,
//! however long it is. What is drawn of it comes from the chunks' extremes, so that the work of a frame goes with the pixels and not with the samples.

use super::chunk::{Bucket, CHUNK, Chunk, Contacts, LEVELS};
use super::outline::{Span, end_of_column, outlines};
use super::signal::Signal;
use haptic_ipc::Sample;
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

/// How much of a live rig's past is kept, s.
pub(crate) const KEPT_S: f64 = 60.0;

/// Samples of a live rig kept at most, whatever rate the daemon sends: a minute of 4 kHz.
const MAX_LIVE_SAMPLES: usize = 240_000;

/// So many buckets a column has at least. A bucket counts to the column of its first sample, so a column's edge is off by less than one of them.
const BUCKETS_A_COLUMN: usize = 4;

/// From so many samples a column on, the contact is told by column and not by sample.
const MANY_CONTACTS: usize = 16;

/// Samples, oldest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Tape {
    /// All but the last are full.
    chunks: VecDeque<Arc<Chunk>>,
    /// Samples of the first chunk that are too old.
    start: usize,
}

/// A sample, or a bucket of them.
#[derive(Clone, Copy, Debug)]
enum Piece<'a> {
    Sample(&'a Sample),
    Bucket(&'a Bucket),
}

impl Piece<'_> {
    fn first_s(&self) -> f64 {
        match self {
            Self::Sample(sample) => sample.t_s,
            Self::Bucket(bucket) => bucket.first_s,
        }
    }

    fn contacts(&self) -> Contacts {
        match self {
            Self::Sample(sample) => Contacts::of(sample),
            Self::Bucket(bucket) => bucket.contacts,
        }
    }
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
            .oldest_s()
            .is_some_and(|oldest| oldest < newest - KEPT_S || self.len() > MAX_LIVE_SAMPLES)
        {
            self.start += 1;
            if self.start == CHUNK {
                self.chunks.pop_front();
                self.start = 0;
            }
        }
    }

    /// Adds a row of a recording.
    pub(crate) fn push(&mut self, row: Sample) {
        if !is_finite(&row) {
            return;
        }
        if self.last().is_some_and(|last| row.t_s < last.t_s) {
            // The loop's clock began anew; older rows belong to another life of it.
            *self = Self::default();
        }
        match self.chunks.back_mut().filter(|last| !last.is_full()) {
            // One that is shared is copied: whoever holds the other looks at what was so then.
            Some(last) => Arc::make_mut(last).push(row),
            None => {
                let mut chunk = Chunk::default();
                chunk.push(row);
                self.chunks.push_back(Arc::new(chunk));
            }
        }
    }

    /// Samples that it holds.
    pub(crate) fn len(&self) -> usize {
        self.end() - self.start
    }

    /// The place after the last sample; places count from the beginning of the first chunk.
    fn end(&self) -> usize {
        let last = self.chunks.back().map_or(0, |chunk| chunk.samples().len());
        self.chunks.len().saturating_sub(1) * CHUNK + last
    }

    fn get(&self, place: usize) -> Option<&Sample> {
        self.chunks.get(place / CHUNK)?.samples().get(place % CHUNK)
    }

    /// The first place whose sample does not pass; those that do come before those that do not.
    fn partition_point(&self, passes: impl Fn(&Sample) -> bool) -> usize {
        let (mut low, mut high) = (self.start, self.end());
        while low < high {
            let middle = low.midpoint(high);
            if self.get(middle).is_some_and(&passes) {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low
    }

    fn range(&self, Range { start, end }: Range<usize>) -> impl Iterator<Item = &Sample> + Clone {
        (start / CHUNK..end.div_ceil(CHUNK)).flat_map(move |chunk| {
            let begin = chunk * CHUNK;
            let within = start.saturating_sub(begin)..(end - begin).min(CHUNK);
            self.chunks
                .get(chunk)
                .and_then(|chunk| chunk.samples().get(within))
                .unwrap_or_default()
        })
    }

    /// The newest sample.
    pub(crate) fn last(&self) -> Option<&Sample> {
        self.chunks.back()?.samples().last()
    }

    /// Time of the newest sample, s on the daemon's clock.
    pub(crate) fn newest_s(&self) -> Option<f64> {
        self.last().map(|sample| sample.t_s)
    }

    /// Time of the oldest sample, s on the daemon's clock.
    pub(crate) fn oldest_s(&self) -> Option<f64> {
        self.get(self.start).map(|sample| sample.t_s)
    }

    /// The samples from one time to another, s on the daemon's clock, both included.
    pub(crate) fn within(&self, from_s: f64, to_s: f64) -> impl Iterator<Item = &Sample> + Clone {
        self.range(self.places(from_s, to_s))
    }

    /// The tape from one time to another, and somewhat more at either side. Nothing is copied.
    pub(crate) fn part(&self, from_s: f64, to_s: f64) -> Self {
        let Range { start, end } = self.places_around(from_s, to_s);
        let first = start / CHUNK;
        Self {
            chunks: self
                .chunks
                .range(first..end.div_ceil(CHUNK).max(first))
                .cloned()
                .collect(),
            start: if first == 0 { self.start } else { 0 },
        }
    }

    /// What was so at a time: the newest sample that is not after it.
    pub(crate) fn at(&self, t_s: f64) -> Option<&Sample> {
        let after = self.partition_point(|sample| sample.t_s <= t_s);
        let place = after.checked_sub(1).filter(|place| *place >= self.start)?;
        self.get(place)
    }

    /// Lines of signals from one time to another, s on the daemon's clock, with columns `column_s` wide. They reach beyond both ends by a sample or
    /// a bucket, so that they reach the edges of what is seen.
    pub(crate) fn outlines<const N: usize>(
        &self,
        signals: [Signal; N],
        (from_s, to_s): (f64, f64),
        column_s: f64,
    ) -> [Vec<[f64; 2]>; N] {
        let places = self.places_around(from_s, to_s);
        let level = level(samples_a_column(&places, (from_s, to_s), column_s));
        let spans = self.pieces(places, level).map(|(place, piece)| Span {
            first_s: piece.first_s(),
            extremes: match piece {
                Piece::Sample(sample) => signals.map(|signal| [(signal.of(sample), place); 2]),
                Piece::Bucket(bucket) => {
                    let chunk = place - place % CHUNK;
                    signals.map(|signal| bucket.extremes(signal).map(|(value, at)| (value, chunk + at)))
                }
            },
        });
        outlines(spans, column_s, |place| {
            self.get(place).map_or(f64::NAN, |sample| sample.t_s)
        })
    }

    /// When the block slid and when it stuck, from one time to another, s on the daemon's clock: each time with what was so from then on. Where many
    /// samples fall into one column of `column_s`, it slid if it slid in any of them.
    pub(crate) fn contacts(&self, (from_s, to_s): (f64, f64), column_s: f64) -> Vec<(f64, Option<bool>)> {
        let places = self.places_around(from_s, to_s);
        let density = samples_a_column(&places, (from_s, to_s), column_s);
        let mut contacts: Vec<(f64, Contacts)> = Vec::new();
        let mut until_s = f64::NEG_INFINITY;
        let newest = places.end.checked_sub(1).and_then(|place| self.get(place));
        for (_, piece) in self.pieces(places, level(density)) {
            let first_s = piece.first_s();
            match contacts.last_mut().filter(|_| first_s < until_s) {
                Some((_, column)) => column.join(piece.contacts()),
                None => {
                    contacts.push((first_s, piece.contacts()));
                    if density >= MANY_CONTACTS {
                        until_s = end_of_column(first_s, column_s);
                    }
                }
            }
        }
        // The last column lasts until the last sample.
        contacts.extend(newest.map(|sample| (sample.t_s, Contacts::of(sample))));
        contacts
            .into_iter()
            .map(|(t_s, contacts)| (t_s, contacts.slides()))
            .collect()
    }

    /// What lies in some places, each with its own: buckets of a level where they are whole, and samples.
    fn pieces(&self, places: Range<usize>, level: Option<usize>) -> impl Iterator<Item = (usize, Piece<'_>)> {
        let mut place = places.start;
        std::iter::from_fn(move || {
            let chunk = self.chunks.get(place / CHUNK).filter(|_| place < places.end)?;
            let (here, within) = (place, place % CHUNK);
            if let Some(level) = level
                && here + LEVELS[level] <= places.end
                && let Some(bucket) = chunk.bucket_at(level, within)
            {
                place += LEVELS[level];
                return Some((here, Piece::Bucket(bucket)));
            }
            place += 1;
            Some((here, Piece::Sample(chunk.samples().get(within)?)))
        })
    }

    fn places(&self, from_s: f64, to_s: f64) -> Range<usize> {
        let start = self.partition_point(|sample| sample.t_s < from_s);
        let end = self.partition_point(|sample| sample.t_s <= to_s);
        start..end.max(start)
    }

    /// The same with one more at either side, so that a line reaches the edges of what is seen.
    fn places_around(&self, from_s: f64, to_s: f64) -> Range<usize> {
        let Range { start, end } = self.places(from_s, to_s);
        start.saturating_sub(1).max(self.start)..(end + 1).min(self.end())
    }
}

/// Samples that fall into a column, on average.
fn samples_a_column(places: &Range<usize>, (from_s, to_s): (f64, f64), column_s: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a plot has some thousand columns; a float beyond that saturates"
    )]
    let columns = ((to_s - from_s) / column_s) as usize;
    places.len() / columns.max(1)
}

/// The coarsest level that is fine enough for columns of so many samples; nothing where they are drawn one by one.
fn level(samples: usize) -> Option<usize> {
    LEVELS.iter().rposition(|size| size * BUCKETS_A_COLUMN <= samples)
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
    use proptest::prelude::*;

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
            ..Sample::default()
        }
    }

    fn times(tape: &Tape) -> Vec<f64> {
        tape.range(tape.start..tape.end()).map(|sample| sample.t_s).collect()
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
        assert_eq!(tape.places_around(2.0, 4.0), 1..6);
        assert_eq!(tape.places_around(-5.0, 40.0), 0..10);
        assert_eq!(seen(tape.within(4.2, 4.4).collect()), [0.0; 0]);
        assert_eq!(seen(tape.within(4.0, 2.0).collect()), [0.0; 0], "the wrong way round");
        assert_eq!(tape.at(4.9).map(|sample| sample.t_s), Some(4.0));
        assert!(tape.at(-0.1).is_none());
    }

    /// Noise with a spike, one sample a millisecond.
    fn noisy(count: u32, spike: u32) -> Tape {
        Tape::recorded((0..count).map(|tick| {
            let mut row = at(f64::from(tick) * 1e-3);
            row.contact = i8::from(tick == spike);
            let noise = f64::from(tick.wrapping_mul(2_654_435_761) >> 16) * 1e-5;
            row.coupling_force_n = if tick == spike { 42.0 } else { noise };
            row
        }))
    }

    // hazard: H5
    #[test]
    fn a_frame_of_an_hour_looks_at_no_more_than_its_pixels_ask_for() {
        let tape = noisy(3_600_000, 1_234_567);
        let whole = (0.0, 3600.0);
        for columns in [400, 1600] {
            let column_s = 3600.0 / f64::from(columns);
            let places = tape.places_around(whole.0, whole.1);
            let level = level(samples_a_column(&places, whole, column_s));
            let looked_at = tape.pieces(places, level).count();
            assert!(looked_at < 17 * 1600, "{columns} columns: {looked_at} pieces");
            let [line] = tape.outlines([Signal::CouplingForce], whole, column_s);
            assert!(line.len() <= 2 * 1601, "{}", line.len());
            assert!(line.contains(&[1234.567, 42.0]), "the spike is lost");
            let contacts = tape.contacts(whole, column_s);
            assert!(contacts.len() <= 1602, "{}", contacts.len());
            assert_eq!(contacts.iter().filter(|(_, slides)| *slides == Some(true)).count(), 1);
        }
        // Nowhere between the coarsest and the finest is there a zoom that costs more than some samples a pixel.
        for span_s in [1.0, 10.0, 60.0, 100.0, 300.0, 1000.0, 2000.0] {
            let seen = (1800.0, 1800.0 + span_s);
            let places = tape.places_around(seen.0, seen.1);
            let level = level(samples_a_column(&places, seen, span_s / 1600.0));
            let looked_at = tape.pieces(places, level).count();
            assert!(looked_at < 66 * 1600, "{span_s} s: {looked_at} pieces");
        }
        let raw = tape.len() * size_of::<Sample>();
        let taken: usize = tape.chunks.iter().map(|chunk| chunk.bytes()).sum();
        println!(
            "an hour: {} MB of samples, {} MB with their extremes",
            raw / 1_000_000,
            taken / 1_000_000
        );
        assert!(taken * 10 <= raw * 13, "{taken} bytes for {raw} of samples");
        assert!(
            tape.clone()
                .chunks
                .iter()
                .zip(&tape.chunks)
                .all(|(one, other)| Arc::ptr_eq(one, other))
        );
    }

    #[test]
    fn a_part_of_a_tape_is_shared_and_stays_as_it_was() {
        let mut tape = Tape::default();
        tape.extend((0..70_000).map(|i| at(f64::from(i) * 1e-3)));
        let part = tape.part(30.0, 40.0);
        let whole = tape.clone();
        assert!(
            part.oldest_s() <= Some(30.0) && part.oldest_s() > Some(28.0),
            "{:?}",
            part.oldest_s()
        );
        assert!(
            part.newest_s() >= Some(40.0) && part.newest_s() < Some(42.0),
            "{:?}",
            part.newest_s()
        );
        tape.extend((70_000..80_000).map(|i| at(f64::from(i) * 1e-3)));
        assert_eq!((whole.oldest_s(), whole.newest_s()), (Some(9.999), Some(69.999)));
        assert_eq!(tape.oldest_s(), Some(19.999));
        assert_eq!(tape.part(100.0, 200.0).len(), tape.part(79.999, 79.999).len());
        assert_eq!(Tape::default().part(0.0, 1.0).len(), 0);
    }

    proptest! {
        /// However coarse the buckets are, what is drawn of a live tape are its samples, in their order, with its extremes among them.
        #[test]
        fn what_is_drawn_of_buckets_is_of_the_samples(
            values in prop::collection::vec(-9.0..9.0f64, 1..4000),
            columns in 1.0..100.0f64,
            ends in (0.0..1.0f64, 0.0..1.0f64),
        ) {
            let mut tape = Tape::default();
            for batch in values.chunks(34) {
                let begin = tape.end();
                tape.extend(batch.iter().zip(begin..).map(|(value, tick)| {
                    let mut row = at(tick as f64 * 0.02);
                    row.coupling_force_n = *value;
                    row
                }));
            }
            let last_s = values.len() as f64 * 0.02;
            let (from_s, to_s) = (ends.0.min(ends.1) * last_s, ends.0.max(ends.1) * last_s + 0.02);
            let column_s = (to_s - from_s) / columns;
            let [line] = tape.outlines([Signal::CouplingForce], (from_s, to_s), column_s);
            prop_assert!(line.is_sorted_by(|a, b| a[0] < b[0]));
            let seen: Vec<_> = tape.range(tape.places_around(from_s, to_s)).map(|row| [row.t_s, row.coupling_force_n]).collect();
            prop_assert!(line.iter().all(|point| seen.contains(point)));
            for pick in [f64::min, f64::max] {
                let of = |points: &[[f64; 2]]| points.iter().map(|[_, value]| *value).reduce(pick);
                prop_assert_eq!(of(&line), of(&seen));
            }
        }
    }
}
