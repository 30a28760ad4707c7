//! The journal: who changed what, and when.

use haptic_core::servo::Fault;
use haptic_ipc::{Difference, JournalEntry, LogReply, Value};
use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Most entries kept: some hours of work by hand, two seconds of a program that changes the scene
/// at every tick.
const MAX_KEPT: usize = 2000;

/// Most bytes of the entries kept, and of the incomplete ones: 2000 entries of a single parameter
/// take half of it. A client chooses how long an entry is.
const KEPT_BYTES: usize = 2 * 1024 * 1024;

/// Most bytes of the entries in one answer.
const ANSWER_BYTES: usize = 512 * 1024;

/// How long an entry waits for its tick: longer than its client waits for an answer. Later entries
/// wait as well, even a fault.
const MAX_WAIT: Duration = Duration::from_millis(1500);

/// The event that completes an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Completion {
    /// None: it is complete.
    Done,
    /// The tick that renders this revision, or a newer one.
    Rendered(u64),
    /// The tick that carries out the stop of this number.
    Stopped(u64),
}

/// A queue that counts the bytes of its entries.
#[derive(Debug)]
struct SizedQueue<T> {
    entries: VecDeque<(usize, T)>,
    bytes: usize,
}

impl<T> Default for SizedQueue<T> {
    fn default() -> Self {
        Self {
            entries: VecDeque::new(),
            bytes: 0,
        }
    }
}

impl<T> SizedQueue<T> {
    fn push(&mut self, bytes: usize, entry: T) {
        self.bytes += bytes;
        self.entries.push_back((bytes, entry));
    }

    fn pop(&mut self) -> Option<T> {
        let (bytes, entry) = self.entries.pop_front()?;
        self.bytes -= bytes;
        Some(entry)
    }
}

/// An entry that is not complete yet.
#[derive(Debug)]
struct PendingEntry {
    until: Completion,
    since: Instant,
    entry: JournalEntry,
}

#[derive(Debug, Default)]
pub(crate) struct Journal {
    kept: SizedQueue<JournalEntry>,
    waiting: SizedQueue<PendingEntry>,
    last: u64,
    /// Number of entries of each fault, by its code.
    faults: BTreeMap<String, u64>,
}

/// Memory of an entry, bytes.
fn bytes_of(entry: &JournalEntry) -> usize {
    let optional = |text: &Option<String>| text.as_ref().map_or(0, String::len);
    let by = entry
        .by
        .as_ref()
        .map_or(0, |by| by.session.len() + optional(&by.user) + optional(&by.program));
    size_of::<PendingEntry>()
        + entry.op.len()
        + optional(&entry.fault)
        + optional(&entry.message)
        + by
        + bytes_of_changes(&entry.changes)
}

/// Memory of differences, bytes.
fn bytes_of_changes(changes: &[Difference]) -> usize {
    let word = |value: &Option<Value>| match value {
        Some(Value::Word(word)) => word.len(),
        _ => 0,
    };
    changes
        .iter()
        .map(|change| {
            let unit = change.unit.as_ref().map_or(0, String::len);
            size_of::<Difference>() + change.param.len() + unit + word(&change.before) + word(&change.after)
        })
        .sum()
}

impl Journal {
    /// Enters an entry with the current time; it appears when it is complete.
    pub(crate) fn enter(&mut self, until: Completion, entry: JournalEntry) {
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let entry = JournalEntry {
            time_unix_s: since_1970.as_secs_f64(),
            ..entry
        };
        if let Some(code) = &entry.fault {
            *self.faults.entry(code.clone()).or_default() += 1;
        }
        let bytes = bytes_of(&entry);
        let waiting = PendingEntry {
            until,
            since: Instant::now(),
            entry,
        };
        self.waiting.push(bytes, waiting);
    }

    /// The entries that have become complete, in order. `fill` completes an entry, or returns false
    /// if it cannot yet. An entry that has waited too long, or for which there is no room, appears
    /// incomplete.
    pub(crate) fn completed(
        &mut self,
        mut fill: impl FnMut(Completion, &mut JournalEntry) -> bool,
    ) -> Vec<JournalEntry> {
        let mut completed = Vec::new();
        while let Some((_, PendingEntry { until, since, entry })) = self.waiting.entries.front_mut() {
            if *until != Completion::Done && !fill(*until, entry) {
                if since.elapsed() < MAX_WAIT && self.waiting.bytes <= KEPT_BYTES {
                    break;
                }
                entry.message = Some("the real-time thread has not confirmed it".to_owned());
            }
            let Some(PendingEntry { mut entry, .. }) = self.waiting.pop() else {
                break;
            };
            self.last += 1;
            entry.seq = self.last;
            self.kept.push(bytes_of(&entry), entry.clone());
            while self.kept.entries.len() > MAX_KEPT || self.kept.bytes > KEPT_BYTES {
                self.kept.pop();
            }
            completed.push(entry);
        }
        completed
    }

