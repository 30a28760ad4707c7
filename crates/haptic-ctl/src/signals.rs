//! The signals by which a person, or the system, ends a program.

use rustix::process::Signal;
use std::io;
use tokio::signal::unix::{self, SignalKind, signal};

/// An interrupt, a request to end and a hang-up: caught from here on.
pub(crate) struct Signals([(unix::Signal, Signal); 3]);

impl Signals {
    pub(crate) fn new() -> io::Result<Self> {
        Ok(Self([
            (signal(SignalKind::interrupt())?, Signal::INT),
            (signal(SignalKind::terminate())?, Signal::TERM),
            (signal(SignalKind::hangup())?, Signal::HUP),
        ]))
    }

    /// The next one. Safe to drop half-way.
    pub(crate) async fn next(&mut self) -> Signal {
        let [(interrupt, int), (terminate, term), (hang_up, hup)] = &mut self.0;
        tokio::select! {
            _ = interrupt.recv() => *int,
            _ = terminate.recv() => *term,
            _ = hang_up.recv() => *hup,
        }
    }
}
