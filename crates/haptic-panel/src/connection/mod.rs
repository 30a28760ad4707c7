//! The connection to the daemon, behind two channels.
//!
//! One thread connects, listens, and reconnects while the panel lives. Another sends, so that a daemon
//! that does not read cannot freeze the window. A third writes recordings. None of them holds a lock
//! while it reads, writes or waits.
//!
//! Stops have a path of their own (`stop_path`). They are sent here as well, ahead of the requests that
//! wait, and behind those that were written: a request that the daemon has yet to read cannot bring
//! the force back after a stop. An unanswered stop is the first request to the next daemon.

mod asker;
mod listener;
mod shared;
mod silence;

pub use shared::Patience;

use crate::intent::Intent;
use crate::record::Recorder;
use crate::stop::StopPath;
use crate::study::{StudyLink, SubjectScreen};
use crate::update::Update;
use crate::update_sender::UpdateSender;
use asker::{Asker, Job};
use listener::Listener;
use shared::Shared;
use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use std::time::Duration;
use std::{io, thread};

/// A connection that reconnects by itself.
#[derive(Debug)]
pub struct Connection {
    outgoing: Arc<Outgoing>,
    shared: Arc<Shared>,
    recorder: Arc<Recorder>,
    study: Arc<StudyLink>,
    updates: mpsc::Receiver<Update>,
    sender: UpdateSender,
}

/// The channels to the daemon.
#[derive(Debug)]
struct Outgoing {
    stop: StopPath,
    jobs: mpsc::Sender<Job>,
}

impl Outgoing {
    /// Sends a stop on its own path, and on the connection of all requests.
    fn stop(&self) {
        self.stop.press();
        self.do_next(Job::Stop);
    }

    fn do_next(&self, job: Job) {
        // The asking thread lives as long as `self`.
        self.jobs.send(job).unwrap_or(());
    }
}

impl Connection {
    /// Connects to the socket that `locate` names, until [`Intent::ConnectTo`] names another. It is called before each attempt: the daemon may be
    /// started later and elsewhere. Other threads call `repaint` when there is news to draw, with the
    /// time until the frame is due.
    ///
    /// # Errors
    /// The system has no thread left.
    pub fn start(
        locate: impl Fn() -> PathBuf + Send + 'static,
        patience: Patience,
        repaint: impl Fn(Duration) + Send + Sync + 'static,
    ) -> io::Result<Self> {
        let (jobs, to_do) = mpsc::channel();
        let (sender, updates) = UpdateSender::new(repaint);
        let (stop, guide) = StopPath::start(patience.retry, sender.clone())?;
        let shared = Arc::new(Shared::default());
        let recorder = Arc::new(Recorder::new(sender.clone()));
        let study = {
            let (jobs, stops) = (jobs.clone(), Arc::clone(stop.stops()));
            let send = move |intent| {
                let stops = stops.pressed();
                // The asking thread lives as long as the panel.
                jobs.send(Job::Intent { intent, stops }).unwrap_or(());
            };
            Arc::new(StudyLink::new(Arc::new(send), sender.clone()))
        };
        let listener = Listener::new(
            Arc::clone(&shared),
            Arc::clone(stop.stops()),
            (Arc::clone(&recorder), Arc::clone(&study)),
            jobs.clone(),
            guide,
            sender.clone(),
            patience,
        );
        thread::Builder::new()
            .name("listen".to_owned())
            // It ends only when the panel is closed.
            .spawn(move || listener.run(&locate).unwrap_or(()))?;
        let asker = Asker::new(Arc::clone(&shared), Arc::clone(stop.stops()));
        thread::Builder::new()
            .name("ask".to_owned())
            .spawn(move || asker.run(&to_do))?;
        Ok(Self {
            outgoing: Arc::new(Outgoing { stop, jobs }),
            shared,
            recorder,
            study,
            updates,
            sender,
        })
    }

    /// Sends an intent. Its outcome is [`Update::Answered`], or [`Update::Disconnected`] if the connection
    /// is lost first; that of a stop is [`Update::Stop`]. Waits for nothing.
    pub fn send(&self, intent: Intent) {
        match intent {
            Intent::Stop => self.stop(),
            Intent::Record {
                folder,
                format,
                metadata,
            } => {
                self.recorder.begin(folder, format, *metadata);
                self.recorder.begin_at_snapshot();
                self.outgoing.do_next(Job::SubscribeAnew);
            }
            Intent::Marker { tick, text } => self.recorder.mark(tick, text),
            Intent::EndRecording => self.recorder.end(),
            Intent::ConnectTo { path } => self.shared.choose(path),
            Intent::Study(command) => self.study.command(command),
            intent => {
                let stops = self.outgoing.stop.stops().pressed();
                self.outgoing.do_next(Job::Intent { intent, stops });
            }
        }
    }

    /// Sets the time between two frames that show samples, timing and status; at least that of 30 frames a second,
    /// with which everything else is drawn.
    pub fn set_pace(&self, pace: Duration) {
        self.sender.set_pace(pace);
    }

    /// Number of stops that were pressed.
    #[must_use]
    pub fn stops_pressed(&self) -> u64 {
        self.outgoing.stop.stops().pressed()
    }

    /// This panel has started a fake rig, as a process with this number, after that many stops: those that still wait
    /// are not for it. `None`: it has ended.
    pub fn set_own_rig(&self, rig: Option<(u32, u64)>) {
        self.outgoing.stop.stops().set_own_rig(rig);
    }

    /// What the subject's window shows.
    pub(crate) fn subject_screen(&self) -> Arc<SubjectScreen> {
        Arc::clone(self.study.screen())
    }

    /// Sends a stop. Waits for nothing.
    pub fn stop(&self) {
        self.outgoing.stop();
    }

    /// A stop for any thread: each call sends one, and returns false once the panel is closed. Waits for nothing.
    pub fn stopper(&self) -> impl Fn() -> bool + Send + use<> {
        let outgoing = Arc::downgrade(&self.outgoing);
        move || outgoing.upgrade().inspect(|outgoing| outgoing.stop()).is_some()
    }

    /// The news since last time, without waiting.
    pub fn updates(&self) -> impl Iterator<Item = Update> + '_ {
        self.updates.try_iter()
    }

    /// The next piece of news, waiting for it at most `limit`.
    #[must_use]
    pub fn wait(&self, limit: Duration) -> Option<Update> {
        self.updates.recv_timeout(limit).ok()
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        // A recording has a moment to be written to its end; a stalled disk gets no more.
        self.recorder.close();
    }
}
