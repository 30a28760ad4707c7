//! A recording from its subscription on: its circumstances, and the thread that writes it, for a program that waits for
//! several things at once.

use crate::daemon::Daemon;
use crate::failure::Failure;
use haptic_ipc::{ClientError, Event, Request, SceneReply, Status, SubscribeReply};
use haptic_recording::{CreateError, Format, Mark, Metadata, Recorder, RecordingThread, Totals, recorded_by};
use serde::Deserialize;
use std::fs::File;
use std::io;
use std::os::fd::AsFd;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};
use tokio::sync::oneshot::error::TryRecvError;
use tokio::sync::{oneshot, watch};

/// Subscribes, and asks for all that a recording's metadata hold.
pub(crate) async fn subscribe(
    daemon: &mut Daemon,
    subscription: Request,
    notes: Option<String>,
) -> Result<(Status, Metadata), Failure> {
    // Kept as it was sent: a later daemon may send more than this program knows of.
    let configuration: serde_json::Value = daemon.ask(Request::Status {}).await?;
    let status = Status::deserialize(&configuration).map_err(ClientError::BadAnswer)?;
    let subscribed: SubscribeReply = daemon.ask(subscription).await?;
    // Asked after subscribing: a change in between is reported again, and not missed.
    let scene: SceneReply = daemon.ask(Request::get()).await?;
    let metadata = Metadata {
        server: daemon.hello().server.clone(),
        device: status.device.description.clone(),
        axes: subscribed.axes(),
        loop_rate_hz: status.rate_hz,
        rate_hz: subscribed.rate_hz,
        recorded_by: Some(recorded_by(concat!("haptic-ctl ", env!("CARGO_PKG_VERSION")))),
        started_unix_s: SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default()
            .as_secs_f64(),
        revision: scene.revision,
        scene: scene.scene,
        servo: subscribed.servo,
        notes,
        configuration: Some(configuration),
    };
    Ok((status, metadata))
}

/// A recording under way. Only [`finish`](Self::finish) and [`break_off`](Self::break_off) wait for the disk.
pub(crate) struct RecordingUnderWay {
    thread: RecordingThread,
    first_s: Option<f64>,
    totals: watch::Receiver<Totals>,
    ended: oneshot::Receiver<io::Result<Totals>>,
}

impl RecordingUnderWay {
    /// Creates a recording; the ending of its name says its format.
    pub(crate) fn create(path: &Path, metadata: &Metadata, replace: bool) -> Result<Self, Failure> {
        Self::begin(haptic_recording::create(path, metadata, replace).map_err(|error| not_created(&error))?)
    }

    /// Begins a recording on standard output.
    pub(crate) fn to_standard_output(format: Format, metadata: &Metadata) -> Result<Self, Failure> {
        let file = File::from(io::stdout().as_fd().try_clone_to_owned()?);
        Self::begin(Recorder::new(format, file, Path::new("-"), metadata)?)
    }

    fn begin(recorder: Recorder) -> Result<Self, Failure> {
        let (sum, totals) = watch::channel(recorder.totals());
        let (end, ended) = oneshot::channel();
        let thread = RecordingThread::spawn(move |waiting| {
            let written = waiting.write(recorder, |totals| {
                sum.send_replace(totals);
            });
            // Nobody may wait for its end any more.
            end.send(written).unwrap_or_default();
        })?;
        Ok(Self {
            thread,
            first_s: None,
            totals,
            ended,
        })
    }

    pub(crate) fn event(&mut self, event: &Event) {
        if let Event::Samples(samples) = event {
            self.first_s = self.first_s.or(samples.rows.first().map(|row| row.t_s));
        }
        // What is lost stands in the recording and in its totals; an end is reported by `check`.
        self.thread.event(event);
    }

    pub(crate) fn mark(&self, mark: Mark) {
        self.thread.mark(mark);
    }

    /// Has what is in memory passed on to the file, for when no events come.
    pub(crate) fn flush(&self) {
        self.thread.flush();
    }

    /// Time of the first row, s, once there is one.
    pub(crate) fn first_s(&self) -> Option<f64> {
        self.first_s
    }

    /// How much is written by now.
    pub(crate) fn totals(&self) -> Totals {
        *self.totals.borrow()
    }

    /// Whether it can still be written; after an error nothing more is reported of it.
    pub(crate) fn check(&mut self) -> io::Result<()> {
        match self.ended.try_recv() {
            Err(TryRecvError::Empty) => Ok(()),
            Ok(Err(error)) => Err(error),
            Ok(Ok(_)) | Err(TryRecvError::Closed) => Err(gone()),
        }
    }

    /// Ends the recording, and waits until it is on the disk.
    pub(crate) async fn finish(self) -> io::Result<Totals> {
        self.thread.finish();
        self.ended.await.unwrap_or_else(|_| Err(gone()))
    }

    /// Closes the recording without an end.
    pub(crate) async fn break_off(self) -> io::Result<Totals> {
        drop(self.thread);
        self.ended.await.unwrap_or_else(|_| Err(gone()))
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
