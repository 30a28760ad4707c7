//! The daemon at the other end of two channels.
//!
//! One thread connects, listens, and connects again for as long as the panel lives; another sends, so that a daemon that
//! does not read cannot freeze the window; a third writes what is recorded. None of them holds a lock while it reads, writes or waits.
//!
//! Stops have a path of their own (`stop_path`). They are sent here as well, ahead of whatever waits to be sent and behind what was written
//! before them: what the daemon has yet to read of this connection cannot bring the force back after a stop. One that was not answered is the
//! first thing said to the next daemon that answers.

mod asker;
mod follow;
mod listener;

use crate::news::News;

use crate::intent::Intent;
use crate::recording::Recordings;
use crate::stop_path::StopPath;
use crate::update::Update;
use asker::{Asker, Job};
use listener::Listener;
use std::collections::HashMap;
use std::io;
use std::path::PathBuf;
use std::sync::mpsc;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

/// How patient the connection is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// Wait between two attempts to connect.
    pub retry: Duration,
    /// After how long a silent daemon is given up. It reports on its timing every second, so silence is trouble.
    pub silence: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self {
            retry: Duration::from_millis(500),
            silence: Duration::from_secs(5),
        }
    }
}

/// A connection that mends itself.
#[derive(Debug)]
pub struct Connection {
    stop: StopPath,
    jobs: mpsc::Sender<Job>,
    recordings: Arc<Recordings>,
    updates: mpsc::Receiver<Update>,
}

impl Connection {
    /// Starts to connect to the socket that `locate` names, asked anew before each attempt: the daemon may be started later
    /// and elsewhere. `repaint` is called from other threads whenever there is news to draw, with how long it may wait: what
    /// comes in one after the other is drawn at once, 30 times a second at most.
    ///
    /// # Errors
    /// The system has no thread left.
    pub fn start(
        locate: impl Fn() -> PathBuf + Send + 'static,
        patience: Patience,
        repaint: impl Fn(Duration) + Send + Sync + 'static,
    ) -> io::Result<Self> {
        let (jobs, to_do) = mpsc::channel();
        let (news, updates) = News::new(repaint);
        let (stop, guide) = StopPath::start(patience.retry, news.clone())?;
        let shared = Arc::new(Shared::default());
        let recordings = Arc::new(Recordings::new(news.clone()));
        let listener = Listener::new(
            Arc::clone(&shared),
            Arc::clone(stop.stops()),
            Arc::clone(&recordings),
            jobs.clone(),
            guide,
            news,
            patience,
        );
        thread::Builder::new()
            .name("listen".to_owned())
            // The only way out is that nobody wants the news any more.
            .spawn(move || listener.run(&locate).unwrap_or(()))?;
        let asker = Asker::new(shared, Arc::clone(stop.stops()));
        thread::Builder::new()
            .name("ask".to_owned())
            .spawn(move || asker.run(&to_do))?;
        Ok(Self {
            stop,
            jobs,
            recordings,
            updates,
        })
    }

    /// Sends an intent. What comes of it is heard as [`Update::Answered`], or, when the connection is lost first, as
    /// [`Update::Disconnected`]; of a stop as [`Update::Stop`]. Waits for nothing.
    pub fn send(&self, intent: Intent) {
        match intent {
            Intent::Stop => self.stop(),
            Intent::Record { folder, metadata } => self.recordings.begin(folder, *metadata),
            Intent::EndRecording => self.recordings.end(),
            intent => {
                let stops = self.stop.stops().pressed();
                self.do_next(Job::Intent { intent, stops });
            }
        }
    }

    /// Sends a stop. Waits for nothing.
    pub fn stop(&self) {
        self.stop.press();
        self.do_next(Job::Stop);
    }

    fn do_next(&self, job: Job) {
        // The asking thread lives as long as `self`; were it gone, so would be the connection, which is told elsewhere.
        self.jobs.send(job).unwrap_or(());
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
        // The panel closes: a recording has a moment to be written to its end, and no more on a disk that stalls.
        self.recordings.close();
    }
}

/// What both threads use. Its locks are held for a few instructions, never while something is read, written or waited for.
#[derive(Debug, Default)]
struct Shared {
    /// What the answers to come belong to, by conversation and number.
    asked: Mutex<HashMap<(u64, u64), Asked>>,
    /// A stop was asked for since the last attempt to connect: the next is due at once.
    hurries: Mutex<bool>,
    hurry: Condvar,
}

#[derive(Debug)]
enum Asked {
    Intent(Intent),
    /// A stop by its number.
    Stop(u64),
    Describe,
    Subscribe,
    Advise,
    Scene,
    Library,
    Journal,
    Status,
}

impl Shared {
    fn asked(&self) -> MutexGuard<'_, HashMap<(u64, u64), Asked>> {
        // The map is whole between any two statements, so a panic elsewhere does not spoil it.
        self.asked.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes the next attempt to connect due.
    fn hurry_up(&self) {
        *self.hurries.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.hurry.notify_all();
    }

    /// Waits before the next attempt, but not when a stop is asked for meanwhile.
    fn pause(&self, time: Duration) {
        let hurries = self.hurries.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.hurry.wait_timeout_while(hurries, time, |hurries| !*hurries);
        let (mut hurries, _) = waited.unwrap_or_else(PoisonError::into_inner);
        *hurries = false;
    }
}
