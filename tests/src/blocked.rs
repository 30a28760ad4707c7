//! Outputs that take nothing: a full pipe, and a terminal that is held; and daemons that have them.

use crate::process::Killed;
use crate::{be_patient, binary, until_some};
use haptic_ipc::Client;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, fcntl_getfl, fcntl_setfl};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Action, tcflow};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// An output on which every write waits, for as long as this is there.
#[derive(Debug)]
pub struct Blocked {
    /// What a program is given.
    end: OwnedFd,
    /// The other end, from which nobody reads.
    _other: OwnedFd,
}

impl Blocked {
    /// A pipe that is full.
    pub fn pipe() -> Self {
        let (other, end) = std::io::pipe().expect("a pipe");
        let (other, end) = (OwnedFd::from(other), OwnedFd::from(end));
        fill(&end);
        Self { end, _other: other }
    }

    /// A terminal that is held, as by Ctrl-S.
    pub fn terminal() -> Self {
        let other = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a terminal");
        grantpt(&other).expect("granted");
        unlockpt(&other).expect("unlocked");
        let name = ptsname(&other, Vec::new()).expect("its name");
        let end = rustix::fs::open(name, OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).expect("its other end");
        tcflow(&end, Action::OOff).expect("held");
        let blocked = Self { end, _other: other };
        assert!(!blocked.takes_something(), "it is held");
        blocked
    }

    fn stdio(&self) -> Stdio {
        self.end.try_clone().expect("another handle").into()
    }

    /// Whether a write would not wait now.
    pub fn takes_something(&self) -> bool {
        let at_once = Timespec { tv_sec: 0, tv_nsec: 0 };
        poll(&mut [PollFd::new(&self.end, PollFlags::OUT)], Some(&at_once)).expect("it can be asked") > 0
    }
}

/// Writes until nothing more fits.
fn fill(end: &OwnedFd) {
    let flags = fcntl_getfl(end).expect("its flags");
    fcntl_setfl(end, flags | OFlags::NONBLOCK).expect("they can be set");
    loop {
        match rustix::io::write(end, &[b'.'; 4096]) {
            Ok(_) => {}
            Err(Errno::AGAIN) => break,
            Err(error) => panic!("{error}"),
        }
    }
    fcntl_setfl(end, flags).expect("they can be set");
}

/// A daemon whose outputs nobody reads.
#[derive(Debug)]
pub struct Mute {
    /// The process.
    pub child: Killed,
    /// Its control socket.
    pub socket: PathBuf,
    _directory: tempfile::TempDir,
}

impl Mute {
    /// Starts one whose outputs are blocked, or go nowhere.
    pub fn start(arguments: &[&str], output: Option<&Blocked>) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let socket = directory.path().join("run/control.sock");
        let mut command = Command::new(binary("hapticd"));
        command.args(arguments);
        be_patient(&mut command);
        let stdio = || output.map_or_else(Stdio::null, Blocked::stdio);
        command.arg("--socket").arg(&socket).stdin(Stdio::null());
        let child = command.stdout(stdio()).stderr(stdio()).spawn();
        Self {
            child: Killed(child.expect("hapticd starts")),
            socket,
            _directory: directory,
        }
    }

    /// A client, as soon as it serves.
    pub fn client(&self) -> Client {
        until_some("it does not serve", || Client::connect(&self.socket).ok())
    }
}
