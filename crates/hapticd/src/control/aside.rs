//! Work that may wait for a disk or a device: on threads of their own, for a limited time, and
//! never waited for at the end of the daemon.
//!
//! Not on the runtime's threads: the end of the runtime would wait for those. A thread that stands
//! on a mount that does not answer stays there until the process ends, so there are only a few of
//! them.

use std::sync::Arc;
use std::time::Duration;
use thiserror::Error;
use tokio::sync::{Semaphore, oneshot};

/// Stack of each, bytes; all of it is locked in memory.
const STACK_BYTES: usize = 512 * 1024;

/// Why there is no result.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub(super) enum AsideError {
    #[error("it has not answered for {} s", .limit.as_secs_f64())]
    TimedOut { limit: Duration },
    #[error("the work could not be done: {0}")]
    Failed(String),
}

/// Where such work is done.
#[derive(Debug)]
pub(crate) struct Aside {
    name: &'static str,
    places: Arc<Semaphore>,
}

impl Aside {
    /// So many threads at once, with a name.
    pub(super) fn new(name: &'static str, most_threads: usize) -> Self {
        Self {
            name,
            places: Arc::new(Semaphore::new(most_threads)),
        }
    }

    /// Whether all its threads are at work, so that more would have to wait.
    pub(super) fn is_busy(&self) -> bool {
        self.places.available_permits() == 0
    }

    /// Does some work, and waits so long for a thread and for the result. What was begun may still
    /// be done after that.
    ///
    /// # Errors
    /// It takes longer, or has panicked, or the system has no thread left.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        limit: Duration,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, AsideError> {
        let failed = |why: &dyn std::fmt::Display| AsideError::Failed(why.to_string());
        let done = async {
            let place = Arc::clone(&self.places).acquire_owned().await;
            let place = place.map_err(|error| failed(&error))?;
            let (answer, answered) = oneshot::channel();
            std::thread::Builder::new()
                .name(self.name.to_owned())
                .stack_size(STACK_BYTES)
                .spawn(move || {
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
            .map_err(|_| AsideError::TimedOut { limit })?
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;
    use std::time::Instant;

    const BRIEF: Duration = Duration::from_millis(20);
    const LONG: Duration = Duration::from_secs(30);
    const MOST_THREADS: usize = 4;

    // hazard: H14
    #[tokio::test(flavor = "current_thread")]
    async fn work_that_hangs_is_not_waited_for_and_takes_only_so_many_threads() {
        let aside = Aside::new("test", MOST_THREADS);
        let (let_go, held) = mpsc::channel::<()>();
        let held = Arc::new(std::sync::Mutex::new(held));
        let began = Instant::now();
        for _ in 0..MOST_THREADS + 2 {
            let held = Arc::clone(&held);
            let hangs = move || held.lock().map(|held| held.recv().is_ok()).unwrap_or_default();
            let refused = aside.run(BRIEF, hangs).await.expect_err("it hangs");
            assert_eq!(refused, AsideError::TimedOut { limit: BRIEF });
        }
        assert!(began.elapsed() < LONG, "{:?}", began.elapsed());
        assert_eq!(aside.places.available_permits(), 0);
        drop(let_go);
        assert_eq!(aside.run(LONG, || 7).await, Ok(7), "there are threads again");
    }

    #[tokio::test(flavor = "current_thread")]
    async fn work_that_panics_is_answered_and_gives_its_thread_back() {
        let aside = Aside::new("test", MOST_THREADS);
        for _ in 0..2 * MOST_THREADS {
            let panics: Result<(), AsideError> = aside.run(LONG, || panic!("planted")).await;
            assert!(matches!(panics, Err(AsideError::Failed(_))), "{panics:?}");
        }
    }
}
