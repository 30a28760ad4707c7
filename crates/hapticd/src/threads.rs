//! Threads that may block on a disk, a device, a descriptor or a user directory. Nothing waits for them longer than a
//! timeout, and the end of the daemon does not wait for them at all.
//!
//! They are not the runtime's own: its `spawn_blocking` panics where the system has no thread left, and here that is an
//! error like any other. A thread that blocks on a dead mount stays blocked until the process ends, so each kind of
//! work has a limited number.

use nix::sys::signal::{SigSet, Signal};
use std::sync::Arc;
use std::thread::Thread;
use std::time::Duration;
use thiserror::Error;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};

/// Signals that a thread's own fault raises. Blocked, they would end the process without a word.
const RAISED_BY_A_FAULT: [Signal; 7] = [
    Signal::SIGSEGV,
    Signal::SIGBUS,
    Signal::SIGFPE,
    Signal::SIGILL,
    Signal::SIGTRAP,
    Signal::SIGSYS,
    Signal::SIGABRT,
];

/// Blocks all signals in the calling thread but those that its own fault raises.
///
/// A signal to the process is for another thread: no handler runs in a tick. And a write itself can raise a signal that
/// would stop or kill the whole process with its loop: SIGTTOU in the background of a terminal, SIGXFSZ at the
/// limit of a file's size. With the signal blocked the write succeeds or fails.
pub(crate) fn block_signals() {
    let mut blocked = SigSet::all();
    for signal in RAISED_BY_A_FAULT {
        blocked.remove(signal);
    }
    // After a failure they stay as they were.
    blocked.thread_set_mask().unwrap_or_default();
}

/// Starts a thread without signals, which is never joined: it may be blocked for ever, and ends with the process. All
/// of its stack is locked in memory.
///
/// # Errors
/// The system has no thread left.
pub(crate) fn start(name: &str, stack_bytes: usize, run: impl FnOnce() + Send + 'static) -> std::io::Result<Thread> {
    let started = std::thread::Builder::new()
        .name(name.to_owned())
        .stack_size(stack_bytes)
        .spawn(move || {
            block_signals();
            run();
        })?;
    Ok(started.thread().clone())
}

/// Stack of each worker, bytes.
const STACK_BYTES: usize = 512 * 1024;

/// Why work has no result.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub(crate) enum WorkError {
    #[error("no answer for {} s", .limit.as_secs_f64())]
    TimedOut { limit: Duration },
    #[error("it failed: {0}")]
    Failed(String),
}

impl WorkError {
    fn failed(why: impl std::fmt::Display) -> Self {
        Self::Failed(why.to_string())
    }
}

/// Workers of one kind, a thread for each work: as many at a time as have a place.
#[derive(Debug)]
pub(crate) struct Workers {
    name: &'static str,
    places: Arc<Semaphore>,
}

impl Workers {
    /// At most `max_threads` workers of this name.
    pub(crate) fn new(name: &'static str, max_threads: usize) -> Self {
        Self {
            name,
            places: Arc::new(Semaphore::new(max_threads)),
        }
    }

    /// Whether all of them are busy, so that further work would wait.
    pub(crate) fn is_busy(&self) -> bool {
        self.places.available_permits() == 0
    }

    /// Begins `work`, whose result nobody waits for, unless all workers are busy or the system has no thread left;
    /// returns whether it did.
    pub(crate) fn begin(&self, work: impl FnOnce() + Send + 'static) -> bool {
        let place = Arc::clone(&self.places).try_acquire_owned();
        place.is_ok_and(|place| self.start(place, work).is_ok())
    }

    /// Runs `work`, and waits at most `limit` for a worker and for the result. Work that has begun runs on after a
    /// timeout.
    ///
    /// # Errors
    /// The work takes longer than `limit` or panics, or the system has no thread left.
    pub(crate) async fn run<T: Send + 'static>(
        &self,
        limit: Duration,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, WorkError> {
        let done = async {
            let place = Arc::clone(&self.places).acquire_owned().await;
            let answered = self.start(place.map_err(WorkError::failed)?, work)?;
            answered.await.map_err(WorkError::failed)
        };
        tokio::time::timeout(limit, done)
            .await
            .map_err(|_| WorkError::TimedOut { limit })?
    }

    fn start<T: Send + 'static>(
        &self,
        place: OwnedSemaphorePermit,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<oneshot::Receiver<T>, WorkError> {
        let (answer, answered) = oneshot::channel();
        let run = move || {
            let result = work();
            drop(place);
            // The waiting client may be gone.
            drop(answer.send(result));
        };
        start(self.name, STACK_BYTES, run).map_err(WorkError::failed)?;
        Ok(answered)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;
    use std::time::Instant;

    const BRIEF: Duration = Duration::from_millis(20);
    const LONG: Duration = Duration::from_secs(30);
    const MAX_THREADS: usize = 4;

    // hazard: H14
    #[tokio::test(flavor = "current_thread")]
    async fn hanging_work_times_out_and_takes_limited_threads() {
        let workers = Workers::new("test", MAX_THREADS);
        let (let_go, held) = mpsc::channel::<()>();
        let held = Arc::new(std::sync::Mutex::new(held));
        let began = Instant::now();
        for _ in 0..MAX_THREADS + 2 {
            let held = Arc::clone(&held);
            let hangs = move || held.lock().map(|held| held.recv().is_ok()).unwrap_or_default();
            let refused = workers.run(BRIEF, hangs).await.expect_err("it hangs");
            assert_eq!(refused, WorkError::TimedOut { limit: BRIEF });
        }
        assert!(began.elapsed() < LONG, "{:?}", began.elapsed());
        assert!(workers.is_busy() && !workers.begin(|| ()));
        drop(let_go);
        assert_eq!(workers.run(LONG, || 7).await, Ok(7), "there are threads again");
    }

    #[tokio::test(flavor = "current_thread")]
    async fn work_that_panics_is_answered_and_gives_its_thread_back() {
        let workers = Workers::new("test", MAX_THREADS);
        for _ in 0..2 * MAX_THREADS {
            let panics: Result<(), WorkError> = workers.run(LONG, || panic!("planted")).await;
            assert!(matches!(panics, Err(WorkError::Failed(_))), "{panics:?}");
        }
    }
}
