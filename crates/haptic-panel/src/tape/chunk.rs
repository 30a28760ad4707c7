//! A part of a tape with a min/max pyramid: the extremes of its samples at several levels.
//!
//! An hour is drawn from a few thousand buckets instead of millions of samples. A spike of a single
//! sample stays the extreme of its bucket.

use super::signal::Signal;
use haptic_ipc::Sample;

/// Samples of a full chunk.
pub(crate) const CHUNK: usize = 1024;

/// Samples of a bucket, by level. The extremes of all levels take a tenth of the samples' memory.
pub(crate) const LEVELS: [usize; 4] = [16, 64, 256, CHUNK];

/// Whether the block slides in a sample; `None` without force, where there is no surface to stick to. Of several samples
/// the greatest counts, so that the shortest slip is visible at any zoom.
pub(crate) fn slides(sample: &Sample) -> Option<bool> {
    sample.state.is_live().then_some(sample.contact != 0)
}

/// The extremes of consecutive samples of a chunk.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bucket {
    /// Time of the first sample, s on the daemon's clock.
    pub(crate) first_s: f64,
    least: [f64; Signal::COUNT],
    greatest: [f64; Signal::COUNT],
    /// Indices in the chunk.
    least_at: [u16; Signal::COUNT],
    greatest_at: [u16; Signal::COUNT],
    pub(crate) slides: Option<bool>,
}

impl Bucket {
    /// The extremes of the samples of a chunk from one place on, whose values are added to `sums`. Of equal
    /// values the first is the least and the last is the greatest, as for samples that are drawn one by one.
    fn of(chunk: &Chunk, begin: usize, sums: &mut [Sums; Signal::COUNT]) -> Option<Self> {
        let mut bucket = Self {
            first_s: chunk.samples.get(begin)?.t_s,
            least: [f64::INFINITY; Signal::COUNT],
            greatest: [f64::NEG_INFINITY; Signal::COUNT],
            least_at: [0; Signal::COUNT],
            greatest_at: [0; Signal::COUNT],
            slides: None,
        };
        for place in begin..chunk.samples.len() {
            let (before, sample) = chunk.pair(place)?;
            // A chunk has 1024 places.
            let at = u16::try_from(place).unwrap_or(u16::MAX);
            for (signal, sums) in Signal::ALL.into_iter().zip(&mut *sums) {
                let (value, signal) = (signal.of(before, sample), signal.index());
                sums.add(value);
                if value < bucket.least[signal] {
                    (bucket.least[signal], bucket.least_at[signal]) = (value, at);
                }
                if value >= bucket.greatest[signal] {
                    (bucket.greatest[signal], bucket.greatest_at[signal]) = (value, at);
                }
            }
            bucket.slides = bucket.slides.max(slides(sample));
        }
        Some(bucket)
    }

    /// Merges the next bucket.
    fn join(&mut self, next: &Self) {
        for signal in 0..Signal::COUNT {
            if next.least[signal] < self.least[signal] {
                self.least[signal] = next.least[signal];
                self.least_at[signal] = next.least_at[signal];
            }
            if next.greatest[signal] >= self.greatest[signal] {
                self.greatest[signal] = next.greatest[signal];
                self.greatest_at[signal] = next.greatest_at[signal];
            }
        }
        self.slides = self.slides.max(next.slides);
    }

    /// The least and the greatest value of a signal, each with its index in the chunk.
    pub(crate) fn extremes(&self, signal: Signal) -> [(f64, usize); 2] {
        let signal = signal.index();
        [
            (self.least[signal], usize::from(self.least_at[signal])),
            (self.greatest[signal], usize::from(self.greatest_at[signal])),
        ]
    }
}

/// Sums over consecutive samples: what mean and rms are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    pub(crate) count: f64,
    /// Sum of the values, in the unit of the signal.
    pub(crate) value: f64,
    /// Sum of their squares.
    pub(crate) square: f64,
}

impl Sums {
    pub(crate) fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.value += value;
        self.square += value * value;
    }

    pub(crate) fn join(&mut self, other: &Self) {
        self.count += other.count;
        self.value += other.value;
        self.square += other.square;
    }
}

/// Up to [`CHUNK`] samples, oldest first.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Chunk {
    /// The sample before the first one, if there is one.
    before: Option<Sample>,
    samples: Vec<Sample>,
    /// Full buckets, by level.
    buckets: [Vec<Bucket>; LEVELS.len()],
    /// Over the full buckets of the finest level.
    sums: [Sums; Signal::COUNT],
}

impl Chunk {
    /// An empty chunk that follows a sample.
    pub(crate) fn after(before: Option<Sample>) -> Self {
        Self {
            before,
            samples: Vec::with_capacity(CHUNK),
            buckets: LEVELS.map(|size| Vec::with_capacity(CHUNK / size)),
            sums: [Sums::default(); Signal::COUNT],
        }
    }

    /// A sample with the one before it; the first of all comes with itself.
    pub(crate) fn pair(&self, place: usize) -> Option<(&Sample, &Sample)> {
        let sample = self.samples.get(place)?;
        let before = match place.checked_sub(1) {
            Some(before) => self.samples.get(before),
            None => self.before.as_ref(),
        };
        Some((before.unwrap_or(sample), sample))
    }

    /// The sums over a full chunk.
    pub(crate) fn sums(&self, signal: Signal) -> Option<&Sums> {
        self.is_full().then(|| &self.sums[signal.index()])
    }

    pub(crate) fn samples(&self) -> &[Sample] {
        &self.samples
    }

    pub(crate) fn is_full(&self) -> bool {
        self.samples.len() == CHUNK
    }

    /// The bucket of a level that begins at an index, if there is one and it is full.
    pub(crate) fn bucket_at(&self, level: usize, place: usize) -> Option<&Bucket> {
        let size = LEVELS[level];
        place
            .is_multiple_of(size)
            .then(|| self.buckets[level].get(place / size))?
    }

    pub(crate) fn push(&mut self, sample: Sample) {
        self.samples.push(sample);
        let count = self.samples.len();
        for (level, size) in LEVELS.into_iter().enumerate() {
            if !count.is_multiple_of(size) {
                return;
            }
            let begin = count - size;
            let bucket = match level.checked_sub(1) {
                None => {
                    let mut sums = self.sums;
                    let bucket = Bucket::of(self, begin, &mut sums);
                    self.sums = sums;
                    bucket
                }
                Some(finer) => {
                    let parts = &self.buckets[finer][begin / LEVELS[finer]..];
                    let mut whole = parts.first().cloned();
                    if let Some(whole) = &mut whole {
                        parts[1..].iter().for_each(|part| whole.join(part));
                    }
                    whole
                }
            };
            self.buckets[level].extend(bucket);
        }
    }

    /// Memory use, bytes.
    #[cfg(test)]
    pub(crate) fn bytes(&self) -> usize {
        let buckets: usize = self.buckets.iter().map(Vec::capacity).sum();
        size_of::<Self>() + self.samples.capacity() * size_of::<Sample>() + buckets * size_of::<Bucket>()
    }
}
