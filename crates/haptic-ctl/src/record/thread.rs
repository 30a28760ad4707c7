//! A recording that is written on a thread of its own: only that thread waits for a disk.

use crate::failure::Failure;
use haptic_ipc::{Event, SamplesEvent};
use haptic_lab::recording::{self, CreateError, Mark, Metadata, Recorder, Totals};
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::mpsc;
use tokio::sync::oneshot::{self, error::TryRecvError};
use tokio::sync::watch;

/// Most rows that wait for the disk: a minute at 1 kHz, 10 MB. Further ones are lost, which the recording
/// says.
const MOST_WAITING_ROWS: u64 = 60_000;

enum Part {
    Event(Event),
    Mark(Mark),
    Flush,
    Finish,
    BreakOff,
}

/// A recording under way.
pub(crate) struct RecordingThread {
    parts: mpsc::Sender<Part>,
    waiting_rows: Arc<AtomicU64>,
    /// Rows that found no room since the newest that did.
    missing: u64,
    first_s: Option<f64>,
    totals: watch::Receiver<Totals>,
    ended: oneshot::Receiver<io::Result<Totals>>,
}

impl RecordingThread {
    /// Creates a recording; the ending of its name says its format.
    ///
    /// # Errors
    /// The file cannot be created, or no thread be started.
    pub(crate) fn create(path: &Path, metadata: &Metadata, replace: bool) -> Result<Self, Failure> {
        let recorder = recording::create(path, metadata, replace).map_err(|error| not_created(&error))?;
        let (parts, heard) = mpsc::channel();
        let waiting_rows = Arc::new(AtomicU64::new(0));
        let (sum, totals) = watch::channel(recorder.totals());
        let (end, ended) = oneshot::channel();
        let waiting = Arc::clone(&waiting_rows);
        std::thread::Builder::new().name("record".to_owned()).spawn(move || {
            // Nobody may wait for its end any more.
            end.send(write(recorder, &heard, &waiting, &sum)).unwrap_or_default();
        })?;
        Ok(Self {
            parts,
            waiting_rows,
            missing: 0,
            first_s: None,
            totals,
            ended,
        })
    }

    /// Takes an event. Waits for nothing.
    pub(crate) fn event(&mut self, event: &Event) {
        let Event::Samples(samples) = event else {
            if matches!(event, Event::State(_) | Event::Servo(_)) {
                self.put(Part::Event(event.clone()));
            }
            return;
        };
        self.first_s = self.first_s.or(samples.rows.first().map(|row| row.t_s));
        let rows = samples.rows.len() as u64;
        let dropped = samples.dropped + self.missing;
        if self.waiting_rows.load(Relaxed) + rows > MOST_WAITING_ROWS {
            self.missing = dropped + rows;
            return;
        }
        self.waiting_rows.fetch_add(rows, Relaxed);
        self.missing = 0;
        self.put(Part::Event(Event::Samples(SamplesEvent {
            dropped,
            ..samples.clone()
        })));
    }

    /// Takes a mark. Waits for nothing.
    pub(crate) fn mark(&self, mark: Mark) {
        self.put(Part::Mark(mark));
    }

    /// Has what is in memory passed on to the file, for when no events come.
    pub(crate) fn flush(&self) {
        self.put(Part::Flush);
    }

    /// Time of the first row, s, once there is one.
    pub(crate) fn first_s(&self) -> Option<f64> {
        self.first_s
    }

    /// How much is written by now.
    pub(crate) fn totals(&self) -> Totals {
        *self.totals.borrow()
    }

    /// Whether it can still be written.
    ///
    /// # Errors
    /// It cannot. Nothing more is heard of it then.
    pub(crate) fn check(&mut self) -> io::Result<()> {
        match self.ended.try_recv() {
            Err(TryRecvError::Empty) => Ok(()),
            Ok(Err(error)) => Err(error),
            Ok(Ok(_)) | Err(TryRecvError::Closed) => Err(gone()),
        }
    }

    /// Ends the recording, and waits until it is on the disk.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) async fn finish(mut self) -> io::Result<Totals> {
        self.tell_missing();
        self.put(Part::Finish);
        self.ended.await.unwrap_or_else(|_| Err(gone()))
    }

    /// Closes the recording without an end.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) async fn break_off(mut self) -> io::Result<Totals> {
        self.tell_missing();
        self.put(Part::BreakOff);
        self.ended.await.unwrap_or_else(|_| Err(gone()))
    }

    fn tell_missing(&mut self) {
        let dropped = std::mem::take(&mut self.missing);
        if dropped > 0 {
            let (seq, rows) = (0, Vec::new());
            self.put(Part::Event(Event::Samples(SamplesEvent { seq, dropped, rows })));
        }
    }

    fn put(&self, part: Part) {
        // Without the thread there is an error to be heard of.
        self.parts.send(part).unwrap_or_default();
    }
}

fn not_created(error: &CreateError) -> Failure {
    match error {
        CreateError::File { path, source } => Failure::not_created(path, source),
        _ => Failure::Usage(error.to_string()),
    }
}

fn gone() -> io::Error {
    io::Error::other("the thread that writes the recording has ended")
}

fn write(
    mut recorder: Recorder,
    heard: &mpsc::Receiver<Part>,
    waiting_rows: &AtomicU64,
    sum: &watch::Sender<Totals>,
) -> io::Result<Totals> {
    for part in heard {
        match part {
            Part::Event(event) => {
                recorder.event(&event)?;
                if let Event::Samples(samples) = &event {
                    waiting_rows.fetch_sub(samples.rows.len() as u64, Relaxed);
                }
            }
            Part::Mark(mark) => recorder.mark(mark),
            Part::Flush => recorder.flush()?,
            Part::Finish => return recorder.finish(),
            Part::BreakOff => break,
        }
        sum.send_replace(recorder.totals());
    }
    recorder.break_off()
}
