//! The signals that end the daemon, and an overseer that makes sure that it ends.
//!
//! A thread waits for every signal that would end the process, whoever has sent it by whatever mistake, and passes it
//! on to the control thread, which releases the rig along its ramp and ends the loop. SIGKILL cannot be caught, and
//! those that a thread's own fault raises are no wish to end in order: the device's watchdog answers them. SIGHUP ends
//! only a daemon with a terminal, which is gone then; to a service it asks to read its configuration again. Meanwhile
//! the overseer, a third thread, waits: if the control thread does not react to the signal, or does not end in time,
//! the overseer ends the loop with zero force, and then the process. So a signal is obeyed even if the control
//! thread is blocked by a file, a descriptor or a lock.
//!
//! A thread that hangs may hold any lock, that of a channel, of the log or of the allocator. So the path from a
//! signal to the end of the loop has none: it is a word, a wake-up and a byte on a socket that never blocks. What
//! comes after, the last line of the log, may wait for one: the kernel's alarm then ends the process.

use crate::log::{self, Level};
use nix::sys::signal::{self, SigHandler, SigSet, Signal};
use nix::unistd::{Pid, alarm};
use std::io::{ErrorKind, Write as _};
use std::os::unix::net::UnixStream as Socket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};
use tokio::net::UnixStream;

/// The signals that are waited for, beside those of real time, which have no names.
const SIGNALS: [Signal; 14] = [
    Signal::SIGHUP,
    Signal::SIGINT,
    Signal::SIGQUIT,
    Signal::SIGUSR1,
    Signal::SIGUSR2,
    Signal::SIGALRM,
    Signal::SIGTERM,
    Signal::SIGSTKFLT,
    Signal::SIGXCPU,
    Signal::SIGXFSZ,
    Signal::SIGVTALRM,
    Signal::SIGPROF,
    Signal::SIGIO,
    Signal::SIGPWR,
];

/// Time within which the control thread must react to a signal; otherwise it counts as hanging. A machine may be so
/// busy that an ordinary thread does not run for most of a second; the loop has let the force down by itself then.
const REACTION_TIME: Duration = Duration::from_millis(2000);

/// Time in which the loop sends its final zero force.
const FINAL_ZERO_TIME: Duration = Duration::from_millis(200);

/// Time that an orderly end may take beyond the ramp: the release, the end of the loop, and the
/// last lines of the log.
const MAX_END: Duration = Duration::from_millis(2500);

/// Stack of each thread, bytes; all of it is locked in memory.
const STACK_BYTES: usize = 128 * 1024;

/// Time in which an enforced end may say why, s; then the kernel ends the process by SIGALRM.
const LAST_WORDS_S: u32 = 1;

/// How far the end is.
#[derive(Debug, Default)]
struct Progress {
    /// A signal has come.
    asked: AtomicBool,
    /// The control thread has begun to end the daemon.
    begun: AtomicBool,
    /// The overseer ends the process.
    enforced: AtomicBool,
}

/// Notifies the overseer. Waits for nothing.
#[derive(Clone, Debug)]
struct OverseerHandle {
    progress: Arc<Progress>,
    overseer: Thread,
}

impl OverseerHandle {
    fn notify(&self, of: impl Fn(&Progress) -> &AtomicBool) {
        of(&self.progress).store(true, Ordering::Release);
        self.overseer.unpark();
    }
}

/// The control thread's end of a wake-up by a signal.
#[derive(Debug)]
pub(crate) struct SignalWakeup(UnixStream);

impl SignalWakeup {
    /// A wake-up from any thread; called on the control thread.
    fn new() -> std::io::Result<(Socket, Self)> {
        let (waker, woken) = Socket::pair()?;
        waker.set_nonblocking(true)?;
        woken.set_nonblocking(true)?;
        Ok((waker, Self(UnixStream::from_std(woken)?)))
    }

    /// Waits until there was another wake-up, or several. There is none any more if this fails.
    pub(crate) async fn next(&self) -> std::io::Result<()> {
        let mut bytes = [0; 64];
        loop {
            self.0.readable().await?;
            match self.0.try_read(&mut bytes) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                // As many as fit: more are another wake-up.
                Ok(_) => return Ok(()),
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) => return Err(error),
            }
        }
    }
}

/// Wakes the other end.
fn wake(mut waker: &Socket) {
    // It does not block. Without room, a wake-up is pending already.
    drop(waker.write(&[0]));
}

/// A set of signals, with those of real time.
#[derive(Clone, Copy)]
struct SignalSet(libc::sigset_t);

