//! A recording that is being made, by a thread of its own: what a disk keeps waiting is that thread alone.
//!
//! What is heard goes to it through a bounded queue. Where the disk does not keep up, samples are left out, counted, shown, and marked as lost in the
//! recording; changes of state and scene wait for room.

use super::RecordingNews;
use crate::export::open_new;
use crate::news::News;
use crate::update::Update;
use haptic_ipc::{Event, SamplesEvent};
use haptic_lab::recording::{Metadata, Recorder};
use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, TryRecvError, TrySendError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Events that wait for the disk at most: nine seconds of batches.
const WAITING_EVENTS: usize = 256;

/// Changes that wait for room among them at most.
const WAITING_CHANGES: usize = 1000;

/// How long a panel that is closed waits for the end of its recording to be written.
const LAST_MOMENT: Duration = Duration::from_secs(1);

/// The recording that is being made, for the window, which begins and ends it, and the listening thread, which feeds it. The lock is held while an
/// event is put into the queue, and never while something is written.
#[derive(Debug)]
pub(crate) struct Recordings {
    slot: Mutex<Slot>,
    news: News,
}

#[derive(Debug, Default)]
struct Slot {
    taking: Option<Taking>,
    /// Disconnected once the recording before is written to its end.
    ending: Option<mpsc::Receiver<()>>,
}

#[derive(Debug)]
struct Taking {
    folder: PathBuf,
    events: mpsc::SyncSender<Event>,
    /// Changes that the queue has no room for yet.
    changes: VecDeque<Event>,
    /// Samples that are missing since the newest event in the queue.
    lost: Arc<AtomicU64>,
    lost_in_all: u64,
    done: mpsc::Receiver<()>,
}

impl Recordings {
    pub(crate) fn new(news: News) -> Self {
        Self {
            slot: Mutex::default(),
            news,
        }
    }

    fn slot(&self) -> MutexGuard<'_, Slot> {
        // The slot is whole between any two statements, so a panic elsewhere does not spoil it.
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a recording in a new file in `folder`, and ends the one that was being made.
    pub(crate) fn begin(&self, folder: PathBuf, metadata: Metadata) {
        let mut slot = self.slot();
        slot.end();
        let before = slot.ending.as_ref().map(mpsc::Receiver::try_recv);
        if before == Some(Err(TryRecvError::Empty)) {
            let why = "the recording before this one still waits for its disk".to_owned();
            drop(slot);
            self.tell(RecordingNews::Failed { why });
            return;
        }
        match Taking::begin(folder, metadata, self.news.clone()) {
            Ok(taking) => slot.taking = Some(taking),
            Err(error) => {
                let why = format!("no thread to record with: {error}");
                drop(slot);
                self.tell(RecordingNews::Failed { why });
            }
        }
    }

    /// Ends the recording. What waits for the disk is still written.
    pub(crate) fn end(&self) {
        self.slot().end();
    }

    /// Ends the recording, and gives it a moment to be written.
    pub(crate) fn close(&self) {
        let ending = {
            let mut slot = self.slot();
            slot.end();
            slot.ending.take()
        };
        if let Some(ending) = ending {
            // Nothing is ever sent; the other end is dropped when all is written. On a disk that stalls the rest is lost: it is not worth a window
            // that hangs.
            ending.recv_timeout(LAST_MOMENT).unwrap_or_default();
        }
    }

    /// Passes on what was heard. Waits for nothing.
    pub(crate) fn keep(&self, event: &Event) {
        let mut slot = self.slot();
        let Some(taking) = &mut slot.taking else { return };
        let kept = taking.keep(event);
        let news = RecordingNews::Behind {
            path: taking.folder.clone(),
            lost: taking.lost_in_all,
        };
        match kept {
            Kept::Yes => {}
            Kept::No => {
                drop(slot);
                self.tell(news);
            }
            // The thread has told why.
            Kept::Ended => slot.end(),
        }
    }

    fn tell(&self, news: RecordingNews) {
        // A panel that is gone needs no news.
        self.news.tell(Update::Recording(news)).unwrap_or_default();
    }
}

impl Slot {
    fn end(&mut self) {
        if let Some(taking) = self.taking.take() {
            self.ending = Some(taking.done);
        }
    }
}

/// Whether an event was kept.
enum Kept {
    Yes,
    No,
    Ended,
}

impl Taking {
    fn begin(folder: PathBuf, metadata: Metadata, news: News) -> io::Result<Self> {
        let (events, heard) = mpsc::sync_channel(WAITING_EVENTS);
        let (writes, done) = mpsc::channel();
        let lost = Arc::new(AtomicU64::new(0));
        let (folder_of_thread, lost_of_thread) = (folder.clone(), Arc::clone(&lost));
        thread::Builder::new().name("record".to_owned()).spawn(move || {
            let ended = write(&folder_of_thread, metadata, &heard, &lost_of_thread, &news);
            // Its end is seen by this, so it comes before the news.
            drop((heard, writes));
            let news_of_end = ended.unwrap_or_else(|why| RecordingNews::Failed { why });
            news.tell(Update::Recording(news_of_end)).unwrap_or_default();
        })?;
        Ok(Self {
            folder,
            events,
            changes: VecDeque::new(),
            lost,
            lost_in_all: 0,
            done,
        })
    }

    fn keep(&mut self, event: &Event) -> Kept {
        match event {
            Event::State(_) => {
                self.changes.push_back(event.clone());
                // Beyond this nobody could follow them either.
                self.changes.truncate(WAITING_CHANGES);
                self.pass_on_changes()
            }
            Event::Samples(batch) => {
                if let Kept::Ended = self.pass_on_changes() {
                    return Kept::Ended;
                }
                self.keep_samples(batch)
            }
            _ => Kept::Yes,
        }
    }

