//! The recorder writes a recording on a thread of its own: only that thread waits for a disk.
//!
//! If the disk does not keep up, what is lost is counted, shown, and marked as lost in the recording.

use crate::files;
use crate::update::Update;
use crate::update_sender::UpdateSender;
use haptic_ipc::Event;
use haptic_recording::{Enqueued, Format, Mark, Metadata, RecordingThread, Totals, WaitingParts};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, TryRecvError};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// How long a recording waits for the snapshot that it begins with; a motion of the rig's own has none.
const SNAPSHOT_TIME: Duration = Duration::from_millis(500);

/// How long a closing panel waits until its recording is written.
const CLOSING_TIME: Duration = Duration::from_secs(1);

/// Begins and ends recordings for the window, and takes events from the listening thread. The lock is
/// held while an event enters the queue, and never while a file is written.
#[derive(Debug)]
pub(crate) struct Recorder {
    slot: Mutex<Slot>,
    updates: UpdateSender,
}

#[derive(Debug, Default)]
struct Slot {
    writer: Option<Writer>,
    /// Disconnects when the recording before is written.
    ending: Option<mpsc::Receiver<()>>,
}

#[derive(Debug)]
struct Writer {
    folder: PathBuf,
    thread: RecordingThread,
    done: mpsc::Receiver<()>,
    /// Until when the first snapshot is waited for.
    waits_until: Option<Instant>,
}

impl Recorder {
    pub(crate) fn new(updates: UpdateSender) -> Self {
        Self {
            slot: Mutex::default(),
            updates,
        }
    }

    fn slot(&self) -> MutexGuard<'_, Slot> {
        // The slot is consistent between any two statements, so a panic elsewhere leaves it usable.
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a recording in a new file in `folder`, and ends the one before.
    pub(crate) fn begin(&self, folder: PathBuf, format: Format, metadata: Metadata) {
        let mut slot = self.slot();
        slot.end();
        let before = slot.ending.as_ref().map(mpsc::Receiver::try_recv);
        if before == Some(Err(TryRecvError::Empty)) {
            let why = "the recording before this one still waits for its disk".to_owned();
            drop(slot);
            self.report(RecordingNews::Failed { why });
            return;
        }
        match Writer::begin(folder, format, metadata, self.updates.clone()) {
            Ok(writer) => slot.writer = Some(writer),
            Err(error) => {
                let why = format!("no thread to record with: {error}");
                drop(slot);
                self.report(RecordingNews::Failed { why });
            }
        }
    }

    /// Sets a marker in the recording. Waits for nothing.
    pub(crate) fn mark(&self, tick: u64, text: String) {
        self.keep_with(|writer| writer.thread.mark(Mark::Marker { tick, text }));
    }

    /// Ends the recording. The queue is still written.
    pub(crate) fn end(&self) {
        self.slot().end();
    }

    /// Ends the recording, and waits a moment until it is written.
    pub(crate) fn close(&self) {
        let ending = {
            let mut slot = self.slot();
            slot.end();
            slot.ending.take()
        };
        if let Some(ending) = ending {
            // Nothing is ever sent: the other end is dropped when all is written. On a stalled disk the
            // rest is lost: it is not worth a window that hangs.
            ending.recv_timeout(CLOSING_TIME).unwrap_or_default();
        }
    }

    /// Leaves out what comes before the next snapshot of the servo, for a moment: a replay begins with the first row.
    pub(crate) fn begin_at_snapshot(&self) {
        if let Some(writer) = &mut self.slot().writer {
            writer.waits_until = Some(Instant::now() + SNAPSHOT_TIME);
        }
    }

    /// Passes on an event. Waits for nothing.
    pub(crate) fn keep(&self, event: &Event) {
        self.keep_with(|writer| writer.event(event));
    }

