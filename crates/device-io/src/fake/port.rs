//! The place where a fake speaks, and its frames.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::fs::{Mode, OFlags, fcntl_setfl, fstat, open, stat};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The place of a fake's link.
#[derive(Clone, Debug)]
pub enum Place {
    /// Behind a pseudo-terminal of its own, at which this link is made to point.
    Pty(PathBuf),
    /// On a terminal that there is: the device's side of a USB serial function (/dev/ttyGS0), or
    /// one end of a cable.
    Tty(PathBuf),
    /// On the device's side of a USB HID function (/dev/hidg0).
    Hid(PathBuf),
}

impl Place {
    /// The path of the link or the node.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Pty(path) | Self::Tty(path) | Self::Hid(path) => path,
        }
    }
}

/// The place is no longer there.
#[derive(Debug)]
pub struct PortClosed;

/// Reports that wait for the host to ask for them; a device has little room.
const MAX_UNSENT: usize = 16;

/// A place, opened. Dropping it hangs up.
#[derive(Debug)]
pub struct Port {
    place: Place,
    node: OwnedFd,
    /// Bytes of a frame of the host's, as they come.
    begun: Vec<u8>,
    unsent: VecDeque<Vec<u8>>,
}

impl Port {
    /// Opens a place.
    ///
    /// # Errors
    /// It is not there, the system has no pseudo-terminal left, or the link cannot be made.
    pub fn open(place: Place) -> io::Result<Self> {
        let node = match &place {
            Place::Pty(link) => plug_in(link)?,
            Place::Tty(path) | Place::Hid(path) => {
                let flags = OFlags::RDWR | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
                let node = open(path, flags, Mode::empty())?;
                make_raw(&node)?;
                node
            }
        };
        Ok(Self {
            place,
            node,
            begun: Vec::new(),
            unsent: VecDeque::new(),
        })
    }

    /// Opens a pseudo-terminal, and makes a path point at it.
    ///
    /// # Errors
    /// The system has no terminal left, or the link cannot be made.
    pub fn plug_in(link: &Path) -> io::Result<Self> {
        Self::open(Place::Pty(link.to_owned()))
    }

    /// Reads the bytes of its user, in pieces; on HID each piece is a report. Never waits.
    ///
    /// # Errors
    /// The place is gone.
    pub fn read(&self, mut take: impl FnMut(&[u8])) -> Result<(), PortClosed> {
        let mut buffer = [0; 1024];
        loop {
            match (rustix::io::read(&self.node, &mut buffer), &self.place) {
                // Nobody has the other end open, who may come again.
                (Ok(0) | Err(Errno::IO), Place::Pty(_)) | (Err(Errno::AGAIN), _) => return Ok(()),
                (Ok(0), _) => return Err(PortClosed),
                (Ok(count), _) => take(&buffer[..count]),
                (Err(Errno::INTR), _) => {}
                (Err(_), _) => return Err(PortClosed),
            }
        }
    }

    /// Passes each frame that has come on, with the byte that ends it; on HID each report.
    ///
    /// # Errors
    /// The place is gone.
    pub fn read_frames(&mut self, end: u8, mut each: impl FnMut(Vec<u8>)) -> Result<(), PortClosed> {
        let mut begun = std::mem::take(&mut self.begun);
        let read = self.read(|bytes| {
            if let Place::Hid(_) = self.place {
                return each(bytes.to_vec());
            }
            for &byte in bytes {
                begun.push(byte);
                if byte == end {
                    each(std::mem::take(&mut begun));
                }
            }
        });
        self.begun = begun;
        read
    }

    /// Sends a frame. A frame that does not fit is lost, as on a line that nobody reads.
    ///
    /// # Errors
    /// The place is gone.
    pub fn write(&mut self, frame: &[u8]) -> Result<(), PortClosed> {
        if self.unsent.len() < MAX_UNSENT {
            self.unsent.push_back(frame.to_vec());
        }
        self.flush()
    }

    /// Sends the waiting frames.
    ///
    /// # Errors
    /// The place is gone.
    pub fn flush(&mut self) -> Result<(), PortClosed> {
        while let Some(frame) = self.unsent.front() {
            match (rustix::io::write(&self.node, frame), &self.place) {
                // The host asks for one report at a time.
                (Err(Errno::AGAIN), Place::Hid(_)) => return Ok(()),
                (Ok(_) | Err(Errno::AGAIN | Errno::INTR), _) | (Err(Errno::IO), Place::Pty(_)) => {
                    self.unsent.pop_front();
                }
                (Err(_), _) => return Err(PortClosed),
            }
        }
        Ok(())
    }

    /// Whether its node is still the one that was opened: reading the node of a function that has
    /// left the bus gives no error.
    #[must_use]
    pub fn is_there(&self) -> bool {
        let Place::Hid(path) = &self.place else { return true };
        match (fstat(&self.node), stat(path)) {
            (Ok(opened), Ok(there)) => (opened.st_dev, opened.st_ino) == (there.st_dev, there.st_ino),
            _ => false,
        }
    }

    /// Waits for bytes, or room for the waiting frames, at most for the timeout; without a port or a user of it, for
    /// the whole timeout.
    pub fn wait(port: Option<&Self>, timeout: Duration) {
        let until = Timespec::try_from(timeout).ok();
        let mut polled: Vec<PollFd<'_>> = port
            .iter()
            .map(|port| {
                let room = if port.unsent.is_empty() {
                    PollFlags::empty()
                } else {
                    PollFlags::OUT
                };
                PollFd::new(&port.node, PollFlags::IN | room)
            })
            .collect();
        if poll(&mut polled, until.as_ref()).is_err() {
            // Interrupted: the caller looks again.
        }
        if polled.iter().any(|polled| polled.revents().contains(PollFlags::HUP)) {
            // Nobody has the other end open, which a poll does not wait for.
            std::thread::sleep(timeout);
        }
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        if let Place::Pty(link) = &self.place {
            // The link is gone already, or belongs to somebody else: nothing depends on it.
            drop(std::fs::remove_file(link));
        }
    }
}

/// The controlling end of a new pseudo-terminal, which never blocks; a path is made to point at the
/// other.
fn plug_in(link: &Path) -> io::Result<OwnedFd> {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    // Until its user sets it up, the terminal would echo what we say.
    make_raw(&master)?;
    fcntl_setfl(&master, OFlags::NONBLOCK)?;
    let name = ptsname(&master, Vec::new())?;
    let name = PathBuf::from(name.to_string_lossy().into_owned());
    // In one step, so that no half link is ever found.
    let mut fresh = link.as_os_str().to_owned();
    fresh.push(".new");
    let fresh = PathBuf::from(fresh);
    if fresh.symlink_metadata().is_ok() {
        std::fs::remove_file(&fresh)?;
    }
    std::os::unix::fs::symlink(name, &fresh)?;
    std::fs::rename(&fresh, link)?;
    Ok(master)
}

/// Makes a terminal pass bytes on unchanged. A node that is not a terminal does so by itself.
fn make_raw(node: &OwnedFd) -> io::Result<()> {
    match tcgetattr(node) {
        Ok(mut settings) => {
            settings.make_raw();
            Ok(tcsetattr(node, OptionalActions::Now, &settings)?)
        }
        Err(Errno::NOTTY | Errno::INVAL) => Ok(()),
        Err(error) => Err(error.into()),
    }
}
