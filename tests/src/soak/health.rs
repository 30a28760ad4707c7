//! Memory and descriptors of a daemon over time.

use super::plan::Plan;
use crate::Daemon;
use crate::process::{descriptors, size_kib};
use std::time::{Duration, Instant};

/// Time between two looks.
const EVERY: Duration = Duration::from_secs(1);

/// Most memory that a daemon may take, KiB. Under attack it takes 38 MB (docs/measured.md).
pub(super) const MAX_MEMORY_KIB: u64 = 48 * 1024;

/// Most that the memory may grow by between the last two quarters of a soak, KiB.
pub(super) const MAX_GROWTH_KIB: i64 = 512;

/// Time after which the histories of a daemon are full (docs/measured.md), s.
const HISTORIES_FULL_S: f64 = 330.0;

/// Most descriptors that a daemon may have beyond those without clients: a client has one, and there is room for 32;
/// a scene, the metrics and a look at /proc take one each for a moment.
pub(super) const MAX_DESCRIPTORS_MORE: usize = 40;

/// A look at a daemon.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Snapshot {
    /// Time of the soak, s.
    pub(super) time_s: f64,
    pub(super) resident_kib: u64,
    pub(super) descriptors: usize,
}

impl Snapshot {
    pub(super) fn of(plan: &Plan, daemon: &Daemon) -> Self {
        Self::of_process(plan, daemon.pid())
    }

    fn of_process(plan: &Plan, pid: u32) -> Self {
        Self {
            time_s: plan.time_s(),
            resident_kib: size_kib(pid, "VmRSS").unwrap_or(0),
            descriptors: descriptors(pid),
        }
    }
}

/// All looks at a daemon.
#[derive(Debug, Default)]
pub(super) struct History {
    pub(super) snapshots: Vec<Snapshot>,
    /// Descriptors before the first client came and after the last had gone.
    pub(super) descriptors_without_clients: [usize; 2],
}

/// Looks at a daemon until the soak is over.
pub(super) fn watch(plan: &Plan, pid: u32) -> History {
    let mut history = History::default();
    let mut due = Instant::now();
    while !plan.is_over() {
        if Instant::now() < due {
            std::thread::sleep(Duration::from_millis(20));
            continue;
        }
        due = Instant::now() + EVERY;
        history.snapshots.push(Snapshot::of_process(plan, pid));
    }
    history
}

impl History {
    /// Compares the descriptors of a daemon whose clients have gone with those before they came. The daemon closes a
    /// connection when it has noticed its end.
    pub(super) fn at_the_end(&mut self, quiet: &Snapshot, plan: &Plan, daemon: &Daemon) {
        let began = Instant::now();
        let mut after = Snapshot::of(plan, daemon);
        while after.descriptors > quiet.descriptors && began.elapsed() < crate::PATIENCE {
            crate::pause();
            after = Snapshot::of(plan, daemon);
        }
        self.descriptors_without_clients = [quiet.descriptors, after.descriptors];
    }

    /// Largest memory, KiB.
    pub(super) fn most_memory_kib(&self) -> u64 {
        self.snapshots.iter().map(|one| one.resident_kib).max().unwrap_or(0)
    }

    /// Most descriptors.
    pub(super) fn most_descriptors(&self) -> usize {
        self.snapshots.iter().map(|one| one.descriptors).max().unwrap_or(0)
    }

    /// Growth of the median memory from the third quarter of the soak to the last, KiB; nothing where the histories
    /// still fill in these.
    pub(super) fn growth_kib(&self) -> Option<i64> {
        let length_s = self.snapshots.last()?.time_s;
        if length_s / 2.0 < HISTORIES_FULL_S {
            return None;
        }
        let median = |from: f64, to: f64| {
            let mut kib: Vec<u64> = self
                .snapshots
                .iter()
                .filter(|one| (from..to).contains(&(one.time_s / length_s)))
                .map(|one| one.resident_kib)
                .collect();
            kib.sort_unstable();
            kib.get(kib.len() / 2).and_then(|kib| i64::try_from(*kib).ok())
        };
        Some(median(0.75, 1.01)? - median(0.5, 0.75)?)
    }
}
