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

/// A set of contact states: a bucket may hold each of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Contacts(u8);

impl Contacts {
    const STUCK: u8 = 1;
    const SLIDING: u8 = 2;

    pub(crate) fn of(sample: &Sample) -> Self {
        // Without force there is no surface to stick to.
        Self(match (sample.state.is_live(), sample.contact) {
            (false, _) => 0,
            (true, 0) => Self::STUCK,
            (true, _) => Self::SLIDING,
        })
    }

    pub(crate) fn join(&mut self, other: Self) {
        self.0 |= other.0;
    }

    /// Whether the block slid in any sample, so that the shortest slip is visible at any zoom; `None`
    /// without force.
    pub(crate) fn slides(self) -> Option<bool> {
        (self.0 != 0).then_some(self.0 & Self::SLIDING != 0)
    }
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
    pub(crate) contacts: Contacts,
}

impl Bucket {
    fn of(samples: &[Sample], begin: usize) -> Option<Self> {
        let mut all = samples.iter().zip(begin..).map(|(sample, place)| {
            // A chunk has 1024 places.
            let place = u16::try_from(place).unwrap_or(u16::MAX);
            let values = Signal::ALL.map(|signal| signal.of(sample));
            Self {
                first_s: sample.t_s,
                least: values,
                greatest: values,
                least_at: [place; Signal::COUNT],
                greatest_at: [place; Signal::COUNT],
                contacts: Contacts::of(sample),
            }
        });
        let mut bucket = all.next()?;
        all.for_each(|next| bucket.join(&next));
        Some(bucket)
    }

    /// Merges the next bucket. Of equal values the first is the least and the last is the greatest, as
    /// for samples that are drawn one by one.
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
        self.contacts.join(next.contacts);
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

/// Up to [`CHUNK`] samples, oldest first.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Chunk {
    samples: Vec<Sample>,
    /// Full buckets, by level.
    buckets: [Vec<Bucket>; LEVELS.len()],
}

impl Default for Chunk {
    fn default() -> Self {
        Self {
            samples: Vec::with_capacity(CHUNK),
            buckets: LEVELS.map(|size| Vec::with_capacity(CHUNK / size)),
        }
    }
}

impl Chunk {
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
                None => Bucket::of(&self.samples[begin..], begin),
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
