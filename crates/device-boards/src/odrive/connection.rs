//! A controller on a serial line, greeted, as the real-time thread reads and writes it.

use super::conversation::{CommandState, Conversation};
use super::text::{Lines, Text};
use device_io::link::{Connection, LinkCounters, SendOutcome, SerialLine, add};
use device_io::{DeviceError, Measurement, Written, now_ns};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

/// A serial line and the conversation on it.
#[derive(Debug)]
pub(crate) struct TextConnection {
    line: SerialLine,
    lines: Lines,
    conversation: Conversation,
    counters: Arc<LinkCounters>,
    /// What became of the force, or the switching off, that was last sent.
    last_sent: SendOutcome,
}

impl TextConnection {
    pub(crate) fn new(line: SerialLine, conversation: Conversation, counters: Arc<LinkCounters>) -> Self {
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

impl Connection for TextConnection {
    fn read(&mut self, now_ns: u64) -> Result<Option<Measurement<[f64; 2]>>, DeviceError> {
        let Self {
            line,
            lines,
            conversation,
            ..
        } = self;
        let read = line.read(|bytes| lines.take(bytes, |line| conversation.take(line, now_ns)));
        line.note_failure(&self.counters, now_ns);
        read?;
        let measured = conversation.measurement(now_ns)?;
        Ok(Some(measured.at([measured.position_m, 0.0])))
    }

    fn write(&mut self, [force_n, _]: [f64; 2], enabled: bool, now_ns: u64) -> Result<Written, DeviceError> {
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

impl Drop for TextConnection {
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
    use super::super::dialect::ODriveDialect;
    use super::super::generation::Generation;
    use super::*;
    use crate::odrive::conversation::Scale;
    use device_io::fake::Port;

    const MS: u64 = 1_000_000;

    #[test]
    fn switch_off_counts_once_sent_or_confirmed() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("board");
        let board = Port::plug_in(&path).expect("a terminal");
        let line = SerialLine::open(&path, 1_000_000).expect("it is there");
        let mut now_ns = 1000 * MS;
        let scale = Scale {
            first_angle: 0.0,
            metres_per_angle: 1.0,
            resolution_m: 0.0,
            newtons_per_target: 1.0,
            target_limit: 1.0,
        };
        let generation = Generation::of([0.0, 5.0, 6.0]).expect("new enough");
        let dialect = ODriveDialect::new(0, generation);
        let conversation = Conversation::new(dialect, scale, MS, now_ns, Arc::default());
        let mut connection = TextConnection::new(line, conversation, Arc::default());
        let switch_on = |connection: &mut TextConnection, now_ns: u64| {
            let written = connection.write([1.0, 0.0], true, now_ns);
            assert_eq!(written, Ok(Written::Later), "it is switched on first");
            // Nobody reads until the line takes no more.
            let full = (0..100_000).find(|_| connection.line.write(b"noise\n", now_ns) != Ok(SendOutcome::Taken));
            assert!(full.is_some_and(|writes| writes > 0), "nobody reads that much");
        };
        switch_on(&mut connection, now_ns);
        let mut off = |connection: &mut TextConnection, later_ns: u64| {
            now_ns += later_ns;
            connection.write([0.0; 2], false, now_ns)
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
        received.clear();
        read(&mut received);
        let text = String::from_utf8_lossy(&received);
        assert!(text.contains("w axis0.requested_state 1 *"), "{text}");
        // No room for the switching off, which the controller does by itself.
        now_ns += 100 * MS;
        switch_on(&mut connection, now_ns);
        assert_eq!(connection.write([0.0; 2], false, now_ns), Ok(Written::Later));
        // Nothing is asked while the answer to a question of before may come.
        assert_eq!(connection.write([0.0; 2], false, now_ns), Ok(Written::Later));
        now_ns += 41 * MS;
        assert_eq!(connection.write([0.0; 2], false, now_ns), Ok(Written::Later));
        // The answer to the question for its state: idle.
        connection.conversation.take(Ok(b"1*49"), now_ns);
        assert_eq!(connection.write([0.0; 2], false, now_ns), Ok(Written::Taken));
    }
}
