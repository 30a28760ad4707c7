//! A recording that is written on a thread of its own: only that thread waits for a disk.
//!
//! ```text
//! event, mark ──► at most 60,000 rows, and 1000 changes and markers ──► thread ──► Recorder ──► file
//! ```
//!
//! What finds no room is counted, and stands in the recording where it is missing. Rows do not overtake the changes
//! before them; of the changes that are lost the newest state and the newest settings are kept, so that the rows after
//! the gap stand under the scene that they belong to.

use crate::mark::Mark;
use crate::recorder::Recorder;
use crate::writer::Totals;
use haptic_ipc::{Event, SamplesEvent, ServoEvent, StateEvent};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::{io, thread};

/// How much waits for the disk at most.
#[derive(Clone, Copy, Debug)]
struct Room {
    /// Rows; a batch without rows counts as one.
    rows: usize,
    /// Changes of state, scene or settings, and marks.
    changes: usize,
}

/// A minute at 1 kHz, 10 MB, and more changes than a person could follow, 2 MB.
const ROOM: Room = Room {
    rows: 60_000,
    changes: 1000,
};

/// What became of an event or a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Enqueued {
    /// It waits for the disk.
    Yes,
    /// There was no room for it.
    No {
        /// Rows that found no room since the recording began, and those that the daemon reported missing among them.
        lost_rows: u64,
        /// Changes and marks that found no room since then.
        lost_changes: u64,
    },
    /// The thread has ended: nothing more is written.
    Ended,
}

/// A recording that is written on a thread of its own. No call waits for the disk. When it is dropped, what waits is
/// written, and the recording is closed without an end.
#[derive(Debug)]
pub struct RecordingThread {
    queue: Arc<Queue>,
}

/// What waits for the disk, for the thread that writes it.
#[derive(Debug)]
pub struct WaitingParts {
    queue: Arc<Queue>,
}

#[derive(Debug)]
struct Queue {
    waiting: Mutex<QueueState>,
    changed: Condvar,
}

#[derive(Debug)]
struct QueueState {
    room: Room,
    parts: VecDeque<Part>,
    rows: usize,
    changes: usize,
    missing: Losses,
    lost_rows: u64,
    lost_changes: u64,
    is_flush_due: bool,
    end: Option<End>,
    has_thread: bool,
}

#[derive(Debug)]
enum Part {
    Samples(SamplesEvent),
    Change(Event),
    Mark(Mark),
    LostChanges(u64),
}

/// What found no room since the newest part that did.
#[derive(Debug, Default)]
struct Losses {
    rows: u64,
    changes: u64,
    /// The newest ones of those changes.
    state: Option<StateEvent>,
    servo: Option<Box<ServoEvent>>,
}

#[derive(Clone, Copy, Debug)]
enum End {
    Finish,
    BreakOff,
}

/// What the thread does next.
enum Next {
    Write(Part),
    Flush,
    End(End),
}

impl RecordingThread {
    /// Starts the thread. `write` runs on it; it opens the file and passes the recorder to [`WaitingParts::write`].
    ///
    /// # Errors
    /// No thread can be started.
    pub fn spawn(write: impl FnOnce(&WaitingParts) + Send + 'static) -> io::Result<Self> {
        Self::with(ROOM, write)
    }

    fn with(room: Room, write: impl FnOnce(&WaitingParts) + Send + 'static) -> io::Result<Self> {
        let queue = Arc::new(Queue {
            waiting: Mutex::new(QueueState {
                room,
                parts: VecDeque::new(),
                rows: 0,
                changes: 0,
                missing: Losses::default(),
                lost_rows: 0,
                lost_changes: 0,
                is_flush_due: false,
                end: None,
                has_thread: true,
            }),
            changed: Condvar::new(),
        });
        let waiting = WaitingParts {
            queue: Arc::clone(&queue),
        };
        thread::Builder::new()
            .name("record".to_owned())
            .spawn(move || write(&waiting))?;
        Ok(Self { queue })
    }

    /// Takes an event. Those that are not of a recording are passed over.
    pub fn event(&self, event: &Event) -> Enqueued {
        match event {
            Event::Samples(samples) => self.enqueue(|waiting| waiting.enqueue_samples(samples)),
            Event::State(_) | Event::Servo(_) | Event::Log(_) => {
                self.enqueue(|waiting| waiting.enqueue_change(Part::Change(event.clone())))
            }
            Event::Snapshot(_) => self.enqueue(|waiting| {
                waiting.enqueue_snapshot(event);
                true
            }),
            Event::Timing(_) | Event::Unknown => Enqueued::Yes,
        }
    }

    /// Takes a mark.
    pub fn mark(&self, mark: Mark) -> Enqueued {
        self.enqueue(|waiting| waiting.enqueue_change(Part::Mark(mark)))
    }

    /// Has what is in memory passed on to the file, for when no events come.
    pub fn flush(&self) {
        self.queue.lock().is_flush_due = true;
        self.queue.changed.notify_one();
    }

    /// Has the recording ended after what waits; [`WaitingParts::write`] returns then.
    pub fn finish(self) {
        self.end(End::Finish);
    }

    fn end(&self, end: End) {
        self.queue.lock().end.get_or_insert(end);
        self.queue.changed.notify_one();
    }

