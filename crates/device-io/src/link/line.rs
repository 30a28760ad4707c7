//! A serial line that is open for this process alone. Only [`SerialLine::wait`] ever waits.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use super::connector::ConnectError;
use super::health::{LinkCounters, LinkError};
use super::remedy;
use crate::device::DeviceError;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::{AsRawFd, FromRawFd, IntoRawFd, OwnedFd};
use rustix::fs::{FlockOperation, OFlags, fcntl_getfl, fcntl_setfl, flock};
use rustix::io::Errno;
use rustix::termios::{QueueSelector, tcflush};
use std::path::Path;
use std::time::Duration;

/// Bytes read at once; more than a line of 1 Mbaud brings in a tick.
const READ: usize = 512;

/// Most reads in a tick: if a line brings more than it can carry, the rest waits for the next tick.
const MAX_READS: usize = 8;

/// Longest time without room, ns: after that nobody reads the line.
const STUCK_NS: u64 = 100_000_000;

/// Most bytes in one [`SerialLine::write`]: two frames, or a tick's lines of text.
pub const MAX_AT_ONCE: usize = 256;

/// An open serial line.
#[derive(Debug)]
pub struct SerialLine {
    fd: OwnedFd,
    /// The rest of a write that the line took only in part.
    rest: [u8; MAX_AT_ONCE],
    rest_length: usize,
    stuck_since_ns: Option<u64>,
    /// The last failure, until it is noted.
    failure: Option<LinkError>,
}

/// Outcome of a [`SerialLine::write`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SendOutcome {
    /// The system has all of them.
    Taken,
    /// The system has some of them; the rest goes first the next time.
    Begun,
    /// There was no room, and nothing of them was sent.
    NoRoom,
}

