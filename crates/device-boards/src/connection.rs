//! A controller on a serial line, greeted, as the real-time thread reads and writes it.

use crate::conversation::{CommandState, Conversation, Dialect};
use crate::text::{Lines, Text};
use device_io::link::{Connection, LinkCounters, SendOutcome, SerialLine, add};
use device_io::{DeviceError, Measurement, Written, now_ns};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

/// A serial line and the conversation on it.
#[derive(Debug)]
pub(crate) struct TextConnection<D: Dialect> {
    line: SerialLine,
    lines: Lines,
    conversation: Conversation<D>,
    counters: Arc<LinkCounters>,
    /// What became of the force, or the switching off, that was last sent.
    last_sent: SendOutcome,
}

impl<D: Dialect> TextConnection<D> {
    pub(crate) fn new(line: SerialLine, conversation: Conversation<D>, counters: Arc<LinkCounters>) -> Self {
        Self {
            line,
            lines: Lines::default(),
            conversation,
            counters,
            last_sent: SendOutcome::NoRoom,
        }
    }

    /// Sends a text; an empty one sends the rest of the text before.
    fn send(&mut self, text: &Text, now_ns: u64) -> Result<SendOutcome, DeviceError> {
        if text.as_bytes().is_empty() && !self.line.has_rest() {
            return Ok(SendOutcome::Taken);
        }
        let sent = self.line.write(text.as_bytes(), now_ns);
        self.line.note_failure(&self.counters, now_ns);
        let sent = sent?;
        if sent == SendOutcome::NoRoom && !text.as_bytes().is_empty() {
            add(&self.counters.not_sent, 1);
        }
        Ok(sent)
    }
}

impl<D: Dialect> Connection for TextConnection<D> {
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
        conversation.measurement(now_ns).map(Some)
    }

    fn write(&mut self, force_n: f64, enabled: bool, now_ns: u64) -> Result<Written, DeviceError> {
        let mut text = Text::default();
        let state = self.conversation.command(force_n, enabled, now_ns, &mut text);
        let sent = self.send(&text, now_ns)?;
        if state == CommandState::InThisText {
            self.last_sent = sent;
        } else if self.last_sent == SendOutcome::Begun && sent != SendOutcome::NoRoom {
            // Its rest has gone before this text.
            self.last_sent = SendOutcome::Taken;
        }
        Ok(match state {
            CommandState::Confirmed => Written::Taken,
            CommandState::InThisText | CommandState::SentBefore if self.last_sent == SendOutcome::Taken => {
                Written::Taken
            }
            CommandState::InThisText | CommandState::SentBefore | CommandState::NotSent => Written::Later,
        })
    }
}

impl<D: Dialect> Drop for TextConnection<D> {
    fn drop(&mut self) {
        let mut text = Text::default();
        self.conversation.farewell(&mut text);
        if self.send(&text, now_ns()).is_err() {
            // Nobody hears the last words. The axis watchdog does the rest.
        }
        self.counters.age_ns.store(0, Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conversation::{Axis, Motor, Scale};
    use device_io::fake::Port;
    use std::fmt;

    const MS: u64 = 1_000_000;

    /// A controller that is on as soon as it is commanded on, and is asked nothing.
    #[derive(Debug)]
    struct QuietDevice;

    fn line(text: &str, out: &mut Text) -> bool {
        out.whole(|out| fmt::Write::write_str(out, text))
    }

    impl Dialect for QuietDevice {
        fn receive(&mut self, _line: &[u8], axis: &mut Axis, _now_ns: u64) {
            if let Motor::Off { confirmed, .. } = &mut axis.motor {
                *confirmed = true;
            }
        }

        fn ask_position(&self, _out: &mut Text) -> bool {
            false
        }

        fn drive(&self, _target: f64, out: &mut Text) {
            line("force\n", out);
        }

        fn watch_on(&mut self, _axis: &mut Axis, _now_ns: u64, _out: &mut Text) {}

        fn switch_off(&self, out: &mut Text) {
            line("off\n", out);
        }

        fn watch_off(&mut self, _axis: &mut Axis, _now_ns: u64, _out: &mut Text) {}

        fn begin_arming(&mut self) {}

        fn arm(&mut self, axis: &mut Axis, _now_ns: u64, _out: &mut Text) {
            axis.motor = Motor::On;
        }
    }

    #[test]
    fn switch_off_counts_once_sent_or_confirmed() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("board");
        let board = Port::plug_in(&path).expect("a terminal");
        let serial_line = SerialLine::open(&path, 1_000_000).expect("it is there");
        let mut now_ns = 1000 * MS;
        let scale = Scale {
            first_angle: 0.0,
            metres_per_angle: 1.0,
            resolution_m: 0.0,
            newtons_per_target: 1.0,
            target_limit: 1.0,
        };
        let conversation = Conversation::new(QuietDevice, scale, MS, now_ns, Arc::default());
        let mut connection = TextConnection::new(serial_line, conversation, Arc::default());
        assert_eq!(
            connection.write(1.0, true, now_ns),
            Ok(Written::Later),
            "it is switched on first"
        );
        // Nobody reads until the line takes no more.
        let fill = |connection: &mut TextConnection<QuietDevice>, now_ns: u64| {
            let full = (0..100_000).find(|_| connection.write(1.0, true, now_ns) == Ok(Written::Later));
            assert!(full.is_some_and(|writes| writes > 0), "nobody reads that much");
        };
        fill(&mut connection, now_ns);
        let mut off = |connection: &mut TextConnection<QuietDevice>, later_ns: u64| {
            now_ns += later_ns;
            connection.write(0.0, false, now_ns)
        };
        assert_eq!(off(&mut connection, MS), Ok(Written::Later), "there is no room");
        assert_eq!(off(&mut connection, MS), Ok(Written::Later), "nor was it sent before");
        let mut received = Vec::new();
        let read = |received: &mut Vec<u8>| board.read(|bytes| received.extend(bytes)).expect("it is there");
        read(&mut received);
        assert_eq!(
            off(&mut connection, MS),
            Ok(Written::Later),
            "there is room, and it is not commanded off yet"
        );
        assert_eq!(off(&mut connection, 10 * MS), Ok(Written::Taken), "sent again");
        assert_eq!(off(&mut connection, MS), Ok(Written::Taken), "that counts on");
        read(&mut received);
        assert!(
            received.ends_with(b"force\noff\n"),
            "{:?}",
            String::from_utf8_lossy(&received)
        );
        // A force, and then no room for the switching off, which the controller does by itself.
        assert_eq!(
            connection.write(1.0, true, now_ns),
            Ok(Written::Later),
            "it is switched on first"
        );
        fill(&mut connection, now_ns);
        assert_eq!(connection.write(0.0, false, now_ns), Ok(Written::Later));
        connection.conversation.take(Ok(b"it is off"), now_ns);
        assert_eq!(connection.write(0.0, false, now_ns), Ok(Written::Taken));
    }
}
