//! The life of the real-time thread.

use crate::rt::clock::{Grid, Waiting, now_ns};
use crate::rt::privileges;
use crate::rt::shared::Shared;
use crate::rt::space::Space;
use crate::rt::tick::Tick;
use device_io::Device;
use haptic_ipc::RealTimeStatus;
use std::cell::Cell;
use std::fmt::{self, Write as _};
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How the real-time thread is to run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ThreadSettings {
    pub(crate) period_ns: u64,
    /// Time from the multiples of the period to the deadlines, ns.
    pub(crate) phase_ns: u64,
    pub(crate) cpu: Option<usize>,
    pub(crate) policy: Policy,
    /// Time before a deadline at which it wakes up to spin, ns. By default it is what waking up
    /// usually takes, if spinning keeps nobody else waiting.
    pub(crate) spin_ns: Option<u64>,
}

/// How the loop is scheduled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Policy {
    /// SCHED_FIFO at a priority.
    Fifo { priority: u8 },
    /// SCHED_DEADLINE: half of every period is guaranteed. It cannot be pinned.
    Deadline,
}

/// Nearly all wake-ups are shorter than this, ns: on the machines that it was measured on half of
/// them take 13 to 40 us, and one in a hundred more than 20 to 70 us, by the hour.
const DEFAULT_SPIN_NS: u64 = 100_000;

impl ThreadSettings {
    /// Time before a deadline that is spun away, ns.
    pub(crate) fn spin_ns(&self, has_core_and_priority: bool) -> u64 {
        // A loop without a priority or a core of its own would spin away what others need, and
        // gain nothing.
        let default = if has_core_and_priority { DEFAULT_SPIN_NS } else { 0 };
        // At least half of every period is left to the rest of the system.
        self.spin_ns.unwrap_or(default).min(self.period_ns / 2)
    }
}

/// How the thread ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct End {
    /// Its message, where it panicked; otherwise it was asked to end.
    pub(crate) panic: Option<PanicMessage>,
    pub(crate) final_zero: FinalZero,
}

/// What became of the zero force that is the last command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FinalZero {
    /// The device has confirmed it; one that reports nothing of its motor has taken it.
    Confirmed,
    /// The device is there and has not confirmed it.
    Unconfirmed,
    NoDevice,
}

const NAME: &str = "rt";

/// Keeps the panic message of the real-time thread from being written before its force is zeroed:
/// standard error may block. [`End`] carries it.
pub(crate) fn keep_panics() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if std::thread::current().name() == Some(NAME) {
            PANICKED.set(PanicMessage::of(panic));
        } else {
            usual(panic);
        }
    }));
}

thread_local! {
    /// The message of the thread's panic.
    static PANICKED: Cell<PanicMessage> = const { Cell::new(PanicMessage::empty()) };
}

/// Where a panic was and its message, in place and cut to its room: nothing is allocated for it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct PanicMessage {
    bytes: [u8; Self::ROOM],
    length: usize,
}

impl PanicMessage {
    const ROOM: usize = 512;

    const fn empty() -> Self {
        Self {
            bytes: [0; Self::ROOM],
            length: 0,
        }
    }

    fn of(panic: &PanicHookInfo<'_>) -> Self {
        let mut message = Self::empty();
        let payload = panic.payload_as_str().unwrap_or("a panic without a message");
        let written = match panic.location() {
            Some(location) => write!(message, "{location}: {payload}"),
            None => message.write_str(payload),
        };
        if written.is_err() {
            // What there was room for is there.
        }
        message
    }

    fn as_str(&self) -> &str {
        std::str::from_utf8(&self.bytes[..self.length]).unwrap_or_default()
    }
}

impl fmt::Write for PanicMessage {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let room = text.floor_char_boundary(Self::ROOM - self.length);
        self.bytes[self.length..self.length + room].copy_from_slice(&text.as_bytes()[..room]);
        self.length += room;
        if room == text.len() { Ok(()) } else { Err(fmt::Error) }
    }
}

impl fmt::Display for PanicMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl fmt::Debug for PanicMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.as_str().fmt(f)
    }
}

/// The stack, bytes: the loop needs a few kilobytes, and all of it is locked in memory.
const STACK_BYTES: usize = 256 * 1024;

/// The thread, while it runs. However the daemon ends, the loop ends first, and its last command is
/// zero force.
#[derive(Debug)]
pub(crate) struct RunningLoop {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<End>>,
}

/// How long the loop may take to end: at the slowest rate a tick is 10 ms.
const END_TIMEOUT: Duration = Duration::from_secs(1);

