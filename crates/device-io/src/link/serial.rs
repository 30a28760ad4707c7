//! A rig on a serial line: USB (CDC-ACM), a converter (such as FTDI's), or a pseudo-terminal.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use super::connector::{ConnectError, Connector, GreetedDevice, LoopTiming};
use super::health::LinkCounters;
use super::identity::RigIdentity;
use super::line::{SendOutcome, SerialLine};
use super::nodes::folder_of;
use super::session::{Outgoing, RejectedInput};
use super::wire::{self, Wire};
use crate::address::DEFAULT_BAUD;
use crate::device::{DeviceError, Written, now_ns};
use crate::protocol::frame::{BadFrame, Decoder, Frame, MAX_FRAME};
use crate::protocol::message::{FromDevice, FromHost, MessageError};
use crate::protocol::view::{Axes, Kind, View};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes that frame a message: its CRC, one of the stuffing, and the zero at its end.
const FRAMING: usize = 6;

/// Checks that a line carries the commands of a loop at a rate, Hz.
pub(crate) fn check_commands(baud: u32, rate_hz: f64, axes: Axes) -> Result<(), String> {
    check_line(baud, "the loop sends", "rate", rate_hz, Kind::Command.length(axes))
}

/// Checks that a line at a rate, baud, carries a message of a length, bytes, so often, Hz.
#[expect(clippy::cast_precision_loss, reason = "the bytes of a message")]
fn check_line(baud: u32, who: &str, name: &str, rate_hz: f64, length: usize) -> Result<(), String> {
    // A byte takes ten bits with those that begin and end it.
    let carried = f64::from(baud) / 10.0;
    let bytes = (length + FRAMING) as f64;
    let sent = rate_hz * bytes;
    if sent <= carried {
        return Ok(());
    }
    Err(format!(
        "{baud} baud carry {carried:.0} bytes a second, and {who} {sent:.0} (messages of {bytes} bytes at {name} = \
         {rate_hz} Hz): lower {name} to {:.0} Hz or less, or name {:.0} baud or more in the address, which the device must \
         have, too",
        (carried / bytes).floor(),
        sent * 10.0
    ))
}

/// Whether the line at a node has a rate of its own: a pseudo-terminal has none, and a board with native USB (CDC-ACM)
/// ignores it.
fn has_rate(path: &Path) -> bool {
    let node = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    !node.starts_with("/dev/pts")
        && !node
            .file_name()
            .is_some_and(|name| name.as_encoded_bytes().starts_with(b"ttyACM"))
}

/// Decodes the messages in the bytes of a line.
#[derive(Debug, Default)]
pub(super) struct Reader(Decoder);

impl Reader {
    pub(super) fn take(&mut self, bytes: &[u8], mut each: impl FnMut(Result<FromDevice, RejectedInput>)) {
        for &byte in bytes {
            if let Some(frame) = self.0.push(byte) {
                each(frame.map_err(|BadFrame| RejectedInput::Frame).and_then(|message| {
                    View::whole(message)
                        .map_err(MessageError::from)
                        .and_then(FromDevice::read)
                        .map_err(RejectedInput::Message)
                }));
            }
        }
    }
}

/// A serial line and the messages on it.
#[derive(Debug)]
struct SerialWire {
    line: SerialLine,
    reader: Reader,
    /// The system has all of the command that was last sent.
    taken: bool,
}

impl SerialWire {
    fn open(path: &Path, baud: u32) -> Result<Self, ConnectError> {
        Ok(Self {
            line: SerialLine::open(path, baud)?,
            reader: Reader::default(),
            taken: false,
        })
    }
}

impl Wire for SerialWire {
    fn send_hello(&mut self, hello: FromHost) -> Result<(), DeviceError> {
        // This zero ends the part of a frame that the board received before its reset.
        let mut frame = vec![0];
        frame.extend(Frame::of(hello.bytes().as_slice()).as_slice());
        self.line.write(&frame, now_ns()).map(|_| ())
    }

    fn wait(&self, timeout_ns: u64) {
        self.line.wait(timeout_ns);
    }

    fn receive(&mut self, mut each: impl FnMut(Result<FromDevice, RejectedInput>)) -> Result<usize, DeviceError> {
        let Self { line, reader, .. } = self;
        let mut received = 0;
        line.read(|bytes| {
            received += bytes.len();
            reader.take(bytes, &mut each);
        })?;
        Ok(received)
    }

    fn send(&mut self, outgoing: Outgoing, now_ns: u64, _: &LinkCounters) -> Result<Option<Written>, DeviceError> {
        let mut bytes = [0; 2 * MAX_FRAME];
        let mut length = 0;
        for message in outgoing.messages() {
            let frame = Frame::of(message.bytes().as_slice());
            let frame = frame.as_slice();
            bytes[length..length + frame.len()].copy_from_slice(frame);
            length += frame.len();
        }
        // Where nothing is sent, what was sent before may still have a rest.
        if length > 0 || self.line.has_rest() {
            let sent = self.line.write(&bytes[..length], now_ns)?;
            self.taken = sent == SendOutcome::Taken;
            if sent == SendOutcome::NoRoom && length > 0 {
                return Ok(None);
            }
        }
        let is_other = outgoing == Outgoing::Withheld { repeats: false };
        Ok(Some(if self.taken && !is_other {
            Written::Taken
        } else {
            Written::Later
        }))
    }