    fn pass_on_changes(&mut self) -> Kept {
        while let Some(change) = self.changes.pop_front() {
            match self.events.try_send(change) {
                Ok(()) => {}
                Err(TrySendError::Full(change)) => {
                    self.changes.push_front(change);
                    return Kept::No;
                }
                Err(TrySendError::Disconnected(_)) => return Kept::Ended,
            }
        }
        Kept::Yes
    }

    fn keep_samples(&mut self, batch: &SamplesEvent) -> Kept {
        let mut batch = batch.clone();
        let missing_before = self.lost.swap(0, Ordering::AcqRel);
        batch.dropped = batch.dropped.saturating_add(missing_before);
        // Samples do not overtake the changes before them.
        let sent = if self.changes.is_empty() {
            self.events.try_send(Event::Samples(batch))
        } else {
            Err(TrySendError::Full(Event::Samples(batch)))
        };
        match sent {
            Ok(()) => Kept::Yes,
            Err(TrySendError::Full(Event::Samples(batch))) => {
                let missing = batch.dropped.saturating_add(batch.rows.len() as u64);
                self.lost_in_all = self.lost_in_all.saturating_add(missing.saturating_sub(missing_before));
                self.lost.store(missing, Ordering::Release);
                Kept::No
            }
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => Kept::Ended,
        }
    }
}

/// Writes what is heard until there is no more.
fn write(
    folder: &Path,
    mut metadata: Metadata,
    heard: &mpsc::Receiver<Event>,
    lost: &AtomicU64,
    news: &News,
) -> Result<RecordingNews, String> {
    let (path, file) = open_new(folder, "haptic-recording", "csv")?;
    let failed = |error: io::Error| format!("the recording ends here: cannot write {}: {error}", path.display());
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH);
    metadata.started_unix_s = since_1970.map_or(0.0, |time| time.as_secs_f64());
    let mut recorder = Recorder::new(file, &metadata).map_err(failed)?;
    let going = |recorder: &Recorder<File>| {
        let going = RecordingNews::Going {
            path: path.clone(),
            totals: recorder.totals(),
        };
        // A panel that is gone ends the recording by itself.
        news.tell(Update::Recording(going)).unwrap_or_default();
    };
    going(&recorder);
    for event in heard {
        recorder.event(&event).map_err(failed)?;
        going(&recorder);
    }
    let dropped = lost.load(Ordering::Acquire);
    if dropped > 0 {
        let (seq, rows) = (0, Vec::new());
        let gap = Event::Samples(SamplesEvent { seq, dropped, rows });
        recorder.event(&gap).map_err(failed)?;
    }
    let (_, totals) = recorder.finish().map_err(failed)?;
    Ok(RecordingNews::Ended { path, totals })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::fixture::metadata;
    use crate::scope::tape::tests::at;
    use haptic_ipc::Sample;

    fn batch(rows: Vec<Sample>) -> Event {
        let (seq, dropped) = (0, 0);
        Event::Samples(SamplesEvent { seq, dropped, rows })
    }

    /// Waits for the end of a recording.
    fn ended(told: &mpsc::Receiver<Update>) -> RecordingNews {
        loop {
            let update = told.recv_timeout(Duration::from_secs(30)).expect("news in time");
            if let Update::Recording(news @ (RecordingNews::Ended { .. } | RecordingNews::Failed { .. })) = update {
                return news;
            }
        }
    }

    #[test]
    fn what_is_heard_is_read_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let (news, told) = News::new(|_| {});
        let recordings = Recordings::new(news);
        recordings.begin(folder.path().to_path_buf(), metadata());
        let rows: Vec<_> = (0..50).map(|i| at(f64::from(i) * 1e-3)).collect();
        recordings.keep(&batch(rows.clone()));
        recordings.end();
        let RecordingNews::Ended { path, totals } = ended(&told) else {
            panic!("not ended");
        };
        let read = haptic_lab::recording::read(&path).expect("a recording");
        assert_eq!((read.rows, totals.rows), (rows, 50));
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let (news, told) = News::new(|_| {});
        let recordings = Recordings::new(news);
        recordings.begin("/nowhere/at/all".into(), metadata());
        let RecordingNews::Failed { why } = ended(&told) else {
            panic!("it failed");
        };
        assert!(why.contains("/nowhere/at/all"), "{why}");
    }

    // hazard: H4
    #[test]
    fn what_a_stalled_disk_does_not_take_is_counted_and_nobody_waits_for_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join("stalled");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.expect("mkfifo runs").success());
        let (news, told) = News::new(|_| {});
        let recordings = Recordings::new(news);
        // Nobody reads the pipe, so that the thread that writes stands in its opening.
        recordings.begin(pipe.clone(), metadata());
        let batches = 2 * WAITING_EVENTS;
        for number in 0..batches {
            let row = Sample {
                tick: number as u64,
                ..at(number as f64)
            };
            recordings.keep(&batch(vec![row]));
        }
        recordings.end();
        recordings.begin(folder.path().to_path_buf(), metadata());
        let RecordingNews::Failed { why } = ended(&told) else {
            panic!("a second recording does not wait for the first");
        };
        assert!(why.contains("still waits"), "{why}");
        // Now the disk goes on.
        let text = std::fs::read(&pipe).expect("it is written to its end");
        let read = haptic_lab::recording::Reader::new(text.as_slice()).expect("a recording");
        let read = read.into_recording().expect("a recording");
        let RecordingNews::Ended { totals, .. } = ended(&told) else {
            panic!("not ended");
        };
        assert_eq!(read.rows.len() as u64, totals.rows);
        assert_eq!(totals.rows + totals.lost, batches as u64);
        assert!(totals.lost >= (batches - WAITING_EVENTS - 2) as u64, "{totals:?}");
    }
}