    /// Number of entries of each fault, by its code; also of those that never were.
    pub(crate) fn faults(&self) -> [(&'static str, u64); Fault::KINDS.len()] {
        let entries = |code: &str| self.faults.get(code).copied().unwrap_or(0);
        Fault::KINDS.map(|fault| (fault.code(), entries(fault.code())))
    }

    /// Whether a stop waits for its tick.
    pub(crate) fn waits_for_a_stop(&self) -> bool {
        let is_stop = |waiting: &PendingEntry| matches!(waiting.until, Completion::Stopped(_));
        self.waiting.entries.iter().any(|(_, waiting)| is_stop(waiting))
    }

    /// The newest entries after number `after`, at most `limit` and as many as fit in one answer.
    pub(crate) fn entries(&self, after: u64, limit: usize) -> LogReply {
        let mut left = ANSWER_BYTES;
        let newest = self.kept.entries.iter().rev().take(limit);
        let fitting = newest.take_while(|(bytes, entry)| {
            let fits = entry.seq > after && *bytes <= left;
            left = left.saturating_sub(*bytes);
            fits
        });
        let mut entries: Vec<JournalEntry> = fitting.map(|(_, entry)| entry.clone()).collect();
        entries.reverse();
        LogReply {
            entries,
            oldest_kept: self.kept.entries.front().map_or(self.last + 1, |(_, entry)| entry.seq),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::Directional;

    /// As long as a client can make one.
    fn long(index: u64) -> JournalEntry {
        let change = |param: String| Difference {
            param,
            unit: Some("N".to_owned()),
            before: Some(Value::Number(Directional::both(1.0))),
            after: Some(Value::Word("x".repeat(256))),
        };
        JournalEntry {
            changes: (0..40).map(|number| change(format!("parameter_{number}"))).collect(),
            revision: index,
            ..JournalEntry::of("scene.load")
        }
    }

    // hazard: H20
    #[test]
    fn what_the_journal_holds_is_bounded_in_bytes_whole_or_not() {
        let mut journal = Journal::default();
        for index in 0..2000 {
            journal.enter(Completion::Done, long(index));
        }
        journal.completed(|_, _| true);
        let counted: usize = journal.kept.entries.iter().map(|(_, entry)| bytes_of(entry)).sum();
        assert_eq!(counted, journal.kept.bytes);
        assert!(journal.kept.bytes <= KEPT_BYTES, "{}", journal.kept.bytes);
        let kept = journal.kept.entries.len();
        assert!(
            kept > 50 && kept < 2000,
            "{kept} entries of {} bytes",
            bytes_of(&long(0))
        );
        let all = journal.entries(0, usize::MAX);
        assert_eq!(all.entries.last().map(|entry| entry.seq), Some(2000));
        let answered: usize = all.entries.iter().map(bytes_of).sum();
        assert!(answered <= ANSWER_BYTES && all.entries.len() > 10, "{answered} bytes");
        let seqs: Vec<u64> = journal.entries(1990, 5).entries.iter().map(|entry| entry.seq).collect();
        assert_eq!(seqs, [1996, 1997, 1998, 1999, 2000]);

        // While the loop hangs nothing becomes whole.
        for index in 0..2000 {
            journal.enter(Completion::Rendered(index), long(index));
            journal.completed(|_, _| false);
            assert!(journal.waiting.bytes <= KEPT_BYTES, "{}", journal.waiting.bytes);
        }
    }

    // hazard: H18
    #[test]
    fn what_is_never_confirmed_does_not_hold_up_what_comes_after_it() {
        let mut journal = Journal::default();
        journal.enter(Completion::Rendered(2), JournalEntry::of("set"));
        journal.enter(Completion::Done, JournalEntry::of("fault"));
        assert!(journal.completed(|_, _| false).is_empty());
        let began = Instant::now();
        let whole = loop {
            let whole = journal.completed(|_, _| false);
            if !whole.is_empty() {
                break whole;
            }
            assert!(began.elapsed() < Duration::from_secs(30), "it waits for ever");
            std::thread::sleep(Duration::from_millis(10));
        };
        let ops: Vec<&str> = whole.iter().map(|entry| entry.op.as_str()).collect();
        assert_eq!(ops, ["set", "fault"]);
        assert!(
            whole[0]
                .message
                .as_ref()
                .is_some_and(|message| message.contains("not confirmed"))
        );
    }
}
