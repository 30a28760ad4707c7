//! How the daemon is told to end, and what makes sure that it does.
//!
//! SIGINT, SIGTERM and SIGHUP are taken by a thread of their own, which passes them on to the
//! control thread. That one lets the force down along its ramp and ends the loop. A third thread
//! waits meanwhile: where the control thread does not take the signal up, or does not come to an
//! end, it ends the loop itself, whose last word is zero force, and then the process. So no file,
//! no descriptor and no lock on which the control thread may stand keeps a signal from being heard.

use crate::log::{self, Level};
use nix::sys::signal::{SigSet, Signal};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;
use tokio::sync::watch;

/// What asks the daemon to end.
const SIGNALS: [Signal; 3] = [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP];

/// How soon the control thread has to take a signal up; else it counts as hanging.
const TAKE_UP: Duration = Duration::from_millis(600);

/// What the loop needs for its last word.
const LAST_WORD: Duration = Duration::from_millis(200);

/// What the end may take beyond the ramp, once it is begun: the release, the end of the loop, and
/// what is left to be said.
const LONGEST_END: Duration = Duration::from_millis(2500);

/// Stack of either thread, bytes; all of it is locked in memory.
const STACK_BYTES: usize = 128 * 1024;

/// What the overseer hears.
#[derive(Clone, Copy, Debug)]
enum News {
    /// A signal has come.
    Asked,
    /// The control thread ends the daemon.
    Begun,
}

/// The signals, blocked in this thread and in those that it starts from now on, and taken by nobody yet.
#[derive(Debug)]
pub(crate) struct BlockedSignals(SigSet);

/// The signals that ask the daemon to end.
#[derive(Debug)]
pub(crate) struct StopSignals {
    heard: watch::Receiver<u64>,
    news: Sender<News>,
}

impl BlockedSignals {
    /// Blocks them. Before any thread is started that does not block them itself.
    ///
    /// # Errors
    /// The system refuses.
    pub(crate) fn new() -> std::io::Result<Self> {
        let set = SigSet::from_iter(SIGNALS);
        set.thread_block()?;
        Ok(Self(set))
    }

    /// Has them taken from now on. `end_loop` ends the loop with zero force, from any thread; the
    /// ramp at the end takes `ramp`.
    ///
    /// # Errors
    /// The system has no thread left.
    pub(crate) fn watch(self, ramp: Duration, end_loop: impl Fn() + Send + 'static) -> std::io::Result<StopSignals> {
        let (passed_on, heard) = watch::channel(0);
        let (news, to_oversee) = channel();
        thread("overseer", move || oversee(&to_oversee, ramp + LONGEST_END, end_loop))?;
        let first = news.clone();
        thread("signals", move || {
            loop {
                if self.0.wait().is_err() {
                    // It is only ever interrupted.
                    continue;
                }
                passed_on.send_modify(|count| *count += 1);
                // The overseer outlives this thread.
                first.send(News::Asked).unwrap_or_default();
            }
        })?;
        Ok(StopSignals { heard, news })
    }
}

impl StopSignals {
    /// Waits for the next signal.
    pub(crate) async fn wait(&mut self) {
        if self.heard.changed().await.is_err() {
            std::future::pending::<()>().await;
        }
    }

    /// Says that the daemon ends from now on, whatever the reason.
    pub(crate) fn begun(&self) {
        // The overseer lives as long as the process.
        self.news.send(News::Begun).unwrap_or_default();
    }
}

fn thread(name: &str, run: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    // Never joined: it ends with the process.
    std::thread::Builder::new()
        .name(name.to_owned())
        .stack_size(STACK_BYTES)
        .spawn(run)
        .map(drop)
}

/// Waits for the end, and brings it about where it does not come by itself.
fn oversee(news: &Receiver<News>, longest_end: Duration, end_loop: impl Fn()) {
    let why = match overdue(news, longest_end) {
        Some(why) => why,
        None => return,
    };
    // The force first; nothing before it may wait.
    end_loop();
    std::thread::sleep(LAST_WORD);
    log::say_at(Level::Error, why);
    log::flush(LAST_WORD);
    std::process::exit(1);
}

/// Why the end has to be brought about, as soon as it has.
fn overdue(news: &Receiver<News>, longest_end: Duration) -> Option<&'static str> {
    let take_up = match news.recv().ok()? {
        News::Asked => TAKE_UP,
        News::Begun => Duration::ZERO,
    };
    if !take_up.is_zero() {
        let mut left = take_up;
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
    fn an_end_that_is_not_taken_up_or_does_not_come_is_brought_about() {
        let long = Duration::from_secs(3600);
        let (news, heard) = channel();
        news.send(News::Asked).expect("it is heard");
        news.send(News::Asked).expect("it is heard");
        let asked = Instant::now();
        let why = overdue(&heard, long).expect("nobody takes it up");
        assert!(why.contains("the control thread hangs"), "{why}");
        assert!(asked.elapsed() >= TAKE_UP, "{:?}", asked.elapsed());

        for begun in [&[News::Asked, News::Begun][..], &[News::Begun]] {
            for told in begun {
                news.send(*told).expect("it is heard");
            }
            let why = overdue(&heard, Duration::from_millis(1)).expect("it does not end");
            assert!(why.contains("did not come to an end"), "{why}");
        }
    }
}
