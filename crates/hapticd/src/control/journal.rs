//! Who changed what, and when.

use haptic_ipc::{JournalEntry, LogReply};
use std::collections::VecDeque;
use std::time::{SystemTime, UNIX_EPOCH};

/// Entries kept: some hours of work by hand, two seconds of a program that changes something at every tick.
const KEPT: usize = 2000;

/// What an entry waits for before it is whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Until {
    /// Nothing.
    Done,
    /// The tick that renders this revision, or a newer one.
    Rendered(u64),
    /// The tick that carries out the stop of this number.
    Stopped(u64),
}

/// The journal.
#[derive(Debug, Default)]
pub(crate) struct Journal {
    kept: VecDeque<JournalEntry>,
    waiting: VecDeque<(Until, JournalEntry)>,
    last: u64,
}

impl Journal {
    /// Takes an entry in, which gets its number and its time here; it appears once it is whole.
    pub(crate) fn enter(&mut self, until: Until, entry: JournalEntry) {
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let entry = JournalEntry {
            time_unix_s: since_1970.as_secs_f64(),
            ..entry
        };
        self.waiting.push_back((until, entry));
    }

    /// The entries that are whole by now, in the order in which they came; `tick` fills in what is still missing, or says that it is not known yet.
    pub(crate) fn completed(&mut self, mut fill: impl FnMut(Until, &mut JournalEntry) -> bool) -> Vec<JournalEntry> {
        let mut whole = Vec::new();
        while let Some((until, mut entry)) = self.waiting.pop_front() {
            if until != Until::Done && !fill(until, &mut entry) {
                self.waiting.push_front((until, entry));
                break;
            }
            self.last += 1;
            entry.seq = self.last;
            if self.kept.len() == KEPT {
                self.kept.pop_front();
            }
            self.kept.push_back(entry.clone());
            whole.push(entry);
        }
        whole
    }

    /// Whether a stop is on its way.
    pub(crate) fn waits_for_a_stop(&self) -> bool {
        self.waiting.iter().any(|(until, _)| matches!(until, Until::Stopped(_)))
    }

    /// The newest entries, at most `limit` of them, that came after number `after`.
    pub(crate) fn entries(&self, after: u64, limit: usize) -> LogReply {
        let from = self.kept.partition_point(|entry| entry.seq <= after);
        let from = from.max(self.kept.len().saturating_sub(limit));
        LogReply {
            entries: self.kept.range(from..).cloned().collect(),
            oldest_kept: self.kept.front().map_or(self.last + 1, |entry| entry.seq),
        }
    }
}
