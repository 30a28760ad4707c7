//! The pseudo-terminal behind which a fake rig or board speaks.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The controlling end of a pseudo-terminal, and the link that points at the other. Dropping it
/// hangs up.
#[derive(Debug)]
pub struct Terminal {
    master: OwnedFd,
    link: PathBuf,
}

impl Terminal {
    /// Makes one, and makes a path point at it.
    ///
    /// # Errors
    /// The system has no terminal left, or the link cannot be made.
    pub fn plug_in(link: &Path) -> io::Result<Self> {
        let master = plug_in(link)?;
        Ok(Self {
            master,
            link: link.to_owned(),
        })
    }

    /// Reads the bytes of its user, in pieces. Never waits.
    ///
    /// # Errors
    /// The terminal fails.
    pub fn read(&self, mut take: impl FnMut(&[u8])) -> io::Result<()> {
        let mut buffer = [0; 1024];
        loop {
            match rustix::io::read(&self.master, &mut buffer) {
                Ok(0) | Err(Errno::AGAIN | Errno::IO) => return Ok(()),
                Ok(count) => take(&buffer[..count]),
                Err(Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// Writes to its user. Bytes that do not fit are lost, as on a line that nobody reads.
    ///
    /// # Errors
    /// The terminal fails.
    pub fn write(&self, bytes: &[u8]) -> io::Result<()> {
        match rustix::io::write(&self.master, bytes) {
            Ok(_) | Err(Errno::AGAIN | Errno::IO | Errno::INTR) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Waits for bytes, at most for the timeout; without a terminal or a user of it, for the whole
    /// timeout.
    pub fn wait(terminal: Option<&Self>, timeout: Duration) {
        let until = Timespec::try_from(timeout).ok();
        let mut polled: Vec<PollFd<'_>> = terminal
            .iter()
            .map(|terminal| PollFd::new(&terminal.master, PollFlags::IN))
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

/// The controlling end of a new pseudo-terminal, which never blocks; a path is made to point at the
/// other.
///
/// # Errors
/// The system has no terminal left, or the link cannot be made.
pub fn plug_in(link: &Path) -> io::Result<OwnedFd> {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    // Until its user sets it up, the terminal would echo what we say.
    let mut settings = tcgetattr(&master)?;
    settings.make_raw();
    tcsetattr(&master, OptionalActions::Now, &settings)?;
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

impl Drop for Terminal {
    fn drop(&mut self) {
        // The link is gone already, or belongs to somebody else: nothing depends on it.
        drop(std::fs::remove_file(&self.link));
    }
}