    fn keep_with(&self, keep: impl FnOnce(&mut Writer) -> Enqueued) {
        let mut slot = self.slot();
        let Some(writer) = &mut slot.writer else { return };
        match keep(writer) {
            Enqueued::Yes => {}
            Enqueued::No {
                lost_rows,
                lost_changes,
            } => {
                let news = RecordingNews::Behind {
                    path: writer.folder.clone(),
                    lost: lost_rows,
                    lost_changes,
                };
                drop(slot);
                self.report(news);
            }
            // The thread has sent the reason.
            Enqueued::Ended => slot.end(),
        }
    }

    fn report(&self, news: RecordingNews) {
        // A closed panel needs no news.
        self.updates.send(Update::Recording(news)).unwrap_or_default();
    }
}

impl Slot {
    fn end(&mut self) {
        if let Some(writer) = self.writer.take() {
            writer.thread.finish();
            self.ending = Some(writer.done);
        }
    }
}

impl Writer {
    fn begin(folder: PathBuf, format: Format, metadata: Metadata, updates: UpdateSender) -> io::Result<Self> {
        let (writes, done) = mpsc::channel();
        let folder_of_thread = folder.clone();
        let thread = RecordingThread::spawn(move |waiting| {
            let ended = write(&folder_of_thread, format, metadata, waiting, &updates);
            // This marks its end, so it comes before the news.
            drop(writes);
            let news_of_end = ended.unwrap_or_else(|why| RecordingNews::Failed { why });
            updates.send(Update::Recording(news_of_end)).unwrap_or_default();
        })?;
        Ok(Self {
            folder,
            thread,
            done,
            waits_until: None,
        })
    }

    fn event(&mut self, event: &Event) -> Enqueued {
        let waits = |until: Instant| !matches!(event, Event::Snapshot(_)) && Instant::now() < until;
        self.waits_until = self.waits_until.filter(|until| waits(*until));
        if self.waits_until.is_some() {
            return Enqueued::Yes;
        }
        self.thread.event(event)
    }
}

/// Writes what waits until the recording is ended.
fn write(
    folder: &Path,
    format: Format,
    mut metadata: Metadata,
    waiting: &WaitingParts,
    updates: &UpdateSender,
) -> Result<RecordingNews, String> {
    let (path, file) = files::create(folder, "haptic-recording", format.ending())?;
    let failed = |error: io::Error| format!("the recording ends here: cannot write {}: {error}", path.display());
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH);
    metadata.started_unix_s = since_1970.map_or(0.0, |time| time.as_secs_f64());
    let recorder = haptic_recording::Recorder::new(format, file, &path, &metadata).map_err(failed)?;
    let report = |totals| {
        let path = path.clone();
        // A closed panel ends the recording by itself.
        updates
            .send(Update::Recording(RecordingNews::Going { path, totals }))
            .unwrap_or_default();
    };
    let totals = waiting.write(recorder, report).map_err(failed)?;
    Ok(RecordingNews::Ended { path, totals })
}

/// News of the recording that is being written.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordingNews {
    /// It is being written.
    Going {
        /// Its file.
        path: PathBuf,
        /// What it holds.
        totals: Totals,
    },
    /// The disk does not keep up, and samples, changes or markers are lost.
    Behind {
        /// Its file, or the folder while there is no file.
        path: PathBuf,
        /// Samples lost since it began.
        lost: u64,
        /// Changes and markers lost since it began.
        lost_changes: u64,
    },
    /// It was ended.
    Ended {
        /// Its file.
        path: PathBuf,
        /// What it holds.
        totals: Totals,
    },
    /// It could not be begun, or not be written to its end.
    Failed {
        /// Why, with the name of the file.
        why: String,
    },
}