    fn enqueue(&self, enqueue: impl FnOnce(&mut QueueState) -> bool) -> Enqueued {
        let mut waiting = self.queue.lock();
        if !waiting.has_thread {
            return Enqueued::Ended;
        }
        let is_enqueued = enqueue(&mut waiting);
        self.queue.changed.notify_one();
        if is_enqueued {
            return Enqueued::Yes;
        }
        Enqueued::No {
            lost_rows: waiting.lost_rows,
            lost_changes: waiting.lost_changes,
        }
    }
}

impl Drop for RecordingThread {
    fn drop(&mut self) {
        self.end(End::BreakOff);
    }
}

impl WaitingParts {
    /// Writes what comes until the recording is ended, and reports its totals after each part.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&self, mut recorder: Recorder, mut report: impl FnMut(Totals)) -> io::Result<Totals> {
        report(recorder.totals());
        loop {
            match self.next() {
                Next::Write(Part::Samples(samples)) => recorder.samples(&samples)?,
                Next::Write(Part::Change(event)) => recorder.event(&event)?,
                Next::Write(Part::Mark(mark)) => recorder.mark(mark),
                Next::Write(Part::LostChanges(count)) => recorder.lost_changes(count)?,
                Next::Flush => recorder.flush()?,
                Next::End(End::Finish) => return recorder.finish(),
                Next::End(End::BreakOff) => return recorder.break_off(),
            }
            report(recorder.totals());
        }
    }

    /// Waits for what comes next.
    fn next(&self) -> Next {
        let mut waiting = self.queue.lock();
        loop {
            if let Some(next) = waiting.next() {
                return next;
            }
            waiting = self.queue.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Drop for WaitingParts {
    fn drop(&mut self) {
        let mut waiting = self.queue.lock();
        waiting.has_thread = false;
        waiting.parts.clear();
    }
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, QueueState> {
        // It is consistent between any two statements, so a panic elsewhere leaves it usable.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl QueueState {
    /// Says whether there was room.
    fn enqueue_samples(&mut self, samples: &SamplesEvent) -> bool {
        self.enqueue_lost_changes();
        let rows = samples.rows.len().max(1);
        if self.missing.changes > 0 || self.rows + rows > self.room.rows {
            let lost = samples.dropped.saturating_add(samples.rows.len() as u64);
            self.missing.rows = self.missing.rows.saturating_add(lost);
            self.lost_rows = self.lost_rows.saturating_add(lost);
            return false;
        }
        let missing = std::mem::take(&mut self.missing.rows);
        self.rows += rows;
        self.parts.push_back(Part::Samples(SamplesEvent {
            dropped: samples.dropped.saturating_add(missing),
            ..samples.clone()
        }));
        true
    }

    /// Says whether there was room.
    fn enqueue_change(&mut self, change: Part) -> bool {
        self.enqueue_lost_changes();
        if self.missing.changes == 0 && self.changes < self.room.changes {
            self.push_change(change);
            return true;
        }
        self.missing.changes += 1;
        self.lost_changes += 1;
        match change {
            Part::Change(Event::State(state)) => self.missing.state = Some(state),
            Part::Change(Event::Servo(servo)) => self.missing.servo = Some(servo),
            _ => {}
        }
        false
    }

    /// One without room is left out: a replay goes on from the next one.
    fn enqueue_snapshot(&mut self, snapshot: &Event) {
        if self.missing.changes == 0 && self.changes < self.room.changes {
            self.push_change(Part::Change(snapshot.clone()));
        }
    }

    fn push_change(&mut self, change: Part) {
        self.changes += 1;
        self.parts.push_back(change);
    }

    /// Where there is room again after changes were lost, says how many, and what holds since.
    fn enqueue_lost_changes(&mut self) {
        if self.missing.changes == 0 || self.changes >= self.room.changes {
            return;
        }
        let Losses {
            rows,
            changes,
            state,
            servo,
        } = std::mem::take(&mut self.missing);
        self.enqueue_gap(rows);
        // The newest ones are not lost.
        let kept = u64::from(state.is_some()) + u64::from(servo.is_some());
        self.lost_changes -= kept;
        if changes > kept {
            self.push_change(Part::LostChanges(changes - kept));
        }
        for event in [state.map(Event::State), servo.map(Event::Servo)].into_iter().flatten() {
            self.push_change(Part::Change(event));
        }
    }

    fn enqueue_gap(&mut self, dropped: u64) {
        if dropped > 0 {
            self.rows += 1;
            self.parts.push_back(Part::Samples(SamplesEvent {
                dropped,
                ..SamplesEvent::default()
            }));
        }
    }

    fn next(&mut self) -> Option<Next> {
        if self.parts.is_empty() {
            self.enqueue_lost_changes();
            let rows = std::mem::take(&mut self.missing.rows);
            self.enqueue_gap(rows);
        }
        let Some(part) = self.parts.pop_front() else {
            let is_flush_due = std::mem::take(&mut self.is_flush_due);
            return if is_flush_due {
                Some(Next::Flush)
            } else {
                self.end.map(Next::End)
            };
        };
        match &part {
            Part::Samples(samples) => self.rows -= samples.rows.len().max(1),
            Part::Change(_) | Part::Mark(_) | Part::LostChanges(_) => self.changes -= 1,
        }
        Some(Next::Write(part))
    }
}

#[cfg(test)]
mod tests;
