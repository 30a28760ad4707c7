//! A piece of a tape, with the extremes of its samples at several coarsenesses (a min/max pyramid): an hour is drawn from a few thousand
//! buckets instead of millions of samples, and a spike of a single sample is still the extreme of its bucket.

use super::signal::Signal;
use haptic_ipc::Sample;

/// Samples of a full chunk.
pub(crate) const CHUNK: usize = 1024;

/// Samples of a bucket, by level. The extremes of all levels take a tenth of the samples' own memory.
pub(crate) const LEVELS: [usize; 4] = [16, 64, 256, CHUNK];

const SIGNALS: usize = Signal::ALL.len();

/// Whose extremes stand where: each signal at its own number.
const BY_NUMBER: [Signal; SIGNALS] = [
    Signal::CouplingForce,
    Signal::HandForce,
    Signal::BlockPosition,
    Signal::DevicePosition,
    Signal::BlockVelocity,
    Signal::DeviceVelocity,
];

/// What the contact was, as a set: a bucket may hold every kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Contacts(u8);

impl Contacts {
    const STUCK: u8 = 1;
    const SLIDING: u8 = 2;

    pub(crate) fn of(sample: &Sample) -> Self {
        // While no force is on there is no surface that the block could stick to.
        Self(match (sample.state.is_live(), sample.contact) {
            (false, _) => 0,
            (true, 0) => Self::STUCK,
            (true, _) => Self::SLIDING,
        })
    }

    pub(crate) fn join(&mut self, other: Self) {
        self.0 |= other.0;
    }

    /// Whether the block slid at all, for the shortest slip is to be seen at any zoom; nothing where no force was on.
    pub(crate) fn slides(self) -> Option<bool> {
        (self.0 != 0).then_some(self.0 & Self::SLIDING != 0)
    }
}

/// The extremes of some consecutive samples of a chunk.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bucket {
    /// Time of the first sample, s on the daemon's clock.
    pub(crate) first_s: f64,
    least: [f64; SIGNALS],
    greatest: [f64; SIGNALS],
    /// Places in the chunk.
    least_at: [u16; SIGNALS],
    greatest_at: [u16; SIGNALS],
    pub(crate) contacts: Contacts,
}

impl Bucket {
    fn of(samples: &[Sample], begin: usize) -> Option<Self> {
        let mut all = samples.iter().zip(begin..).map(|(sample, place)| {
            // A chunk has 1024 places.
            let place = u16::try_from(place).unwrap_or(u16::MAX);
            let values = BY_NUMBER.map(|signal| signal.of(sample));
            Self {
                first_s: sample.t_s,
                least: values,
                greatest: values,
                least_at: [place; SIGNALS],
                greatest_at: [place; SIGNALS],
                contacts: Contacts::of(sample),
            }
        });
        let mut bucket = all.next()?;
        all.for_each(|next| bucket.join(&next));
        Some(bucket)
    }

    /// Takes in the bucket that follows. Of two alike the first is the least and the last the greatest, as where samples are drawn one by one.
    fn join(&mut self, next: &Self) {
        for signal in 0..SIGNALS {
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

    /// The least and the greatest value of a signal, each with its place in the chunk.
    pub(crate) fn extremes(&self, signal: Signal) -> [(f64, usize); 2] {
        let signal = signal as usize;
        [
            (self.least[signal], usize::from(self.least_at[signal])),
            (self.greatest[signal], usize::from(self.greatest_at[signal])),
        ]
    }
}

/// Up to [`CHUNK`] samples in the order of time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Chunk {
    samples: Vec<Sample>,
    /// Those of the buckets that are full, by level.
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

    /// The bucket of a level that begins at a place; nothing where none does, or it is not full yet.
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

    /// Memory that it takes, bytes.
    #[cfg(test)]
    pub(crate) fn bytes(&self) -> usize {
        let buckets: usize = self.buckets.iter().map(Vec::capacity).sum();
        size_of::<Self>() + self.samples.capacity() * size_of::<Sample>() + buckets * size_of::<Bucket>()
    }
}
