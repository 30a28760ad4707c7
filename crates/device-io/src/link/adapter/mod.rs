//! Adapters for motor controllers that people own: they speak their makers' published text protocols, not the link protocol, so something is lost against our own firmware.
//!
//! - No controller stamps or numbers its samples. A sample's time is when we asked for it, and we number the answers.
//! - An answer to this tick's question is read in the next tick, or later: the position is a tick old, and the force later by as much.
//! - Questions that are not answered yet are limited ([`feedback::WINDOW`]), so that a slow line fills no buffer with old forces.
//!
//! None of this has been tried on a real board; the fakes in [`crate::fake`] speak the published protocols. docs/adapters.md says how to set a board up.

mod feedback;
mod greeting;
mod odrive;
mod options;
mod simplefoc;
mod text;
#[cfg(test)]
mod virtual_line;

pub use odrive::ODriveConnector;
pub use options::{MotorOptions, ODriveOptions, SimpleFocOptions};
pub use simplefoc::SimpleFocConnector;

use super::health::{LinkCounters, add};
use super::serial::{Line, Sent};
use super::{Connection, clock};
use crate::device::{DeviceError, Measurement};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use text::{Lines, Text, TooLong};

/// A controller is sent no more than one set of commands in so long while it does not do what it was told, ns.
const TELL_AGAIN_NS: u64 = 10_000_000;

/// A motor must be enabled so long after it was told to, ns.
const ARMING_NS: u64 = 300_000_000;

/// What is said to a controller, and what its lines mean. It knows nothing of serial lines, and waits for nothing.
trait Conversation: Send {
    /// Takes in a line that came, without its end, at a time of ours.
    fn take(&mut self, line: Result<&[u8], TooLong>, now_ns: u64);

    /// The newest sample; nothing before the first.
    ///
    /// # Errors
    /// As [`Connection::read`].
    fn measurement(&mut self, now_ns: u64) -> Result<Option<Measurement>, DeviceError>;

    /// Writes what is to be sent for a force on the hand, N.
    fn command(&mut self, force_n: f64, enabled: bool, now_ns: u64, out: &mut Text);

    /// Writes what leaves the motor off.
    fn farewell(&self, out: &mut Text);

    /// Distance between two positions that it can tell apart, m.
    fn resolution_m(&self) -> f64;
}

/// A controller on a serial line, greeted.
#[derive(Debug)]
struct TextConnection<C: Conversation> {
    line: Line,
    lines: Lines,
    conversation: C,
    counters: Arc<LinkCounters>,
}

impl<C: Conversation> TextConnection<C> {
    fn send(&mut self, text: &Text, now_ns: u64) -> Result<(), DeviceError> {
        if !text.as_bytes().is_empty() && self.line.write(text.as_bytes(), now_ns)? == Sent::NoRoom {
            add(&self.counters.not_sent, 1);
        }
        Ok(())
    }
}

impl<C: Conversation> Connection for TextConnection<C> {
    fn read(&mut self, now_ns: u64) -> Result<Option<Measurement>, DeviceError> {
        let Self {
            line,
            lines,
            conversation,
            ..
        } = self;
        line.read(|bytes| lines.take(bytes, |line| conversation.take(line, now_ns)))?;
        conversation.measurement(now_ns)
    }

    fn write(&mut self, force_n: f64, enabled: bool, now_ns: u64) -> Result<(), DeviceError> {
        let mut text = Text::default();
        self.conversation.command(force_n, enabled, now_ns, &mut text);
        self.send(&text, now_ns)
    }

    fn resolution_m(&self) -> f64 {
        self.conversation.resolution_m()
    }
}

impl<C: Conversation> Drop for TextConnection<C> {
    fn drop(&mut self) {
        let mut text = Text::default();
        self.conversation.farewell(&mut text);
        if self.send(&text, clock::now_ns()).is_err() {
            // Nobody hears the last word. An ODrive's watchdog does the rest; of a SimpleFOC board docs/adapters.md speaks.
        }
        self.counters.age_ns.store(0, Relaxed);
    }
}
