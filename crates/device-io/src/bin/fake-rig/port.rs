//! The place of the fake rig's link, and its frames.

use device_io::fake::plug_in;
use device_io::protocol::frame::{Decoder, Frame};
use device_io::protocol::message::FromHost;
use device_io::protocol::view::{Kind, View};
use rustix::event::PollFlags;
use rustix::fd::{AsFd, BorrowedFd, OwnedFd};
use rustix::fs::{Mode, OFlags, fstat, open, stat};
use rustix::io::Errno;
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};

/// The place of the rig's link.
#[derive(Clone, Debug)]
pub(crate) enum Place {
    /// Behind a pseudo-terminal of its own, at which this link is made to point.
    Pty(PathBuf),
    /// On a terminal that there is: the device's side of a USB serial function (/dev/ttyGS0), or
    /// one end of a cable.
    Tty(PathBuf),
    /// On the device's side of a USB HID function (/dev/hidg0).
    Hid(PathBuf),
}

impl Place {
    pub(crate) fn path(&self) -> &Path {
        match self {
            Self::Pty(path) | Self::Tty(path) | Self::Hid(path) => path,
        }
    }
}

/// What a host has said.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Heard {
    /// A message; of a command to two axes, with the force of the second, mN.
    Message(FromHost, i32),
    /// What is no message of a host, as the detail of the complaint: kind, version and length.
    Bad(u32),
}

impl Heard {
    /// Reads a message, which may be padded. Nothing for a message of a device: that is an echo on the line, and an answer
    /// to it would come back as well.
    fn read(bytes: &[u8], is_padded: bool, has_second_axis: bool) -> Option<Self> {
        let [kind, version, ..] = *bytes else { return None };
        if kind < Kind::HostHello as u8 {
            return None;
        }
        let (first, second_mn) = match bytes.split_at_checked(Kind::Command.length()) {
            Some((first, second)) if has_second_axis && kind == Kind::Command as u8 => {
                match second.first_chunk::<4>() {
                    Some(second_mn) if is_padded || second.len() == 4 => (first, i32::from_le_bytes(*second_mn)),
                    // A command for one axis, or none at all.
                    _ => (&bytes[..2], 0),
                }
            }
            _ => (bytes, 0),
        };
        let view = if is_padded {
            View::padded(first)
        } else {
            View::whole(first)
        };
        let message = view.ok().and_then(|view| FromHost::read(view).ok());
        let length = u32::try_from(bytes.len()).unwrap_or(0);
        Some(message.map_or(
            Self::Bad(u32::from(kind) | u32::from(version) << 8 | length << 16),
            |message| Self::Message(message, second_mn),
        ))
    }
}

/// The place is no longer there.
#[derive(Debug)]
pub(crate) struct PortClosed;

/// Bytes of a HID report.
const REPORT: usize = 64;

/// Reports that wait for the host to ask for them; a device has little room.
const MAX_UNSENT: usize = 16;

/// A place, opened.
#[derive(Debug)]
pub(crate) struct Port {
    place: Place,
    node: OwnedFd,
    /// Bytes of a frame of the host's, as they come.
    raw: Vec<u8>,
    from_host: Decoder,
    unsent: VecDeque<Vec<u8>>,
}

impl Port {
    pub(crate) fn open(place: &Place) -> io::Result<Self> {
        let node = match place {
            Place::Pty(link) => plug_in(link)?,
            Place::Tty(path) | Place::Hid(path) => {
                let flags = OFlags::RDWR | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
                let node = open(path, flags, Mode::empty())?;
                make_raw(&node)?;
                node
            }
        };
        Ok(Self {
            place: place.clone(),
            node,
            raw: Vec::new(),
            from_host: Decoder::default(),
            unsent: VecDeque::new(),
        })
    }

    /// Passes each frame that has come on, as it came.
    pub(crate) fn read(&mut self, mut each: impl FnMut(Vec<u8>)) -> Result<(), PortClosed> {
        let mut buffer = [0; 1024];
        loop {
            match (rustix::io::read(&self.node, &mut buffer), &self.place) {
                // Nobody has the other end open, who may come again.
                (Ok(0) | Err(Errno::IO), Place::Pty(_)) => return Ok(()),
                (Ok(0), _) => return Err(PortClosed),
                (Ok(count), Place::Hid(_)) => each(buffer[..count].to_vec()),
                (Ok(count), _) => {
                    for &byte in &buffer[..count] {
                        self.raw.push(byte);
                        if byte == 0 {
                            each(std::mem::take(&mut self.raw));
                        }
                    }
                }
                (Err(Errno::AGAIN), _) => return Ok(()),
                (Err(Errno::INTR), _) => {}
                (Err(_), _) => return Err(PortClosed),
            }
        }
    }

    /// What a frame says.
    pub(crate) fn decode(&mut self, frame: &[u8], has_second_axis: bool) -> Vec<Heard> {
        if let Place::Hid(_) = self.place {
            return Heard::read(frame, true, has_second_axis).into_iter().collect();
        }
        let mut heard = Vec::new();
        for &byte in frame {
            if let Some(Ok(message)) = self.from_host.push(byte) {
                heard.extend(Heard::read(message, false, has_second_axis));
            }
        }
        heard
    }

    /// The frame for a message's bytes.
    pub(crate) fn encode(&self, message: &[u8]) -> Vec<u8> {
        match self.place {
            Place::Hid(_) => {
                let mut report = message.to_vec();
                report.resize(REPORT, 0);
                report
            }
            Place::Pty(_) | Place::Tty(_) => Frame::of(message).as_slice().to_vec(),
        }
    }

    /// Sends a frame. A frame that does not fit is lost, as on a line that nobody reads.
    pub(crate) fn write(&mut self, frame: Vec<u8>) -> Result<(), PortClosed> {
        if self.unsent.len() < MAX_UNSENT {
            self.unsent.push_back(frame);
        }
        self.flush()
    }

    /// Sends the waiting frames.
    pub(crate) fn flush(&mut self) -> Result<(), PortClosed> {
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
    pub(crate) fn is_there(&self) -> bool {
        let Place::Hid(path) = &self.place else { return true };
        match (fstat(&self.node), stat(path)) {
            (Ok(opened), Ok(there)) => (opened.st_dev, opened.st_ino) == (there.st_dev, there.st_ino),
            _ => false,
        }
    }

    /// The events to wait for.
    pub(crate) fn events(&self) -> PollFlags {
        if self.unsent.is_empty() {
            PollFlags::IN
        } else {
            PollFlags::IN | PollFlags::OUT
        }
    }
}

impl AsFd for Port {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.node.as_fd()
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
