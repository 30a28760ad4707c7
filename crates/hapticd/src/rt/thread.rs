//! The life of the real-time thread.

use crate::rt::clock::{Grid, now_ns};
use crate::rt::handoff::Shared;
use crate::rt::privileges;
use crate::rt::tick::Tick;
use device_io::Device;
use haptic_ipc::RealTimeStatus;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;

/// How the thread is to run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wishes {
    pub(crate) period_ns: u64,
    pub(crate) cpu: Option<usize>,
    pub(crate) priority: u8,
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

/// Starts the loop. Returns once it runs, with what it got of what it asked for.
///
/// # Errors
/// The system has no thread left.
pub(crate) fn start(
    mut tick: Tick<dyn Device>,
    shared: Arc<Shared>,
    wishes: Wishes,
    mut status: RealTimeStatus,
) -> std::io::Result<(JoinHandle<End>, RealTimeStatus)> {
    let (ready, is_ready) = mpsc::sync_channel(1);
    let thread = std::thread::Builder::new()
        .name(NAME.to_owned())
        .stack_size(STACK_BYTES)
        .spawn(move || {
            privileges::prepare_thread(wishes.cpu, wishes.priority, &mut status);
            // Nobody may be waiting any more; the loop runs all the same.
            drop(ready.send(status));
            let ended = catch_unwind(AssertUnwindSafe(|| run(&mut tick, &shared, wishes.period_ns)));
            // The last word to the motor, however the loop ended. It may be the device that panicked.
            let zeroed = catch_unwind(AssertUnwindSafe(|| tick.zero_force().is_ok())).unwrap_or(false);
            match ended {
                Ok(()) => End::Quit,
                Err(_) => End::Panicked { zeroed },
            }
        })?;
    let status = is_ready.recv().map_err(std::io::Error::other)?;
    Ok((thread, status))
}

fn run(tick: &mut Tick<dyn Device>, shared: &Shared, period_ns: u64) {
    let mut grid = Grid::new(period_ns, now_ns());
    while !shared.quitting() {
        let wake = grid.wait();
        let ended_ns = tick.run(wake, grid.missed());
        grid.advance(ended_ns);
    }
}
