//! What is asked of the soak of one daemon, how long it has run, and the order of its random numbers.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// What every thread of the soak of one daemon knows.
#[derive(Debug)]
pub(super) struct Plan {
    pub(super) seed: u64,
    pub(super) length: Duration,
    pub(super) began: Instant,
    /// Where recordings are.
    pub(super) folder: PathBuf,
    /// No fault is brought about any more: the clients of this daemon end.
    pub(super) over: AtomicBool,
}

impl Plan {
    /// The same for another daemon.
    pub(super) fn for_another(&self) -> Self {
        Self {
            folder: self.folder.clone(),
            over: AtomicBool::new(false),
            ..*self
        }
    }

    pub(super) fn is_over(&self) -> bool {
        self.over.load(Ordering::Relaxed)
    }

    /// Time since it began, s.
    pub(super) fn time_s(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    /// A source of random numbers of its own for each user.
    pub(super) fn random(&self, rig: &str, user: u64) -> fastrand::Rng {
        let rig = rig
            .bytes()
            .fold(0_u64, |sum, byte| sum.wrapping_mul(31) + u64::from(byte));
        fastrand::Rng::with_seed(self.seed.wrapping_add(rig).wrapping_mul(1_000_003).wrapping_add(user))
    }
}