#[allow(unsafe_code, reason = "nix knows no signal of real time")]
impl SignalSet {
    /// Those that are waited for.
    fn watched() -> Self {
        // SAFETY: a set is plain bits, which the first call fills in; the others change bits of it.
        unsafe {
            let mut set: libc::sigset_t = std::mem::zeroed();
            libc::sigemptyset(&raw mut set);
            for number in SIGNALS
                .map(|signal| signal as libc::c_int)
                .into_iter()
                .chain(libc::SIGRTMIN()..=libc::SIGRTMAX())
            {
                libc::sigaddset(&raw mut set, number);
            }
            Self(set)
        }
    }

    /// Blocks them in this thread, and in those that it starts.
    fn block(&self) -> std::io::Result<()> {
        // SAFETY: reads a set of this value.
        match unsafe { libc::pthread_sigmask(libc::SIG_BLOCK, &raw const self.0, std::ptr::null_mut()) } {
            0 => Ok(()),
            error => Err(std::io::Error::from_raw_os_error(error)),
        }
    }

    /// Waits for one; nothing where the wait was interrupted.
    fn wait(&self) -> Option<libc::c_int> {
        let mut number = 0;
        // SAFETY: reads a set of this value, and writes a number of this frame.
        (unsafe { libc::sigwait(&raw const self.0, &raw mut number) } == 0).then_some(number)
    }
}

/// From now on an alarm ends the process, though the one that started it has ignored alarms, and this thread blocks
/// them.
#[allow(unsafe_code, reason = "a handler is a pointer")]
fn let_alarms_end_the_process() {
    // SAFETY: the default action, not a handler.
    unsafe { signal::signal(Signal::SIGALRM, SigHandler::SigDfl) }.unwrap_or(SigHandler::SigDfl);
    SigSet::from_iter([Signal::SIGALRM])
        .thread_unblock()
        .unwrap_or_default();
}

/// The signals, blocked in this thread and in the threads that it starts.
pub(crate) struct BlockedSignals {
    set: SignalSet,
    /// Whether the process has a terminal, whose end SIGHUP reports.
    has_terminal: bool,
}

/// The signals that ask the daemon to end.
#[derive(Debug)]
pub(crate) struct StopSignals {
    wakeup: SignalWakeup,
    overseer: OverseerHandle,
}

impl BlockedSignals {
    /// Blocks the signals. Must be called before any thread is started that does not block them.
    ///
    /// # Errors
    /// The system refuses.
    pub(crate) fn new() -> std::io::Result<Self> {
        let set = SignalSet::watched();
        set.block()?;
        Ok(Self {
            set,
            has_terminal: std::fs::File::open("/dev/tty").is_ok(),
        })
    }

    /// Begins to wait for the signals. `end_loop` ends the loop with zero force, from any thread;
    /// the ramp of the release takes `ramp`. Returns those that ask for the end, and those that ask for a
    /// reload. Called on the control thread.
    ///
    /// # Errors
    /// The system has no thread or descriptor left.
    pub(crate) fn watch(
        self,
        ramp: Duration,
        end_loop: impl Fn() + Send + 'static,
    ) -> std::io::Result<(StopSignals, SignalWakeup)> {
        let (end, wakeup) = SignalWakeup::new()?;
        let (reload, reloads) = SignalWakeup::new()?;
        let progress = Arc::new(Progress::default());
        let overseen = Arc::clone(&progress);
        let overseer = start("overseer", move || oversee(&overseen, ramp + MAX_END, end_loop))?;
        let overseer = OverseerHandle { progress, overseer };
        let notifier = overseer.clone();
        start("signals", move || {
            loop {
                match self.set.wait() {
                    Some(libc::SIGALRM) if notifier.progress.enforced.load(Ordering::Acquire) => {
                        // The overseer's own, which the system has given to this thread.
                        let_alarms_end_the_process();
                        signal::raise(Signal::SIGALRM).unwrap_or_default();
                    }
                    Some(libc::SIGHUP) if !self.has_terminal => wake(&reload),
                    Some(_) => {
                        notifier.notify(|progress| &progress.asked);
                        wake(&end);
                    }
                    // The wait can only be interrupted.
                    None => {}
                }
            }
        })?;
        Ok((StopSignals { wakeup, overseer }, reloads))
    }
}

impl StopSignals {
    /// Waits for the next signal.
    pub(crate) async fn wait(&self) {
        if self.wakeup.next().await.is_err() {
            std::future::pending::<()>().await;
        }
    }

    /// Notifies the overseer that the daemon has begun to end, for any reason.
    pub(crate) fn begun(&self) {
        self.overseer.notify(|progress| &progress.begun);
    }
}

