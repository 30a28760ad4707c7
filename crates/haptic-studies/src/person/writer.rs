//! The thread that keeps what becomes final: only it waits for the disk.

use super::super::session::{News, Row};
use super::super::store::{Keeper, StoreError, Study};
use std::io;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

/// What the thread does.
enum Job {
    Keep(News),
    Collect,
}

/// What a job of the thread came to.
pub(super) enum Outcome {
    /// This is on the disk; of a trial, its row as it stands there.
    News(Option<Row>),
    /// All trials of the study are in one file.
    Collected,
}

/// The thread; it ends with this, after what it was given.
pub(super) struct WriterThread {
    jobs: Sender<Job>,
    outcomes: Receiver<Result<Outcome, StoreError>>,
    thread: JoinHandle<()>,
}

impl WriterThread {
    /// Starts it. It holds the study, and with it the lock.
    pub(super) fn spawn(study: Study, mut keeper: Keeper) -> io::Result<Self> {
        let (jobs, work) = channel();
        let (done, outcomes) = channel();
        let thread = thread::Builder::new().name("study files".to_owned()).spawn(move || {
            for job in work {
                let result = match job {
                    Job::Keep(news) => keeper.keep(news).map(Outcome::News),
                    Job::Collect => study.collect().map(|_| Outcome::Collected),
                };
                let failed = result.is_err();
                // Nobody may be left to hear of it; what was given is kept all the same.
                done.send(result).unwrap_or_default();
                if failed {
                    return;
                }
            }
        })?;
        Ok(Self { jobs, outcomes, thread })
    }

    /// Ends it, and waits until it has let the study go.
    pub(super) fn join(self) {
        let Self { jobs, thread, .. } = self;
        drop(jobs);
        // A panic of the thread has printed its message.
        thread.join().unwrap_or_default();
    }

    pub(super) fn keep(&self, news: News) {
        // A thread that failed has reported it.
        self.jobs.send(Job::Keep(news)).unwrap_or_default();
    }

    pub(super) fn collect(&self) {
        self.jobs.send(Job::Collect).unwrap_or_default();
    }

    /// What was done since, without waiting; `None` where nothing was.
    pub(super) fn take(&self) -> Option<Result<Outcome, StoreError>> {
        self.outcomes.try_recv().ok()
    }

    /// The same, waiting for what was given last.
    pub(super) fn wait(&self) -> Option<Result<Outcome, StoreError>> {
        self.outcomes.recv().ok()
    }
}

impl std::fmt::Debug for WriterThread {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("WriterThread").finish_non_exhaustive()
    }
}
