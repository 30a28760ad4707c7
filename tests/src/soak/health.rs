//! Memory and descriptors of a daemon over time.

use super::Plan;
use crate::process::{descriptors, size_kib};
use std::time::{Duration, Instant};

/// Most memory that a daemon may take, KiB. Under attack it takes 38 MB (docs/measured.md).
pub(super) const MAX_MEMORY_KIB: u64 = 48 * 1024;

/// Most that the memory may grow by between the last two quarters of a soak, KiB.
pub(super) const MAX_GROWTH_KIB: i64 = 512;

/// Time after which the histories of a daemon are full (docs/measured.md), s.
const HISTORIES_FULL_S: f64 = 330.0;

/// Most descriptors that a daemon may have beyond those without clients: a client has one, and there is room for 32;
/// a scene, the metrics and a look at /proc take one each for a moment.
pub(super) const MAX_DESCRIPTORS_MORE: usize = 40;

/// What a daemon took in each second.
#[derive(Debug, Default)]
pub(super) struct History {
    /// Times of the soak, s, and resident memory, KiB.
    memory: Vec<(f64, u64)>,
    pub(super) most_descriptors: usize,
}

/// Looks at a daemon until the soak is over.
pub(super) fn watch(plan: &Plan, pid: u32) -> History {
    let mut history = History::default();
    let mut due = Instant::now();
    while !plan.is_over() {
        if Instant::now() >= due {
            due += Duration::from_secs(1);
            let resident_kib = size_kib(pid, "VmRSS").unwrap_or(0);
            history.memory.push((plan.time_s(), resident_kib));
            history.most_descriptors = history.most_descriptors.max(descriptors(pid));
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    history
}

impl History {
    /// Largest memory, KiB.
    pub(super) fn most_memory_kib(&self) -> u64 {
        self.memory.iter().map(|&(_, kib)| kib).max().unwrap_or(0)
    }

    /// Growth of the median memory from the third quarter of the soak to the last, KiB; nothing where the histories
    /// still fill in these.
    pub(super) fn growth_kib(&self) -> Option<i64> {
        let &(length_s, _) = self.memory.last()?;
        if length_s / 2.0 < HISTORIES_FULL_S {
            return None;
        }
        let median = |from: f64, to: f64| {
            let within = self.memory.iter().filter(|(s, _)| (from..to).contains(&(s / length_s)));
            let mut kib: Vec<u64> = within.map(|&(_, kib)| kib).collect();
            kib.sort_unstable();
            kib.get(kib.len() / 2).and_then(|kib| i64::try_from(*kib).ok())
        };
        Some(median(0.75, 1.01)? - median(0.5, 0.75)?)
    }
}