    fn note_failure(&mut self, counters: &LinkCounters, now_ns: u64) {
        self.line.note_failure(counters, now_ns);
    }
}

/// Finds and greets a rig on a serial line.
#[derive(Debug)]
pub struct SerialConnector {
    /// The line, or a symbolic link to it.
    pub path: PathBuf,
    /// Its rate, baud.
    pub baud: u32,
}

impl Connector for SerialConnector {
    fn address(&self) -> String {
        format!("serial line {} at {} baud", self.path.display(), self.baud)
    }

    fn folder(&self) -> PathBuf {
        folder_of(&self.path)
    }

    fn concerns(&self, node: &OsStr) -> bool {
        self.path.file_name() == Some(node)
    }

    fn connect(&mut self, timing: LoopTiming, counters: &Arc<LinkCounters>) -> Result<GreetedDevice, ConnectError> {
        let mut wire = SerialWire::open(&self.path, self.baud)?;
        let _asking = counters.ask(now_ns());
        let hello = wire::greet(
            &mut wire,
            &self.path.display().to_string(),
            |received_bytes| match received_bytes {
                0 => "nothing answers; is it the right line, and does its firmware speak the link protocol?".to_owned(),
                _ => format!(
                    "{received_bytes} bytes came and no answer; is {} baud its rate, and does its firmware speak the \
                     link protocol?",
                    self.baud
                ),
            },
        )?;
        if self.baud < DEFAULT_BAUD || has_rate(&self.path) {
            let samples = if hello.wide {
                Kind::WideMeasurement
            } else {
                Kind::Measurement
            };
            let sample_rate_hz = f64::from(hello.sample_rate_hz);
            #[expect(clippy::cast_precision_loss, reason = "a period of milliseconds")]
            let rate_hz = 1e9 / timing.period_ns as f64;
            let length = samples.length(hello.axes());
            check_commands(self.baud, rate_hz, hello.axes())
                .and_then(|()| check_line(self.baud, "the device", "its sample rate", sample_rate_hz, length))
                .map_err(|why| ConnectError::Refused {
                    what: self.path.display().to_string(),
                    why,
                    remedy: "what a line does not carry waits in it, and acts too late".to_owned(),
                })?;
        }
        let rig = RigIdentity::of_line("serial", &self.path);
        Ok(wire::greeted(wire, &hello, rig, timing, counters))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::Port;
    use crate::link::connector::Connection;
    use crate::link::session::LinkSession;
    use crate::link::session::tests::{greeted_firmware, is_off};
    use crate::link::wire::WireConnection;
    use std::sync::atomic::Ordering::Relaxed;

    #[test]
    fn a_line_on_which_nothing_answers_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rig");
        let _rig = Port::plug_in(&path).expect("a terminal");
        let mut connector = SerialConnector {
            path,
            baud: DEFAULT_BAUD,
        };
        let answer = connector.connect(LoopTiming::default(), &Arc::default());
        let Err(ConnectError::Protocol { problem, .. }) = answer else {
            panic!("{answer:?}");
        };
        assert!(problem.contains("nothing answers"), "{problem}");
    }

    #[test]
    fn a_command_is_taken_only_once_the_line_has_all_of_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rig");
        let rig = Port::plug_in(&path).expect("a terminal");
        let (_, hello) = greeted_firmware(0);
        let counters = Arc::new(LinkCounters::default());
        let now_ns = 1_000_000_000;
        let mut connection = WireConnection {
            wire: SerialWire::open(&path, 1_000_000).expect("it is there"),
            session: LinkSession::new(&hello, LoopTiming::default(), now_ns, Arc::clone(&counters)),
            counters: Arc::clone(&counters),
            wait_ns: 0,
        };
        // Nobody reads until the line takes no more: of the last frame none or a part.
        let Some(force) = connection.session.command([1.0, 0.0], true, now_ns).messages().last() else {
            panic!("it is sent");
        };
        let frame = Frame::of(force.bytes().as_slice());
        let fills = |_: &usize| connection.wire.line.write(frame.as_slice(), now_ns) == Ok(SendOutcome::Taken);
        let taken = (0..100_000).take_while(fills).count();
        assert!((1..100_000).contains(&taken), "nobody reads that much");
        // Tried again in every tick, as it was not sent.
        for _ in 0..3 {
            assert_eq!(connection.write([0.0; 2], false, now_ns), Ok(Written::Later));
        }
        assert!(counters.not_sent.load(Relaxed) >= 3);
        let (mut decoder, mut received) = (Decoder::default(), Vec::new());
        let mut read = |received: &mut Vec<FromHost>| {
            let receive = |bytes: &[u8]| {
                for &byte in bytes {
                    if let Some(frame) = decoder.push(byte) {
                        let view = View::whole(frame.expect("whole")).expect("a message");
                        received.push(FromHost::read(view).expect("from a host"));
                    }
                }
            };
            rig.read(receive).expect("it is there");
        };
        read(&mut received);
        assert_eq!(connection.write([0.0; 2], false, now_ns), Ok(Written::Taken));
        read(&mut received);
        let zeros = received.iter().filter(|message| is_off(message)).count();
        let is_last = received.last().is_some_and(is_off);
        assert!((1..=2).contains(&zeros) && is_last, "{zeros}");
        assert!(received.len() > taken);
    }
}