/// Ends the daemon as SIGTERM does, once its standard input ends: the program that wrote there has ended, however it
/// did.
///
/// # Errors
/// The system has no thread left.
pub(crate) fn end_with_input() -> std::io::Result<()> {
    let wait = || {
        // One that cannot be read has ended as well.
        std::io::copy(&mut std::io::stdin(), &mut std::io::sink()).unwrap_or_default();
        signal::kill(Pid::this(), Signal::SIGTERM).unwrap_or_default();
    };
    start("input", wait).map(drop)
}

fn start(name: &str, run: impl FnOnce() + Send + 'static) -> std::io::Result<Thread> {
    // The thread is never joined: it ends with the process.
    thread::Builder::new()
        .name(name.to_owned())
        .stack_size(STACK_BYTES)
        .spawn(run)
        .map(|started| started.thread().clone())
}

/// Waits for the end of the daemon, and enforces it if it does not come in time.
fn oversee(progress: &Progress, longest_end: Duration, end_loop: impl Fn()) {
    let why = overdue(progress, longest_end);
    // The force first: nothing may delay it.
    end_loop();
    // Not even a lock, from here on.
    progress.enforced.store(true, Ordering::Release);
    let_alarms_end_the_process();
    alarm::set(LAST_WORDS_S);
    thread::sleep(FINAL_ZERO_TIME);
    log::say_at(Level::Error, why);
    log::flush(FINAL_ZERO_TIME);
    std::process::exit(1);
}

/// Waits until the end must be enforced; returns the reason.
fn overdue(progress: &Progress, longest_end: Duration) -> &'static str {
    let is = |word: &AtomicBool| word.load(Ordering::Acquire);
    while !is(&progress.asked) && !is(&progress.begun) {
        thread::park();
    }
    let deadline = Instant::now() + REACTION_TIME;
    while !is(&progress.begun) {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return "the control thread hangs: the loop was ended without its ramp, and the daemon with it";
        }
        thread::park_timeout(left);
    }
    thread::sleep(longest_end);
    "the daemon did not come to an end in time: cut the power of the motor if it still pulls"
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::process::ExitStatusExt as _;
    use std::process::Command;

    #[test]
    fn an_end_that_is_ignored_or_takes_too_long_is_enforced() {
        let progress = |asked: bool, begun: bool| Progress {
            asked: asked.into(),
            begun: begun.into(),
            enforced: false.into(),
        };
        let asked = Instant::now();
        let why = overdue(&progress(true, false), Duration::from_secs(3600));
        assert!(why.contains("the control thread hangs"), "{why}");
        assert!(asked.elapsed() >= REACTION_TIME, "{:?}", asked.elapsed());

        for was_asked in [true, false] {
            let why = overdue(&progress(was_asked, true), Duration::from_millis(1));
            assert!(why.contains("did not come to an end"), "{why}");
        }
    }

    // hazard: H1, H2, F19
    #[test]
    fn an_end_is_enforced_though_a_thread_that_hangs_holds_the_log() {
        let this = std::env::current_exe().expect("a test has a path");
        let output = Command::new(this)
            .args([
                "--ignored",
                "--exact",
                "--nocapture",
                "shutdown::tests::oversees_while_the_log_is_held",
            ])
            .output()
            .expect("it starts");
        assert_eq!(output.status.signal(), Some(Signal::SIGALRM as i32), "{output:?}");
        let printed = String::from_utf8_lossy(&output.stdout);
        assert!(printed.contains("the loop was ended"), "{printed}");
    }

    #[test]
    #[ignore = "the test above runs it in a process of its own"]
    #[allow(unsafe_code, reason = "a handler is a pointer")]
    fn oversees_while_the_log_is_held() {
        // As from a parent that ignores alarms.
        // SAFETY: no handler.
        unsafe { signal::signal(Signal::SIGALRM, SigHandler::SigIgn) }.expect("the system permits it");
        let _held = std::io::stderr().lock();
        let (sender, receiver) = std::sync::mpsc::channel();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .expect("a runtime");
        let _entered = runtime.enter();
        let blocked = BlockedSignals::new().expect("the system permits it");
        let end_loop = move || sender.send(()).expect("it is received");
        let (signals, _reloads) = blocked.watch(Duration::ZERO, end_loop).expect("threads");
        // It begins to end, and comes to none.
        signals.begun();
        receiver.recv().expect("the loop is ended");
        println!("the loop was ended");
        thread::sleep(Duration::from_secs(60));
    }
}
