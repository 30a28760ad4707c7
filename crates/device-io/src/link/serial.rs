//! A rig on a serial line: a USB one (CDC-ACM), one behind a converter (FTDI and its like), or a pseudo-terminal.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use super::health::{LinkCounters, LinkError, add};
use super::identity::RigIdentity;
use super::keeper::{ConnectError, Connector, Greeted};
use super::nodes::folder_of;
use super::session::{Refused, Session};
use super::wire::{self, Wire};
use super::{Connection, clock};
use crate::device::{DeviceError, Measurement, Written};
use crate::protocol::frame::{Decoder, Frame, LONGEST_FRAME};
use crate::protocol::message::{FromDevice, FromHost, MessageError};
use crate::protocol::view::View;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::{AsFd, FromRawFd, IntoRawFd, OwnedFd};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::io::Errno;
use rustix::termios::{QueueSelector, tcflush};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;

/// Bytes read at once; more than a line of 1 Mbaud brings in a tick.
const READ: usize = 512;

/// Reads in a tick, at most: a line that brings more than it can has gone mad, and the rest waits for the next tick.
const MOST_READS: usize = 8;

/// A line that takes nothing for so long is not read by anybody, ns.
const STUCK_NS: u64 = 100_000_000;

/// Bytes that may be sent at once: two frames, or a tick's lines of text.
pub(crate) const MOST_AT_ONCE: usize = 256;

/// A serial line, opened.
#[derive(Debug)]
pub(crate) struct Line {
    fd: OwnedFd,
    /// Of a frame that the line took only in part: what is left.
    rest: [u8; MOST_AT_ONCE],
    rest_length: usize,
    stuck_since_ns: Option<u64>,
    /// Why it was last given up.
    failure: Option<LinkError>,
}

/// What became of bytes to be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sent {
    /// The system has all of them.
    Taken,
    /// The system has some of them; the rest goes first the next time.
    Begun,
    /// There was no room, and nothing of them was sent.
    NoRoom,
}

impl Line {
    /// Opens a line for this process alone, without waiting for anything.
    pub(crate) fn open(path: &Path, baud: u32) -> Result<Self, ConnectError> {
        let refused = |why: String, remedy: String| ConnectError::Refused {
            what: path.display().to_string(),
            why,
            remedy,
        };
        let Ok(target) = path.canonicalize() else {
            return Err(ConnectError::Absent {
                what: path.display().to_string(),
            });
        };
        let name = target.to_string_lossy().into_owned();
        let port = serialport::new(&name, baud)
            .timeout(Duration::ZERO)
            .open_native()
            .map_err(|error| match error.kind() {
                serialport::ErrorKind::Io(std::io::ErrorKind::NotFound) => ConnectError::Absent {
                    what: path.display().to_string(),
                },
                serialport::ErrorKind::Io(std::io::ErrorKind::PermissionDenied) => {
                    refused(error.to_string(), permission_remedy(&target))
                }
                _ if is_busy(&error) => refused(
                    error.to_string(),
                    format!("another program has it open: `fuser -v {name}` names it"),
                ),
                _ => refused(
                    error.to_string(),
                    "is it a serial line, and does it know this baud rate?".to_owned(),
                ),
            })?;
        // SAFETY: the port gives its descriptor away, and nobody else has it.
        #[expect(unsafe_code, reason = "a raw descriptor is taken over")]
        let fd = unsafe { OwnedFd::from_raw_fd(port.into_raw_fd()) };
        let line = Self {
            fd,
            rest: [0; MOST_AT_ONCE],
            rest_length: 0,
            stuck_since_ns: None,
            failure: None,
        };
        line.prepare()
            .map_err(|error| refused(error.to_string(), "unplug it and plug it in again".to_owned()))?;
        Ok(line)
    }

    fn prepare(&self) -> Result<(), Errno> {
        // serialport sets it back when it opens.
        fcntl_setfl(&self.fd, fcntl_getfl(&self.fd)? | OFlags::NONBLOCK)?;
        super::low_latency::ask(self.fd.as_fd());
        // What lay there from before is not for us.
        tcflush(&self.fd, QueueSelector::IOFlush)
    }

