//! Samples in the order of time: the last minute of a live rig, or a recording.
//!
//! A tape is a sequence of chunks that are shared by `Arc` and never copied: to freeze an hour, or to
//! hand it to the thread that exports it, takes microseconds. Lines are drawn from the chunks'
//! min/max pyramids, so the work of a frame depends on its pixels instead of its samples.

mod chunk;
pub(crate) mod mark;
pub(crate) mod outline;
pub(crate) mod plane;
pub(crate) mod signal;
mod summary;
#[cfg(test)]
pub(crate) mod tests;

use chunk::{Bucket, CHUNK, Chunk, LEVELS, slides};
use haptic_ipc::{Sample, SampleY};
use mark::TapeMark;
use outline::{Span, end_of_column, outlines};
use plane::Plane;
use signal::Signal;
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

/// Time that is kept of a live rig, s.
pub(crate) const KEPT_S: f64 = 60.0;

/// Most samples that are kept of a live rig, at any rate: a minute at 4 kHz.
const MAX_LIVE_SAMPLES: usize = 240_000;

/// Fewest buckets of a column. A bucket belongs to the column of its first sample, so the edge of a
/// column is off by less than one bucket.
const BUCKETS_A_COLUMN: usize = 4;

/// From this many times the usual time between two samples on, nobody knows what was between them: the loop stood still.
const STANDSTILL: f64 = 10.0;

/// From this many samples a column on, contact is given by column instead of by sample.
const MANY_CONTACTS: usize = 16;

/// Samples, oldest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Tape {
    /// All are full except the last.
    chunks: VecDeque<Arc<Chunk>>,
    /// Samples of the first chunk that are too old to be shown.
    start: usize,
    /// Ticks from one sample to the next where none is missing; 0 before the second.
    stride: u64,
    /// What happened meanwhile, in the order of ticks.
    marks: Arc<Vec<TapeMark>>,
    /// The other tapes of a rig of two axes.
    plane: Option<Box<Plane>>,
}

/// A sample with the one before it, or a bucket of them.
#[derive(Clone, Copy, Debug)]
enum Piece<'a> {
    Sample(&'a Sample, &'a Sample),
    Bucket(&'a Bucket),
}

impl Piece<'_> {
    fn first_s(&self) -> f64 {
        match self {
            Self::Sample(_, sample) => sample.t_s,
            Self::Bucket(bucket) => bucket.first_s,
        }
    }

    fn slides(&self) -> Option<bool> {
        match self {
            Self::Sample(_, sample) => slides(sample),
            Self::Bucket(bucket) => bucket.slides,
        }
    }
}

impl Tape {
    /// A whole recording. A row that has a number that is not finite is left out: it cannot be drawn.
    pub(crate) fn recorded(rows: impl IntoIterator<Item = Sample>) -> Self {
        let mut tape = Self::default();
        for row in rows {
            tape.push_tick(row, None);
        }
        tape
    }

    /// Adds a batch of a live rig of one axis, and drops the samples that are too old.
    #[cfg(test)]
    pub(crate) fn extend(&mut self, rows: impl IntoIterator<Item = Sample>) {
        self.extend_ticks(rows.into_iter().map(|row| (row, None)));
    }

    /// Adds a batch of a live rig, each tick with what it has of a second axis, and drops the samples that are too old.
    pub(crate) fn extend_ticks(&mut self, ticks: impl IntoIterator<Item = (Sample, Option<SampleY>)>) {
        for (row, y) in ticks {
            self.push_tick(row, y.as_ref());
        }
        let Some(newest) = self.newest_s() else {
            return;
        };
        while self
            .oldest_s()
            .is_some_and(|oldest| oldest < newest - KEPT_S || self.len() > MAX_LIVE_SAMPLES)
        {
            self.drop_oldest();
        }
        let oldest = self.get(self.start).map_or(0, |sample| sample.tick);
        if self.marks.first().is_some_and(|mark| mark.tick < oldest) {
            Arc::make_mut(&mut self.marks).retain(|mark| mark.tick >= oldest);
        }
    }

    fn drop_oldest(&mut self) {
        self.start += 1;
        if self.start == CHUNK {
            self.chunks.pop_front();
            self.start = 0;
        }
        if let Some(plane) = &mut self.plane {
            plane.y.drop_oldest();
            plane.length.drop_oldest();
        }
    }

