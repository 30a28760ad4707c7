//! A few threads for work that may block on a disk or a device. Nothing waits for them longer than
//! a timeout, and the end of the daemon does not wait for them at all.
//!
//! The runtime's own threads cannot do such work, because the end of the runtime waits for them. A
//! thread that blocks on a dead mount stays blocked until the process ends, so their number is
//! limited.

use std::sync::Arc;
use std::time::Duration;
use thiserror::Error;
use tokio::sync::{Semaphore, oneshot};

/// Stack of each thread, bytes; all of it is locked in memory.
const STACK_BYTES: usize = 512 * 1024;

/// Why work has no result.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub(crate) enum WorkError {
    #[error("no answer for {} s", .limit.as_secs_f64())]
    TimedOut { limit: Duration },
    #[error("it failed: {0}")]
    Failed(String),
}

/// A pool of threads that may block.
#[derive(Debug)]
pub(crate) struct WorkerPool {
    name: &'static str,
    places: Arc<Semaphore>,
}

impl WorkerPool {
    /// A pool of at most `most_threads` threads of this name.
    pub(crate) fn new(name: &'static str, most_threads: usize) -> Self {
        Self {
            name,
            places: Arc::new(Semaphore::new(most_threads)),
        }
    }

    /// Whether all its threads are busy, so that further work would wait.
    pub(crate) fn is_busy(&self) -> bool {
        self.places.available_permits() == 0
    }

    /// Runs `work`, and waits at most `limit` for a thread and for the result. Work that has begun
    /// runs on after a timeout.
    ///
    /// # Errors
    /// The work takes longer than `limit` or panics, or the system has no thread left.
    pub(crate) async fn run<T: Send + 'static>(
        &self,
        limit: Duration,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, WorkError> {
        let failed = |why: &dyn std::fmt::Display| WorkError::Failed(why.to_string());
        let done = async {
            let place = Arc::clone(&self.places).acquire_owned().await;
            let place = place.map_err(|error| failed(&error))?;
            let (answer, answered) = oneshot::channel();
            std::thread::Builder::new()
                .name(self.name.to_owned())
                .stack_size(STACK_BYTES)
                .spawn(move || {
                    crate::thread_signals::block_signals();
                    let result = work();
                    drop(place);
                    // The waiting client may be gone.
                    drop(answer.send(result));
                })
                .map_err(|error| failed(&error))?;
            answered.await.map_err(|error| failed(&error))
        };
        tokio::time::timeout(limit, done)
            .await
            .map_err(|_| WorkError::TimedOut { limit })?
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
        let pool = WorkerPool::new("test", MAX_THREADS);
        let (let_go, held) = mpsc::channel::<()>();
        let held = Arc::new(std::sync::Mutex::new(held));
        let began = Instant::now();
        for _ in 0..MAX_THREADS + 2 {
            let held = Arc::clone(&held);
            let hangs = move || held.lock().map(|held| held.recv().is_ok()).unwrap_or_default();
            let refused = pool.run(BRIEF, hangs).await.expect_err("it hangs");
            assert_eq!(refused, WorkError::TimedOut { limit: BRIEF });
        }
        assert!(began.elapsed() < LONG, "{:?}", began.elapsed());
        assert_eq!(pool.places.available_permits(), 0);
        drop(let_go);
        assert_eq!(pool.run(LONG, || 7).await, Ok(7), "there are threads again");
    }

    #[tokio::test(flavor = "current_thread")]
    async fn work_that_panics_is_answered_and_gives_its_thread_back() {
        let pool = WorkerPool::new("test", MAX_THREADS);
        for _ in 0..2 * MAX_THREADS {
            let panics: Result<(), WorkError> = pool.run(LONG, || panic!("planted")).await;
            assert!(matches!(panics, Err(WorkError::Failed(_))), "{panics:?}");
        }
    }
}