    /// Whether something that the system has in part is still to go.
    pub(crate) fn has_rest(&self) -> bool {
        self.rest_length > 0
    }

    /// Reads what there is, and gives it away in pieces. Never waits.
    ///
    /// # Errors
    /// The line has been hung up.
    pub(crate) fn read(&mut self, mut take: impl FnMut(&[u8])) -> Result<(), DeviceError> {
        let mut buffer = [0; READ];
        for _ in 0..MOST_READS {
            match rustix::io::read(&self.fd, &mut buffer) {
                // The end of a line is its hanging up.
                Ok(0) => return Err(self.fail(LinkError::HungUp)),
                Ok(count) => {
                    take(&buffer[..count]);
                    if count < READ {
                        return Ok(());
                    }
                }
                Err(Errno::AGAIN) => return Ok(()),
                Err(Errno::INTR) => {}
                Err(error) => return Err(self.fail(LinkError::Read(error.raw_os_error()))),
            }
        }
        Ok(())
    }

    fn fail(&mut self, failure: LinkError) -> DeviceError {
        self.failure = Some(failure);
        DeviceError::Disconnected
    }

    /// Notes why it was given up, if it was.
    pub(crate) fn note_failure(&mut self, counters: &LinkCounters, now_ns: u64) {
        if let Some(failure) = self.failure.take() {
            counters.note_error(failure, now_ns);
        }
    }

    /// Waits until there is something to read, for so long at most, ns.
    pub(crate) fn wait(&self, timeout_ns: u64) {
        let timeout = Timespec {
            tv_sec: 0,
            tv_nsec: i64::try_from(timeout_ns.min(999_999_999)).unwrap_or(0),
        };
        if poll(&mut [PollFd::new(&self.fd, PollFlags::IN)], Some(&timeout)).is_err() {
            // The read that follows knows more.
        }
    }

    /// Sends bytes whole or not at all, at a time of ours. Never waits: of what the line takes only in part, the rest goes first the next time.
    ///
    /// # Errors
    /// The line has been hung up, or has taken nothing for long.
    pub(crate) fn write(&mut self, bytes: &[u8], now_ns: u64) -> Result<Sent, DeviceError> {
        while self.rest_length > 0 {
            let Some(written) = self.try_write_rest()? else {
                return self.no_room(now_ns);
            };
            self.rest.copy_within(written..self.rest_length, 0);
            self.rest_length -= written;
        }
        let written = match rustix::io::write(&self.fd, bytes) {
            Ok(written) => written,
            Err(Errno::AGAIN | Errno::INTR) => return self.no_room(now_ns),
            Err(error) => return Err(self.fail(LinkError::Write(error.raw_os_error()))),
        };
        self.stuck_since_ns = None;
        let rest = bytes.get(written..).unwrap_or_default();
        // No more is ever sent at once.
        let length = rest.len().min(self.rest.len());
        self.rest[..length].copy_from_slice(&rest[..length]);
        self.rest_length = length;
        Ok(if length == 0 { Sent::Taken } else { Sent::Begun })
    }

    fn try_write_rest(&mut self) -> Result<Option<usize>, DeviceError> {
        match rustix::io::write(&self.fd, &self.rest[..self.rest_length]) {
            Ok(0) | Err(Errno::AGAIN | Errno::INTR) => Ok(None),
            Ok(written) => Ok(Some(written)),
            Err(error) => Err(self.fail(LinkError::Write(error.raw_os_error()))),
        }
    }

    fn no_room(&mut self, now_ns: u64) -> Result<Sent, DeviceError> {
        let since = *self.stuck_since_ns.get_or_insert(now_ns);
        if now_ns.saturating_sub(since) > STUCK_NS {
            return Err(self.fail(LinkError::Stuck));
        }
        Ok(Sent::NoRoom)
    }
}