    /// Adds what happened at a tick; its sample may still be on its way.
    pub(crate) fn mark(&mut self, mark: TapeMark) {
        let place = self.marks.partition_point(|other| other.tick <= mark.tick);
        // It may be reported twice: as an event, and in the journal of the past.
        let mut same = self.marks[..place]
            .iter()
            .rev()
            .take_while(|other| other.tick == mark.tick);
        if same.any(|other| *other == mark) {
            return;
        }
        Arc::make_mut(&mut self.marks).insert(place, mark);
    }

    /// What happened from one time to another, s on the daemon's clock, each at the first sample of its
    /// tick or after it. What happened before the first sample is left out; what happened after the last
    /// one is at the last one.
    pub(crate) fn marks(&self, from_s: f64, to_s: f64) -> impl Iterator<Item = (f64, &TapeMark)> {
        let places = self.places(from_s, to_s);
        let tick_of = |place: usize| self.get(place).map(|sample| sample.tick);
        // What follows the sample before these is theirs; before the first of all there is none.
        let first = match places.start.checked_sub(1).filter(|place| *place >= self.start) {
            Some(before) => tick_of(before).map(|tick| tick + 1),
            None => tick_of(self.start),
        };
        let begin = first.map_or(self.marks.len(), |first| {
            self.marks.partition_point(|mark| mark.tick < first)
        });
        let is_at_end = places.end == self.end();
        let marks = self.marks[begin..].iter().map_while(move |mark| {
            let place = self.partition_point(|sample| sample.tick < mark.tick);
            let sample = if place < places.end {
                self.get(place)
            } else {
                self.last().filter(|_| is_at_end)
            };
            Some((sample?.t_s, mark))
        });
        // A time without any sample.
        marks.filter(move |(t_s, _)| (from_s..=to_s).contains(t_s))
    }

    /// Adds a tick, with what it has of a second axis.
    pub(crate) fn push_tick(&mut self, row: Sample, y: Option<&SampleY>) {
        let y = y.map(|y| plane::second_axis(&row, y));
        if !is_finite(&row) || !y.iter().all(is_finite) {
            return;
        }
        let is_of_another_run = |last: &Sample| row.t_s < last.t_s || y.is_some() != self.is_plane();
        if self.last().is_some_and(is_of_another_run) {
            // The loop's clock restarted: the older rows belong to the run before.
            *self = Self::default();
        }
        self.append(row);
        if let Some(y) = y {
            let plane = self.plane.get_or_insert_default();
            plane.y.append(y);
            plane.length.append(plane::lengths(&row, &y));
        }
    }