impl RunningLoop {
    /// Returns when the loop has ended, which it does by itself only in a panic.
    pub(crate) async fn ended(&self) {
        while self.thread.as_ref().is_some_and(|thread| !thread.is_finished()) {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    }

    /// Ends the loop; returns how it ended, or nothing if it does not.
    pub(crate) fn end(&mut self) -> Option<End> {
        self.shared.quit();
        let thread = self.thread.take()?;
        let began = Instant::now();
        while !thread.is_finished() {
            if began.elapsed() > END_TIMEOUT {
                return None;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Some(thread.join().unwrap_or(End {
            panic: Some(PanicMessage::empty()),
            final_zero: FinalZero::Unconfirmed,
        }))
    }
}

impl Drop for RunningLoop {
    fn drop(&mut self) {
        self.end();
    }
}

/// Starts the loop. Returns once it runs, with what it got of what it asked for.
///
/// # Errors
/// The system has no thread left.
pub(crate) fn start<V: Space>(
    mut tick: Tick<dyn Device<V>, V>,
    shared: Arc<Shared>,
    settings: ThreadSettings,
    mut status: RealTimeStatus,
) -> std::io::Result<(RunningLoop, RealTimeStatus)> {
    #[expect(
        clippy::disallowed_methods,
        reason = "used once, before the loop runs; there is room for what is sent"
    )]
    let (ready, is_ready) = mpsc::sync_channel(1);
    let loop_shared = Arc::clone(&shared);
    let thread = spawn(move || {
        let waiting = prepare(&settings, &mut status);
        // Nobody may be waiting any more; the loop runs all the same.
        drop(ready.send(status));
        let ended = catch_unwind(AssertUnwindSafe(|| {
            run(&mut tick, &loop_shared, settings, waiting);
        }));
        // The last command to the motor, however the loop ended. It may be the device that panicked.
        let panic = ended.is_err().then(|| PANICKED.get());
        let final_zero = catch_unwind(AssertUnwindSafe(|| final_zero(&mut tick))).unwrap_or(FinalZero::Unconfirmed);
        End { panic, final_zero }
    })?;
    let running = RunningLoop {
        shared,
        thread: Some(thread),
    };
    let status = is_ready.recv().map_err(std::io::Error::other)?;
    Ok((running, status))
}

/// How long the device may take to confirm the last zero force.
const FINAL_ZERO_TIMEOUT: Duration = Duration::from_millis(100);

/// Commands zero force until the device has confirmed it.
fn final_zero<V: Space>(tick: &mut Tick<dyn Device<V>, V>) -> FinalZero {
    let began = Instant::now();
    loop {
        match tick.zero_force(now_ns()) {
            Ok(true) => return FinalZero::Confirmed,
            Ok(false) if began.elapsed() > FINAL_ZERO_TIMEOUT => return FinalZero::Unconfirmed,
            Ok(false) => std::thread::sleep(Duration::from_millis(1)),
            Err(_) => return FinalZero::NoDevice,
        }
    }
}

/// Runs something on a thread that is prepared as the loop's is; returns what came of it, and what
/// the thread got of what it asked for.
///
/// # Errors
/// The system has no thread left, or the thread panicked.
pub(crate) fn on_prepared_thread<T: Send + 'static>(
    settings: ThreadSettings,
    mut status: RealTimeStatus,
    work: impl FnOnce(Waiting) -> T + Send + 'static,
) -> std::io::Result<(T, RealTimeStatus)> {
    let thread = spawn(move || {
        let waiting = prepare(&settings, &mut status);
        (work(waiting), status)
    })?;
    thread
        .join()
        .map_err(|_| std::io::Error::other("the real-time thread panicked"))
}

fn spawn<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> std::io::Result<JoinHandle<T>> {
    std::thread::Builder::new()
        .name(NAME.to_owned())
        .stack_size(STACK_BYTES)
        .spawn(work)
}

fn prepare(settings: &ThreadSettings, status: &mut RealTimeStatus) -> Waiting {
    privileges::prepare_thread(settings, status);
    let has_core_and_priority = status.fifo_priority.is_some() && status.cpu.is_some();
    let spin_ns = settings.spin_ns(has_core_and_priority);
    status.spin_us = spin_ns / 1000;
    Waiting { spin_ns }
}

fn run<V: Space>(tick: &mut Tick<dyn Device<V>, V>, shared: &Shared, settings: ThreadSettings, waiting: Waiting) {
    let mut grid = Grid::new(settings.period_ns, settings.phase_ns, now_ns());
    while !shared.quitting() {
        let wake = grid.wait(waiting);
        let ended_ns = tick.run(wake, grid.missed());
        grid.advance(ended_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_message_is_cut_to_its_room_between_two_letters() {
        let mut message = PanicMessage::empty();
        assert!(write!(message, "line {}: short", 3 + 4).is_ok());
        assert_eq!(message.to_string(), "line 7: short");
        let mut message = PanicMessage::empty();
        assert!(write!(message, "x{}", "é".repeat(PanicMessage::ROOM)).is_err());
        let kept = message.to_string();
        assert_eq!(kept.len(), PanicMessage::ROOM - 1);
        assert!(kept.starts_with("xé") && kept.ends_with('é'));
    }

    // hazard: P11
    #[test]
    fn the_loop_never_spins_for_more_than_half_a_period() {
        let with = |spin_ns, period_ns, alone: bool| {
            let settings = ThreadSettings {
                period_ns,
                phase_ns: period_ns / 2,
                cpu: Some(1),
                policy: Policy::Fifo { priority: 50 },
                spin_ns,
            };
            settings.spin_ns(alone)
        };
        for period_ns in [50_000, 100_000, 150_000, 1_000_000, 10_000_000] {
            for wanted_ns in [None, Some(0), Some(30_000), Some(period_ns), Some(u64::MAX)] {
                for alone in [false, true] {
                    let spins_ns = with(wanted_ns, period_ns, alone);
                    assert!(
                        spins_ns <= period_ns / 2,
                        "{spins_ns} ns of {period_ns} ns, asked for {wanted_ns:?}"
                    );
                }
            }
        }
        // At 1 kHz there is room for the usual time, and for what was asked for.
        assert_eq!(with(None, 1_000_000, true), DEFAULT_SPIN_NS);
        assert_eq!(with(Some(30_000), 1_000_000, true), 30_000);
        // Without a priority and a processor of its own it keeps nobody waiting, unless the options say so.
        assert_eq!(with(None, 1_000_000, false), 0);
        assert_eq!(with(Some(30_000), 1_000_000, false), 30_000);
    }
}