impl SerialLine {
    /// Opens a line for this process alone, at a rate in baud, without waiting for anything.
    ///
    /// # Errors
    /// The line is not there, in use, or not for this process.
    pub fn open(path: &Path, baud: u32) -> Result<Self, ConnectError> {
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
        // A pseudo-terminal stays closed to others (TIOCEXCL) after its user has closed it, until its other end closes.
        let is_pty = target.starts_with("/dev/pts");
        let port = serialport::new(&name, baud)
            .timeout(Duration::ZERO)
            .exclusive(!is_pty)
            .open_native()
            .map_err(|error| match error.kind() {
                serialport::ErrorKind::Io(std::io::ErrorKind::NotFound) => ConnectError::Absent {
                    what: path.display().to_string(),
                },
                serialport::ErrorKind::Io(std::io::ErrorKind::PermissionDenied) => {
                    refused(error.to_string(), remedy::serial_permission(&target))
                }
                _ if is_busy(&error) => refused(error.to_string(), remedy::busy(&target)),
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
            rest: [0; MAX_AT_ONCE],
            rest_length: 0,
            stuck_since_ns: None,
            failure: None,
        };
        line.prepare().map_err(|error| {
            refused(
                error.to_string(),
                match error {
                    Errno::WOULDBLOCK => remedy::busy(&target),
                    _ => "unplug it and plug it in again".to_owned(),
                },
            )
        })?;
        Ok(line)
    }

    fn prepare(&self) -> Result<(), Errno> {
        flock(&self.fd, FlockOperation::NonBlockingLockExclusive)?;
        // serialport clears this flag when it opens.
        fcntl_setfl(&self.fd, fcntl_getfl(&self.fd)? | OFlags::NONBLOCK)?;
        ask_low_latency(&self.fd);
        // Bytes from before are not for us.
        tcflush(&self.fd, QueueSelector::IOFlush)
    }

    /// Whether a rest of the last write is still to be sent.
    #[must_use]
    pub fn has_rest(&self) -> bool {
        self.rest_length > 0
    }

    /// Reads all bytes that have come, and passes them on in pieces. Never waits.
    ///
    /// # Errors
    /// The line has been hung up.
    pub fn read(&mut self, mut take: impl FnMut(&[u8])) -> Result<(), DeviceError> {
        let mut buffer = [0; READ];
        for _ in 0..MAX_READS {
            match rustix::io::read(&self.fd, &mut buffer) {
                // A line ends when it is hung up.
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

    /// Notes the last failure in the counters, if there is one.
    pub fn note_failure(&mut self, counters: &LinkCounters, now_ns: u64) {
        if let Some(failure) = self.failure.take() {
            counters.note_error(failure, now_ns);
        }
    }

    /// Waits for bytes, for a timeout at most, ns.
    pub fn wait(&self, timeout_ns: u64) {
        let timeout = Timespec {
            tv_sec: 0,
            tv_nsec: i64::try_from(timeout_ns.min(999_999_999)).unwrap_or(0),
        };
        if poll(&mut [PollFd::new(&self.fd, PollFlags::IN)], Some(&timeout)).is_err() {
            // The read that follows shows the result.
        }
    }

    /// Sends bytes whole or not at all, at a time of ours, ns. Never waits: if the line takes only
    /// a part of them, the next call sends the rest first.
    ///
    /// # Errors
    /// The line has been hung up, or has taken nothing for long.
    pub fn write(&mut self, bytes: &[u8], now_ns: u64) -> Result<SendOutcome, DeviceError> {
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
        // A write is never longer than that.
        let length = rest.len().min(self.rest.len());
        self.rest[..length].copy_from_slice(&rest[..length]);
        self.rest_length = length;
        Ok(if length == 0 {
            SendOutcome::Taken
        } else {
            SendOutcome::Begun
        })
    }

    fn try_write_rest(&mut self) -> Result<Option<usize>, DeviceError> {
        match rustix::io::write(&self.fd, &self.rest[..self.rest_length]) {
            Ok(0) | Err(Errno::AGAIN | Errno::INTR) => Ok(None),
            Ok(written) => Ok(Some(written)),
            Err(error) => Err(self.fail(LinkError::Write(error.raw_os_error()))),
        }
    }

    fn no_room(&mut self, now_ns: u64) -> Result<SendOutcome, DeviceError> {
        let since = *self.stuck_since_ns.get_or_insert(now_ns);
        if now_ns.saturating_sub(since) > STUCK_NS {
            return Err(self.fail(LinkError::Stuck));
        }
        Ok(SendOutcome::NoRoom)
    }
}

fn is_busy(error: &serialport::Error) -> bool {
    error.kind() == serialport::ErrorKind::NoDevice
        || error.to_string().contains("busy")
        || matches!(
            error.kind(),
            serialport::ErrorKind::Io(std::io::ErrorKind::ResourceBusy)
        )
}

/// `struct serial_struct` of the kernel's interface (linux/serial.h), of which only the flags
/// matter here.
#[repr(C)]
struct SerialStruct {
    kind: libc::c_int,
    line: libc::c_int,
    port: libc::c_uint,
    irq: libc::c_int,
    flags: libc::c_int,
    /// The rest, with room to spare, which is returned unchanged.
    rest: [u64; 16],
}

const ASYNC_LOW_LATENCY: libc::c_int = 1 << 13;

/// Asks a converter not to collect bytes before it passes them on: one by FTDI waits 16 ms by default, and 1 ms with
/// this setting. CDC-ACM collects nothing, and a pseudo-terminal does not know the request: neither is an error.
#[expect(unsafe_code, reason = "these two requests have no safe wrapper")]
fn ask_low_latency(line: &OwnedFd) {
    let mut serial = SerialStruct {
        kind: 0,
        line: 0,
        port: 0,
        irq: 0,
        flags: 0,
        rest: [0; 16],
    };
    // SAFETY: the kernel writes its own, shorter structure to the beginning of this one, and reads
    // it from there.
    unsafe {
        if libc::ioctl(line.as_raw_fd(), libc::TIOCGSERIAL, &raw mut serial) == 0 {
            serial.flags |= ASYNC_LOW_LATENCY;
            libc::ioctl(line.as_raw_fd(), libc::TIOCSSERIAL, &raw const serial);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::Port;

    #[test]
    fn pty_opens_for_one_at_a_time_and_again_after_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rig");
        let _rig = Port::plug_in(&path).expect("a terminal");
        let first = SerialLine::open(&path, 1_000_000).expect("nobody has it");
        let Err(ConnectError::Refused { remedy, .. }) = SerialLine::open(&path, 1_000_000) else {
            panic!("it is in use");
        };
        assert!(remedy.contains("fuser -v"), "{remedy}");
        // A kill leaves the line without a close of ours. The superuser may open it in any case, so the flag is read.
        assert!(!is_exclusive(&first.fd));
        drop(first);
        SerialLine::open(&path, 1_000_000).expect("nobody has it any more");
    }

    #[expect(unsafe_code, reason = "this request has no safe wrapper")]
    fn is_exclusive(line: &OwnedFd) -> bool {
        let mut exclusive: libc::c_int = -1;
        // SAFETY: the kernel writes one number of this frame.
        assert_eq!(
            unsafe { libc::ioctl(line.as_raw_fd(), libc::TIOCGEXCL, &raw mut exclusive) },
            0
        );
        exclusive != 0
    }
}