/// How to be allowed to open a line.
pub(crate) fn permission_remedy(line: &Path) -> String {
    format!(
        "add the user to the group of {} (`sudo usermod -aG dialout $USER`, then log in again)",
        line.display()
    )
}

fn is_busy(error: &serialport::Error) -> bool {
    error.kind() == serialport::ErrorKind::NoDevice
        || error.to_string().contains("busy")
        || matches!(
            error.kind(),
            serialport::ErrorKind::Io(std::io::ErrorKind::ResourceBusy)
        )
}

/// Reads the messages in bytes of a line.
#[derive(Debug, Default)]
pub(super) struct Reader(Decoder);

impl Reader {
    pub(super) fn take(&mut self, bytes: &[u8], mut each: impl FnMut(Result<FromDevice, Refused>)) {
        for &byte in bytes {
            if let Some(frame) = self.0.push(byte) {
                each(frame.map_err(Refused::Frame).and_then(|message| {
                    View::whole(message)
                        .map_err(MessageError::from)
                        .and_then(FromDevice::read)
                        .map_err(Refused::Message)
                }));
            }
        }
    }
}

/// A serial line and the messages on it.
#[derive(Debug)]
struct SerialWire {
    line: Line,
    reader: Reader,
}

impl Wire for SerialWire {
    fn say_hello(&mut self, hello: FromHost) -> Result<(), DeviceError> {
        // What a board has half received before its reset ends with this zero.
        let mut frame = vec![0];
        frame.extend(Frame::of(hello.bytes().as_slice()).as_slice());
        self.line.write(&frame, clock::now_ns()).map(|_| ())
    }

    fn wait(&self, timeout_ns: u64) {
        self.line.wait(timeout_ns);
    }

    fn hear(&mut self, mut each: impl FnMut(Result<FromDevice, Refused>)) -> Result<usize, DeviceError> {
        let Self { line, reader } = self;
        let mut heard = 0;
        line.read(|bytes| {
            heard += bytes.len();
            reader.take(bytes, &mut each);
        })?;
        Ok(heard)
    }
}

/// Finds and greets a rig on a serial line.
#[derive(Debug)]
pub struct SerialConnector {
    path: PathBuf,
    baud: u32,
}

impl SerialConnector {
    /// A line by its path, which may be a symbolic link, at a rate.
    #[must_use]
    pub fn new(path: PathBuf, baud: u32) -> Self {
        Self { path, baud }
    }
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

    fn connect(&mut self, period_ns: u64, counters: &Arc<LinkCounters>) -> Result<Greeted, ConnectError> {
        let mut wire = SerialWire {
            line: Line::open(&self.path, self.baud)?,
            reader: Reader::default(),
        };
        let _asking = counters.ask(clock::now_ns());
        let hello = wire::greet(
            &mut wire,
            &self.path.display().to_string(),
            |heard_bytes| match heard_bytes {
                0 => "nothing answers; is it the right line, and does its firmware speak the link protocol?".to_owned(),
                _ => format!(
                    "{heard_bytes} bytes came and no answer; is {} baud its rate, and does its firmware speak the link protocol?",
                    self.baud
                ),
            },
        )?;
        Ok(Greeted {
            firmware: hello.firmware_name(),
            force_limit_n: f64::from(hello.force_limit_mn) * 1e-3,
            sample_rate_hz: f64::from(hello.sample_rate_hz),
            watchdog_ms: hello.watchdog(),
            rig: RigIdentity::of_line("serial", &self.path),
            connection: Box::new(SerialConnection {
                wire,
                session: Session::new(&hello, period_ns, clock::now_ns(), Arc::clone(counters)),
                counters: Arc::clone(counters),
                wait_ns: period_ns / 4,
            }),
        })
    }
}

/// A rig on a serial line, greeted.
#[derive(Debug)]
struct SerialConnection {
    wire: SerialWire,
    session: Session,
    counters: Arc<LinkCounters>,
    /// For a sample that is about to come, ns.
    wait_ns: u64,
}