/// Length and size of a recording in words.
pub(crate) fn amount(totals: &Totals) -> String {
    #[expect(clippy::cast_precision_loss, reason = "one decimal is shown")]
    let megabytes = totals.bytes as f64 / 1e6;
    let mut text = format!("{:.1} s, {megabytes:.1} MB", totals.length_s);
    if totals.lost > 0 {
        text += &format!(", {} samples missing", totals.lost);
    }
    if totals.lost_changes > 0 {
        text += &format!(", {} changes and markers missing", totals.lost_changes);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::fixture::metadata;
    use crate::tape::tests::at;
    use haptic_ipc::Sample;

    fn batch(rows: Vec<Sample>) -> Event {
        Event::Samples(crate::tape::tests::batch(rows))
    }

    /// Waits for the end of a recording.
    fn ended(received: &mpsc::Receiver<Update>) -> RecordingNews {
        loop {
            let update = received.recv_timeout(Duration::from_secs(30)).expect("news in time");
            if let Update::Recording(news @ (RecordingNews::Ended { .. } | RecordingNews::Failed { .. })) = update {
                return news;
            }
        }
    }

    #[test]
    fn recorded_samples_are_read_back() {
        let folder = tempfile::tempdir().expect("a folder");
        let (updates, received) = UpdateSender::new(|_| {});
        let recorder = Recorder::new(updates);
        recorder.begin(folder.path().to_path_buf(), Format::Csv, metadata());
        let rows: Vec<_> = (0..50).map(|i| at(f64::from(i) * 1e-3)).collect();
        recorder.mark(0, "before the first row".into());
        recorder.keep(&batch(rows.clone()));
        recorder.mark(1_000_000, "after the last".into());
        recorder.end();
        let RecordingNews::Ended { path, totals } = ended(&received) else {
            panic!("not ended");
        };
        let read = haptic_recording::read(&path).expect("a recording");
        assert_eq!((read.rows, totals.rows), (rows, 50));
        let markers = read.marks.iter().filter_map(|(before, mark)| match mark {
            Mark::Marker { text, .. } => Some((*before, text.as_str())),
            _ => None,
        });
        let markers: Vec<_> = markers.collect();
        assert_eq!(markers, [(0, "before the first row"), (50, "after the last")]);
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let (updates, received) = UpdateSender::new(|_| {});
        let recorder = Recorder::new(updates);
        recorder.begin("/nowhere/at/all".into(), Format::Csv, metadata());
        let RecordingNews::Failed { why } = ended(&received) else {
            panic!("it failed");
        };
        assert!(why.contains("/nowhere/at/all"), "{why}");
    }

    // hazard: H4
    #[test]
    fn rows_lost_to_a_stalled_disk_are_counted_without_waiting() {
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join("stalled");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.expect("mkfifo runs").success());
        let (updates, received) = UpdateSender::new(|_| {});
        let recorder = Recorder::new(updates);
        // Nobody reads the pipe, so that the thread that writes stands in its opening.
        recorder.begin(pipe.clone(), Format::Csv, metadata());
        // There is room for two of these.
        let (batches, rows) = (4, 25_000);
        for number in 0..batches {
            let ticks = number * rows..(number + 1) * rows;
            let row = |tick: u64| Sample {
                tick,
                ..at(tick as f64 * 1e-3)
            };
            recorder.keep(&batch(ticks.map(row).collect()));
        }
        recorder.end();
        recorder.begin(folder.path().to_path_buf(), Format::Csv, metadata());
        let RecordingNews::Failed { why } = ended(&received) else {
            panic!("a second recording does not wait for the first");
        };
        assert!(why.contains("still waits"), "{why}");
        // Now the disk works again.
        let text = std::fs::read(&pipe).expect("it is written to its end");
        let read = haptic_recording::Reader::from_bytes(text).expect("a recording");
        let read = read.into_recording().expect("a recording");
        let RecordingNews::Ended { totals, .. } = ended(&received) else {
            panic!("not ended");
        };
        assert_eq!(read.rows.len() as u64, totals.rows);
        assert_eq!((totals.rows, totals.lost), (2 * rows, 2 * rows));
    }
}
