//! The life of the real-time thread.

use crate::rt::clock::{Grid, Waiting, now_ns};
use crate::rt::handoff::Shared;
use crate::rt::privileges::{self, Policy};
use crate::rt::tick::Tick;
use crate::self_test;
use device_io::Device;
use haptic_ipc::RealTimeStatus;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How the thread is to run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wishes {
    pub(crate) period_ns: u64,
    pub(crate) cpu: Option<usize>,
    pub(crate) policy: Policy,
    /// How long before a deadline it wakes up to spin, ns; by default what waking up usually takes, where nobody else is kept waiting by that.
    pub(crate) spin_ns: Option<u64>,
}

/// How the thread ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// It was asked to.
    Quit,
    /// It panicked. Whether the device took the zero force that followed.
    Panicked {
        /// It did.
        zeroed: bool,
    },
}

/// Name of the thread.
const NAME: &str = "rt";

/// Keeps the panic message of the real-time thread from being written before its force is zeroed: standard error may block.
pub(crate) fn mute_panics() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if std::thread::current().name() != Some(NAME) {
            usual(panic);
        }
    }));
}

/// The stack, bytes: the loop needs a few kilobytes, and all of it is locked in memory.
const STACK_BYTES: usize = 256 * 1024;

/// The thread, while it runs. However the daemon ends, the loop ends first, and its last word is zero force.
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
        Some(thread.join().unwrap_or(End::Panicked { zeroed: false }))
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
pub(crate) fn start(
    mut tick: Tick<dyn Device>,
    shared: Arc<Shared>,
    wishes: Wishes,
    mut status: RealTimeStatus,
) -> std::io::Result<(RunningLoop, RealTimeStatus)> {
    let (ready, is_ready) = mpsc::sync_channel(1);
    let loop_shared = Arc::clone(&shared);
    let thread = std::thread::Builder::new()
        .name(NAME.to_owned())
        .stack_size(STACK_BYTES)
        .spawn(move || {
            privileges::prepare_thread(&wishes, &mut status);
            let waiting = Waiting {
                spin_ns: spin_ns(&wishes, &status),
            };
            status.spin_us = waiting.spin_ns / 1000;
            // Nobody may be waiting any more; the loop runs all the same.
            drop(ready.send(status));
            let ended = catch_unwind(AssertUnwindSafe(|| {
                run(&mut tick, &loop_shared, wishes.period_ns, waiting);
            }));
            // The last word to the motor, however the loop ended. It may be the device that panicked.
            let zeroed = catch_unwind(AssertUnwindSafe(|| tick.zero_force().is_ok())).unwrap_or(false);
            match ended {
                Ok(()) => End::Quit,
                Err(_) => End::Panicked { zeroed },
            }
        })?;
    let running = RunningLoop {
        shared,
        thread: Some(thread),
    };
    let status = is_ready.recv().map_err(std::io::Error::other)?;
    Ok((running, status))
}

/// Runs the self-test, in turns of so many seconds, on a thread that is prepared as the loop's is.
///
/// # Errors
/// The system has no thread left, or the test panicked.
pub(crate) fn self_test(
    mut tick: Tick<dyn Device>,
    mut control: self_test::ControlSide,
    turn_s: u64,
    wishes: Wishes,
    mut status: RealTimeStatus,
) -> std::io::Result<(String, RealTimeStatus)> {
    let thread = std::thread::Builder::new()
        .name(NAME.to_owned())
        .stack_size(STACK_BYTES)
        .spawn(move || {
            privileges::prepare_thread(&wishes, &mut status);
            let waiting = Waiting {
                spin_ns: spin_ns(&wishes, &status),
            };
            let comparison = self_test::compare(&mut tick, &mut control, turn_s, wishes.period_ns, waiting);
            (comparison.report(wishes.period_ns, waiting), status)
        })?;
    thread
        .join()
        .map_err(|_| std::io::Error::other("the self-test panicked"))
}

/// Nearly all wake-ups are shorter than this, ns: on the machines that it was measured on half of them take 13 to 40 us, and one in a hundred more than
/// 20 to 70 us, by the hour.
const USUAL_SPIN_NS: u64 = 100_000;

fn spin_ns(wishes: &Wishes, status: &RealTimeStatus) -> u64 {
    // A loop without a priority or a core of its own would spin away what others need, and gain nothing.
    let usual = if status.fifo_priority.is_some() && status.cpu.is_some() {
        USUAL_SPIN_NS
    } else {
        0
    };
    // At least half of every period is left to the rest of the system.
    wishes.spin_ns.unwrap_or(usual).min(wishes.period_ns / 2)
}

fn run(tick: &mut Tick<dyn Device>, shared: &Shared, period_ns: u64, waiting: Waiting) {
    let mut grid = Grid::new(period_ns, now_ns());
    while !shared.quitting() {
        let wake = grid.wait(waiting);
        let ended_ns = tick.run(wake, grid.missed());
        grid.advance(ended_ns);
    }
}