impl Connection for SerialConnection {
    fn read(&mut self, now_ns: u64) -> Result<Option<Measurement>, DeviceError> {
        let read = wire::measurement(&mut self.wire, &mut self.session, self.wait_ns, now_ns);
        self.wire.line.note_failure(&self.counters, now_ns);
        read
    }

    fn write(&mut self, force_n: f64, enabled: bool, now_ns: u64) -> Result<Written, DeviceError> {
        let (enable, command) = self.session.command(force_n, enabled, now_ns);
        let mut bytes = [0; 2 * LONGEST_FRAME];
        let mut length = 0;
        for message in enable.iter().chain([&command]) {
            let frame = Frame::of(message.bytes().as_slice());
            let frame = frame.as_slice();
            bytes[length..length + frame.len()].copy_from_slice(frame);
            length += frame.len();
        }
        let sent = self.wire.line.write(&bytes[..length], now_ns);
        self.wire.line.note_failure(&self.counters, now_ns);
        match sent? {
            Sent::Taken => return Ok(Written::Taken),
            Sent::Begun => {}
            Sent::NoRoom => add(&self.counters.not_sent, 1),
        }
        Ok(Written::Later)
    }

    fn resolution_m(&self) -> f64 {
        self.session.resolution_m()
    }
}

impl Drop for SerialConnection {
    fn drop(&mut self) {
        if self.write(0.0, false, clock::now_ns()) != Ok(Written::Taken) {
            // Nobody hears the last word; the device's own watchdog does the rest.
        }
        self.counters.age_ns.store(0, Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::{Firmware, FirmwareProperties, Hand, RigProperties, Terminal};
    use crate::protocol::view::View;

    #[test]
    fn a_command_is_taken_only_once_the_line_has_all_of_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rig");
        let rig = Terminal::plug_in(&path).expect("a terminal");
        let mut firmware = Firmware::new(RigProperties::default(), Hand::Free, FirmwareProperties::default());
        let Some(FromDevice::Hello(hello)) = firmware.receive(FromHost::Hello { nonce: 1 }, 0) else {
            panic!("it answers");
        };
        let counters = Arc::new(LinkCounters::default());
        let now_ns = 1_000_000_000;
        let mut connection = SerialConnection {
            wire: SerialWire {
                line: Line::open(&path, 1_000_000).expect("it is there"),
                reader: Reader::default(),
            },
            session: Session::new(&hello, 1_000_000, now_ns, Arc::clone(&counters)),
            counters: Arc::clone(&counters),
            wait_ns: 0,
        };
        // Nobody reads until the line takes no more: of the last frame none or a part.
        let mut taken = 0;
        while connection.write(1.0, true, now_ns) == Ok(Written::Taken) {
            taken += 1;
            assert!(taken < 100_000, "nobody reads so much");
        }
        for _ in 0..3 {
            assert_eq!(connection.write(0.0, false, now_ns), Ok(Written::Later));
        }
        assert!(counters.not_sent.load(Relaxed) >= 3);
        let (mut decoder, mut heard) = (Decoder::default(), Vec::new());
        let mut read = |heard: &mut Vec<FromHost>| {
            let hear = |bytes: &[u8]| {
                for &byte in bytes {
                    if let Some(frame) = decoder.push(byte) {
                        let view = View::whole(frame.expect("whole")).expect("a message");
                        heard.push(FromHost::read(view).expect("from a host"));
                    }
                }
            };
            rig.read(hear).expect("it is there");
        };
        read(&mut heard);
        assert_eq!(connection.write(0.0, false, now_ns), Ok(Written::Taken));
        read(&mut heard);
        let zero = |message: &FromHost| {
            matches!(
                message,
                FromHost::Command {
                    force_mn: 0,
                    enabled: false,
                    ..
                }
            )
        };
        let zeros = heard.iter().filter(|message| zero(message)).count();
        assert!((1..=2).contains(&zeros) && zero(&heard[heard.len() - 1]), "{zeros}");
        assert!(heard.len() > taken);
    }
}
