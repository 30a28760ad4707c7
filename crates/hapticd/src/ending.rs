//! The signals that end the daemon, and an overseer that makes sure that it ends.
//!
//! A thread waits for SIGINT, SIGTERM and SIGHUP, and passes them on to the control thread, which
//! releases the rig along its ramp and ends the loop. SIGHUP ends only a daemon with a terminal, which is gone then; to
//! a service it says that its configuration is to be read again. Meanwhile the overseer, a third thread,
//! waits: if the control thread does not react to the signal, or does not end in time, the overseer
//! ends the loop with zero force, and then the process. So a signal is obeyed even if the control
//! thread is blocked by a file, a descriptor or a lock.

use crate::log::{self, Level};
use nix::sys::signal::{SigSet, Signal};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;
use tokio::sync::watch;

/// The signals that are heard.
const SIGNALS: [Signal; 3] = [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP];

/// Time within which the control thread must react to a signal; otherwise it counts as hanging.
const REACTION_TIME: Duration = Duration::from_millis(600);

/// Time in which the loop sends its final zero force.
const FINAL_ZERO_TIME: Duration = Duration::from_millis(200);

/// Time that an orderly end may take beyond the ramp: the release, the end of the loop, and the
/// last lines of the log.
const LONGEST_END: Duration = Duration::from_millis(2500);

/// Stack of each thread, bytes; all of it is locked in memory.
const STACK_BYTES: usize = 128 * 1024;

/// Messages to the overseer.
#[derive(Clone, Copy, Debug)]
enum News {
    /// A signal has come.
    Asked,
    /// The control thread has begun to end the daemon.
    Begun,
}

/// The signals, blocked in this thread and in the threads that it starts.
#[derive(Debug)]
pub(crate) struct BlockedSignals {
    set: SigSet,
    /// Whether the process has a terminal, whose end SIGHUP tells.
    has_terminal: bool,
}

/// The signals that ask the daemon to end.
#[derive(Debug)]
pub(crate) struct StopSignals {
    heard: watch::Receiver<u64>,
    news: Sender<News>,
}

impl BlockedSignals {
    /// Blocks the signals. Must be called before any thread is started that does not block them.
    ///
    /// # Errors
    /// The system refuses.
    pub(crate) fn new() -> std::io::Result<Self> {
        let set = SigSet::from_iter(SIGNALS);
        set.thread_block()?;
        Ok(Self {
            set,
            has_terminal: std::fs::File::open("/dev/tty").is_ok(),
        })
    }

    /// Begins to wait for the signals. `end_loop` ends the loop with zero force, from any thread;
    /// the ramp of the release takes `ramp`. Returns those that ask for the end, and the count of those that ask for a
    /// reload.
    ///
    /// # Errors
    /// The system has no thread left.
    pub(crate) fn watch(
        self,
        ramp: Duration,
        end_loop: impl Fn() + Send + 'static,
    ) -> std::io::Result<(StopSignals, watch::Receiver<u64>)> {
        let (passed_on, heard) = watch::channel(0);
        let (reload, reloads) = watch::channel(0);
        let (news, to_oversee) = channel();
        thread("overseer", move || oversee(&to_oversee, ramp + LONGEST_END, end_loop))?;
        let first = news.clone();
        thread("signals", move || {
            loop {
                match self.set.wait() {
                    Ok(Signal::SIGHUP) if !self.has_terminal => {
                        reload.send_modify(|count| *count += 1);
                        continue;
                    }
                    Ok(_) => {}
                    // The wait can only be interrupted.
                    Err(_) => continue,
                }
                passed_on.send_modify(|count| *count += 1);
                // The overseer outlives this thread.
                first.send(News::Asked).unwrap_or_default();
            }
        })?;
        Ok((StopSignals { heard, news }, reloads))
    }
}

impl StopSignals {
    /// Waits for the next signal.
    pub(crate) async fn wait(&mut self) {
        if self.heard.changed().await.is_err() {
            std::future::pending::<()>().await;
        }
    }

    /// Tells the overseer that the daemon has begun to end, for whatever reason.
    pub(crate) fn begun(&self) {
        // The overseer lives as long as the process.
        self.news.send(News::Begun).unwrap_or_default();
    }
}

fn thread(name: &str, run: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    // The thread is never joined: it ends with the process.
    std::thread::Builder::new()
        .name(name.to_owned())
        .stack_size(STACK_BYTES)
        .spawn(run)
        .map(drop)
}

/// Waits for the end of the daemon, and enforces it if it does not come in time.
fn oversee(news: &Receiver<News>, longest_end: Duration, end_loop: impl Fn()) {
    let why = match overdue(news, longest_end) {
        Some(why) => why,
        None => return,
    };
    // The force first: nothing may delay it.
    end_loop();
    std::thread::sleep(FINAL_ZERO_TIME);
    log::say_at(Level::Error, why);
    log::flush(FINAL_ZERO_TIME);
    std::process::exit(1);
}

/// Waits until the end must be enforced; returns the reason.
fn overdue(news: &Receiver<News>, longest_end: Duration) -> Option<&'static str> {
    let reaction_time = match news.recv().ok()? {
        News::Asked => REACTION_TIME,
        News::Begun => Duration::ZERO,
    };
    if !reaction_time.is_zero() {
        let mut left = reaction_time;
        loop {
            let began = std::time::Instant::now();
            match news.recv_timeout(left) {
                Ok(News::Begun) => break,
                // The same signal once more.
                Ok(News::Asked) => left = left.saturating_sub(began.elapsed()),
                Err(RecvTimeoutError::Timeout) => {
                    return Some(
                        "the control thread hangs: the loop was ended without its ramp, and the daemon with it",
                    );
                }
                Err(RecvTimeoutError::Disconnected) => return None,
            }
        }
    }
    std::thread::sleep(longest_end);
    Some("the daemon did not come to an end in time: cut the power of the motor if it still pulls")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    #[test]
    fn an_end_that_is_ignored_or_takes_too_long_is_enforced() {
        let long = Duration::from_secs(3600);
        let (news, heard) = channel();
        news.send(News::Asked).expect("it is heard");
        news.send(News::Asked).expect("it is heard");
        let asked = Instant::now();
        let why = overdue(&heard, long).expect("the signal is ignored");
        assert!(why.contains("the control thread hangs"), "{why}");
        assert!(asked.elapsed() >= REACTION_TIME, "{:?}", asked.elapsed());

        for begun in [&[News::Asked, News::Begun][..], &[News::Begun]] {
            for told in begun {
                news.send(*told).expect("it is heard");
            }
            let why = overdue(&heard, Duration::from_millis(1)).expect("it does not end");
            assert!(why.contains("did not come to an end"), "{why}");
        }
    }
}
