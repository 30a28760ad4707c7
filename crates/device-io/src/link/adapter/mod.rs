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
pub use options::{MotorOptions, ODriveOptions, SimpleFocOptions, TargetUnit};
pub use simplefoc::SimpleFocConnector;

use super::health::{LinkCounters, add};
use super::serial::{Line, Sent};
use super::{Connection, clock};
use crate::device::{DeviceError, Measurement, Written};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use text::{Lines, Text, TooLong};

/// A controller is sent no more than one set of commands in so long while it does not do what it was told, ns.
const TELL_AGAIN_NS: u64 = 10_000_000;

/// A motor must be enabled so long after it was told to, ns.
const ARMING_NS: u64 = 300_000_000;

/// Where in the conversation the force of a command is, or the switching off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Telling {
    /// Nowhere yet: the controller is slow, or not ready for forces.
    NotYet,
    /// In what is sent now.
    Now,
    /// In what was sent before. Only switching off is not told again in every tick.
    Before,
    /// The controller has answered that its motor is off.
    Answered,
}

/// What is said to a controller, and what its lines mean. It knows nothing of serial lines, and waits for nothing.
trait Conversation: Send {
    /// Takes in a line that came, without its end, at a time of ours.
    fn take(&mut self, line: Result<&[u8], TooLong>, now_ns: u64);

    /// The newest sample; nothing before the first.
    ///
    /// # Errors
    /// As [`Connection::read`].
    fn measurement(&mut self, now_ns: u64) -> Result<Option<Measurement>, DeviceError>;

    /// Writes what is to be sent for a force on the hand, N; says whether the force, or the switching off, is in it.
    fn command(&mut self, force_n: f64, enabled: bool, now_ns: u64, out: &mut Text) -> Telling;

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
    /// What became of the force, or the switching off, that was last sent.
    told: Sent,
}

impl<C: Conversation> TextConnection<C> {
    fn new(line: Line, conversation: C, counters: Arc<LinkCounters>) -> Self {
        Self {
            line,
            lines: Lines::default(),
            conversation,
            counters,
            told: Sent::NoRoom,
        }
    }

    /// What becomes of a text. One without a word lets the rest of the one before go.
    fn send(&mut self, text: &Text, now_ns: u64) -> Result<Sent, DeviceError> {
        if text.as_bytes().is_empty() && !self.line.has_rest() {
            return Ok(Sent::Taken);
        }
        let sent = self.line.write(text.as_bytes(), now_ns);
        self.line.note_failure(&self.counters, now_ns);
        let sent = sent?;
        if sent == Sent::NoRoom && !text.as_bytes().is_empty() {
            add(&self.counters.not_sent, 1);
        }
        Ok(sent)
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
        let read = line.read(|bytes| lines.take(bytes, |line| conversation.take(line, now_ns)));
        line.note_failure(&self.counters, now_ns);
        read?;
        conversation.measurement(now_ns)
    }

    fn write(&mut self, force_n: f64, enabled: bool, now_ns: u64) -> Result<Written, DeviceError> {
        let mut text = Text::default();
        let telling = self.conversation.command(force_n, enabled, now_ns, &mut text);
        let sent = self.send(&text, now_ns)?;
        if telling == Telling::Now {
            self.told = sent;
        } else if self.told == Sent::Begun && sent != Sent::NoRoom {
            // Its rest has gone before what was sent now.
            self.told = Sent::Taken;
        }
        Ok(match telling {
            Telling::Answered => Written::Taken,
            Telling::Now | Telling::Before if self.told == Sent::Taken => Written::Taken,
            Telling::Now | Telling::Before | Telling::NotYet => Written::Later,
        })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::Terminal;
    use std::fmt;

    const MS: u64 = 1_000_000;

    /// Tells every force, and tells the switching off when it is new and every ten milliseconds.
    #[derive(Debug, Default)]
    struct Curt {
        off_at_ns: Option<u64>,
        says_that_it_is_off: bool,
    }

    impl Conversation for Curt {
        fn take(&mut self, _line: Result<&[u8], TooLong>, _now_ns: u64) {
            self.says_that_it_is_off = true;
        }

        fn measurement(&mut self, _now_ns: u64) -> Result<Option<Measurement>, DeviceError> {
            Ok(None)
        }

        fn command(&mut self, _force_n: f64, enabled: bool, now_ns: u64, out: &mut Text) -> Telling {
            if enabled {
                self.off_at_ns = None;
                out.whole(|out| fmt::Write::write_str(out, "force\n"));
                return Telling::Now;
            }
            if self.says_that_it_is_off {
                return Telling::Answered;
            }
            if self.off_at_ns.is_some_and(|at_ns| now_ns - at_ns < TELL_AGAIN_NS) {
                return Telling::Before;
            }
            self.off_at_ns = Some(now_ns);
            self.farewell(out);
            Telling::Now
        }

        fn farewell(&self, out: &mut Text) {
            out.whole(|out| fmt::Write::write_str(out, "off\n"));
        }

        fn resolution_m(&self) -> f64 {
            0.0
        }
    }

    #[test]
    fn switching_off_is_taken_once_the_line_has_it_or_the_controller_says_so() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("board");
        let board = Terminal::plug_in(&path).expect("a terminal");
        let line = Line::open(&path, 1_000_000).expect("it is there");
        let mut connection = TextConnection::new(line, Curt::default(), Arc::default());
        let mut now_ns = 1000 * MS;
        // Nobody reads until the line takes no more.
        let fill = |connection: &mut TextConnection<Curt>, now_ns: u64| {
            let full = (0..100_000).find(|_| connection.write(1.0, true, now_ns) == Ok(Written::Later));
            assert!(full.is_some(), "nobody reads so much");
        };
        fill(&mut connection, now_ns);
        let mut off = |connection: &mut TextConnection<Curt>, later_ns: u64| {
            now_ns += later_ns;
            connection.write(0.0, false, now_ns)
        };
        assert_eq!(off(&mut connection, MS), Ok(Written::Later), "there is no room");
        assert_eq!(off(&mut connection, MS), Ok(Written::Later), "nor was it told before");
        let mut heard = Vec::new();
        let read = |heard: &mut Vec<u8>| board.read(|bytes| heard.extend(bytes)).expect("it is there");
        read(&mut heard);
        assert_eq!(
            off(&mut connection, MS),
            Ok(Written::Later),
            "there is room, and it is not told yet"
        );
        assert_eq!(off(&mut connection, 10 * MS), Ok(Written::Taken), "told again");
        assert_eq!(off(&mut connection, MS), Ok(Written::Taken), "that counts on");
        read(&mut heard);
        assert!(
            heard.ends_with(b"force\noff\n"),
            "{:?}",
            String::from_utf8_lossy(&heard)
        );
        // A force, and then no room for the switching off, which the controller does by itself.
        fill(&mut connection, now_ns);
        assert_eq!(connection.write(0.0, false, now_ns), Ok(Written::Later));
        connection.conversation.says_that_it_is_off = true;
        assert_eq!(connection.write(0.0, false, now_ns), Ok(Written::Taken));
    }
}