    fn append(&mut self, row: Sample) {
        let step = self.last().map_or(0, |last| row.tick.saturating_sub(last.tick));
        if step > 0 && (step < self.stride || self.stride == 0) {
            self.stride = step;
        }
        match self.chunks.back_mut().filter(|last| !last.is_full()) {
            // A shared chunk is copied first, so that a frozen tape does not change.
            Some(last) => Arc::make_mut(last).push(row),
            None => {
                let mut chunk = Chunk::after(self.last().copied());
                chunk.push(row);
                self.chunks.push_back(Arc::new(chunk));
            }
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.end() - self.start
    }

    /// The place after the last sample. A place counts from the beginning of the first chunk.
    fn end(&self) -> usize {
        let last = self.chunks.back().map_or(0, |chunk| chunk.samples().len());
        self.chunks.len().saturating_sub(1) * CHUNK + last
    }

    fn get(&self, place: usize) -> Option<&Sample> {
        self.chunks.get(place / CHUNK)?.samples().get(place % CHUNK)
    }

    /// The first place whose sample does not pass; all that pass come before.
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

    /// The samples in a range of places, each with the one before it.
    fn pairs(&self, places: Range<usize>) -> impl Iterator<Item = (&Sample, &Sample)> {
        places.filter_map(|place| self.pair(place))
    }

    /// A sample with the one before it; the first of all comes with itself.
    fn pair(&self, place: usize) -> Option<(&Sample, &Sample)> {
        self.chunks.get(place / CHUNK)?.pair(place % CHUNK)
    }

    /// A text that is another one once the tape holds other samples.
    pub(crate) fn stamp(&self) -> String {
        let newest = self.chunks.back().map(Arc::as_ptr);
        format!("{newest:?} {} {}", self.start, self.end())
    }

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

    /// The same, each with the sample before it: what the value of a signal is made of.
    pub(crate) fn pairs_within(&self, from_s: f64, to_s: f64) -> impl Iterator<Item = (&Sample, &Sample)> {
        self.pairs(self.places(from_s, to_s))
    }

    /// One of `stride` samples, each with the one before it on the tape; or only those of them with force. `None` stands
    /// between two of them where others are missing, or the loop stood still.
    pub(crate) fn pairs_every(
        &self,
        stride: usize,
        with_force: bool,
        (from_s, to_s): (f64, f64),
    ) -> impl Iterator<Item = Option<(&Sample, &Sample)>> {
        let places = self.places(from_s, to_s).step_by(stride);
        let pairs = places.filter_map(|place| self.pair(place));
        let pairs = pairs.filter(move |(_, sample)| !with_force || sample.state.is_live());
        // As many as are drawn in the place of two, or more.
        let gap = self.stride.saturating_mul(2 * stride as u64).max(1);
        #[expect(clippy::cast_precision_loss, reason = "some thousand samples")]
        let standstill_s = self.standstill_s() * stride as f64;
        let mut last: Option<&Sample> = None;
        pairs.flat_map(move |pair| {
            let sample = pair.1;
            let is_broken = last.replace(sample).is_some_and(|last| {
                sample.tick.saturating_sub(last.tick) >= gap || sample.t_s - last.t_s > standstill_s
            });
            is_broken.then_some(None).into_iter().chain([Some(pair)])
        })
    }

    /// The time of the sample before a place, s, if samples are missing between them, or the loop stood still, for longer
    /// than `shortest_s`.
    fn gap_before(&self, place: usize, shortest_s: f64) -> Option<f64> {
        let (before, sample) = self.pair(place)?;
        let between_s = sample.t_s - before.t_s;
        let is_missing = sample.tick.saturating_sub(before.tick) > self.stride;
        (between_s > shortest_s && (is_missing || between_s > self.standstill_s())).then_some(before.t_s)
    }

    /// The time between two samples from which on the loop stood still, s; no number before the second tick.
    fn standstill_s(&self) -> f64 {
        let (Some(oldest), Some(newest)) = (self.get(self.start), self.last()) else {
            return f64::NAN;
        };
        #[expect(clippy::cast_precision_loss, reason = "ticks of some days")]
        let steps = newest.tick.saturating_sub(oldest.tick) as f64 / self.stride as f64;
        STANDSTILL * (newest.t_s - oldest.t_s) / steps
    }

    /// Every sample, and one more at either end.
    pub(crate) fn pairs_around(&self, from_s: f64, to_s: f64) -> impl Iterator<Item = (&Sample, &Sample)> {
        self.pairs(self.places_around(from_s, to_s))
    }

    /// Number of samples from one time to another, s on the daemon's clock.
    pub(crate) fn count(&self, from_s: f64, to_s: f64) -> usize {
        self.places(from_s, to_s).len()
    }

    /// The chunks that hold one time to another, s on the daemon's clock. Nothing is copied.
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
            stride: self.stride,
            marks: Arc::clone(&self.marks),
            plane: self.plane.as_ref().map(|plane| {
                let (y, length) = (plane.y.part(from_s, to_s), plane.length.part(from_s, to_s));
                Box::new(Plane { y, length })
            }),
        }
    }

    /// The newest sample that is not after a time, s on the daemon's clock.
    pub(crate) fn at(&self, t_s: f64) -> Option<&Sample> {
        self.get(self.place_at(t_s)?)
    }

    fn place_at(&self, t_s: f64) -> Option<usize> {
        let after = self.partition_point(|sample| sample.t_s <= t_s);
        after.checked_sub(1).filter(|place| *place >= self.start)
    }

    /// A signal at the newest sample that is not after a time, s on the daemon's clock.
    pub(crate) fn value_at(&self, signal: Signal, t_s: f64) -> Option<f64> {
        let (before, sample) = self.pair(self.place_at(t_s)?)?;
        Some(signal.of(before, sample))
    }

    /// Lines of signals from one time to another, s on the daemon's clock, with columns of `column_s`.
    /// They reach beyond both ends by a sample or a bucket, so that they touch the edges of the plot, and are broken where
    /// samples are missing or the loop stood still.
    pub(crate) fn outlines(&self, signals: &[Signal], (from_s, to_s): (f64, f64), column_s: f64) -> Vec<Vec<[f64; 2]>> {
        let places = self.places_around(from_s, to_s);
        let level = level(samples_a_column(&places, (from_s, to_s), column_s));
        let spans = self.pieces(places, level, column_s).map(|(place, piece)| Span {
            first_s: piece.first_s(),
            follows_gap: self.gap_before(place, column_s).is_some(),
            what: (place, piece),
        });
        let extremes = |&(place, piece): &(usize, Piece<'_>), line: usize| match piece {
            Piece::Sample(before, sample) => [(signals[line].of(before, sample), place); 2],
            Piece::Bucket(bucket) => {
                let chunk = place - place % CHUNK;
                bucket.extremes(signals[line]).map(|(value, at)| (value, chunk + at))
            }
        };
        outlines(spans, signals.len(), extremes, column_s, |place| {
            self.get(place).map_or(f64::NAN, |sample| sample.t_s)
        })
    }

    /// When the block slid and when it stuck, from one time to another, s on the daemon's clock: each
    /// time with the contact from then on. Where many samples share a column of `column_s`, the block
    /// slid if it slid in any of them.
    pub(crate) fn contacts(&self, (from_s, to_s): (f64, f64), column_s: f64) -> Vec<(f64, Option<bool>)> {
        let places = self.places_around(from_s, to_s);
        let density = samples_a_column(&places, (from_s, to_s), column_s);
        let mut contacts: Vec<(f64, Option<bool>)> = Vec::new();
        let mut until_s = f64::NEG_INFINITY;
        let newest = places.end.checked_sub(1).and_then(|place| self.get(place));
        for (place, piece) in self.pieces(places, level(density), column_s) {
            let first_s = piece.first_s();
            match contacts.last_mut().filter(|_| first_s < until_s) {
                Some((_, column)) => *column = (*column).max(piece.slides()),
                None => {
                    // Nobody knows what it did in between.
                    let gap = self.gap_before(place, column_s).filter(|_| !contacts.is_empty());
                    contacts.extend(gap.map(|from_s| (from_s, None)));
                    contacts.push((first_s, piece.slides()));
                    if density >= MANY_CONTACTS {
                        until_s = end_of_column(first_s, column_s);
                    }
                }
            }
        }
        // The last column lasts until the last sample.
        contacts.extend(newest.map(|sample| (sample.t_s, slides(sample))));
        contacts
    }

    /// The pieces in a range of places, each with its place: whole buckets of a level, finer ones where those last longer
    /// than a column because samples are missing in them, and samples.
    fn pieces(
        &self,
        places: Range<usize>,
        level: Option<usize>,
        column_s: f64,
    ) -> impl Iterator<Item = (usize, Piece<'_>)> {
        let mut place = places.start;
        std::iter::from_fn(move || {
            let chunk = self.chunks.get(place / CHUNK).filter(|_| place < places.end)?;
            let (here, within) = (place, place % CHUNK);
            for level in (0..level.map_or(0, |level| level + 1)).rev() {
                let size = LEVELS[level];
                if here + size <= places.end
                    && let Some(bucket) = chunk.bucket_at(level, within)
                    && chunk.samples()[within + size - 1].t_s - bucket.first_s <= column_s
                {
                    place += size;
                    return Some((here, Piece::Bucket(bucket)));
                }
            }
            place += 1;
            let (before, sample) = chunk.pair(within)?;
            Some((here, Piece::Sample(before, sample)))
        })
    }

    fn places(&self, from_s: f64, to_s: f64) -> Range<usize> {
        let start = self.partition_point(|sample| sample.t_s < from_s);
        let end = self.partition_point(|sample| sample.t_s <= to_s);
        start..end.max(start)
    }

    /// The same with one more at either side, so that a line reaches the edges of the plot.
    fn places_around(&self, from_s: f64, to_s: f64) -> Range<usize> {
        let Range { start, end } = self.places(from_s, to_s);
        start.saturating_sub(1).max(self.start)..(end + 1).min(self.end())
    }
}

/// Mean number of samples in a column.
fn samples_a_column(places: &Range<usize>, (from_s, to_s): (f64, f64), column_s: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a plot has some thousand columns; a float beyond that saturates"
    )]
    let columns = ((to_s - from_s) / column_s) as usize;
    places.len() / columns.max(1)
}

/// The coarsest level that is fine enough for columns of this many samples; `None` for single samples.
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
