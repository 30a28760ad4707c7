//! A program on a terminal of its own, and what somebody in front of it sees.

use crate::PATIENCE;
use crate::process::Killed;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Action, LocalModes, Winsize, tcflow, tcgetattr, tcsetwinsize};
use std::fs::File;
use std::io::{Read, Write};
use std::num::NonZeroU16;
use std::os::fd::OwnedFd;
use std::process::{Command, ExitStatus, Stdio};
use std::time::Instant;

const ROWS: u16 = 24;
const COLUMNS: u16 = 80;

/// A terminal of 80 columns and 24 lines with a program on it. The program is killed when the test ends.
pub struct Terminal {
    child: Killed,
    master: File,
    /// Kept open, so that what the program has set of the terminal can be looked at after its end.
    slave: OwnedFd,
    screen: vt100::Parser,
    written: Vec<u8>,
}

impl Terminal {
    /// Starts a program.
    pub fn start(mut command: Command) -> Self {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a terminal");
        grantpt(&master).expect("granted");
        unlockpt(&master).expect("unlocked");
        let name = ptsname(&master, Vec::new()).expect("its name");
        let slave = rustix::fs::open(name, OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).expect("its other end");
        tcsetwinsize(
            &slave,
            Winsize {
                ws_row: ROWS,
                ws_col: COLUMNS,
                ws_xpixel: 0,
                ws_ypixel: 0,
            },
        )
        .expect("its size");
        let handle = || Stdio::from(slave.try_clone().expect("another handle"));
        let child = command
            .env("TERM", "xterm-256color")
            .stdin(handle())
            .stdout(handle())
            .stderr(handle())
            .spawn()
            .expect("the program starts");
        let size = |of| NonZeroU16::new(of).expect("not zero");
        Self {
            child: Killed(child),
            master: master.into(),
            slave,
            screen: vt100::Parser::new(size(ROWS), size(COLUMNS), 0),
            written: Vec::new(),
        }
    }

    /// The process.
    pub fn pid(&self) -> rustix::process::Pid {
        rustix::process::Pid::from_child(&self.child)
    }

    /// Types.
    pub fn type_in(&mut self, keys: &str) {
        self.master.write_all(keys.as_bytes()).expect("typed");
    }

    /// Takes nothing that is written from here on, as when somebody selects text or the network stands still.
    pub fn stop_output(&self) {
        tcflow(&self.slave, Action::OOff).expect("it stops");
    }

    /// Takes again what is written.
    pub fn resume_output(&self) {
        tcflow(&self.slave, Action::OOn).expect("it goes on");
    }

    /// What is on the screen.
    pub fn screen(&self) -> &vt100::Screen {
        self.screen.screen()
    }

    /// Everything that was written to the terminal so far.
    pub fn written(&self) -> String {
        String::from_utf8_lossy(&self.written).into_owned()
    }

    /// Waits until what is on the screen is as wanted, and returns its text.
    pub fn wait_for(&mut self, what: &str, wanted: impl Fn(&str) -> bool) -> String {
        let began = Instant::now();
        loop {
            let shown = self.screen().contents();
            if wanted(&shown) {
                return shown;
            }
            assert!(began.elapsed() < PATIENCE, "waited in vain for {what}:\n{shown}");
            self.read();
        }
    }

    /// Waits for the end of the program, and reads what it still wrote.
    pub fn end(&mut self) -> ExitStatus {
        let began = Instant::now();
        loop {
            let ended = self.child.try_wait().expect("it is ours");
            let quiet = !self.read();
            if let Some(status) = ended
                && quiet
            {
                return status;
            }
            assert!(began.elapsed() < PATIENCE, "the program does not end");
        }
    }

    /// Whether the terminal edits lines and shows what is typed, as a shell finds it.
    pub fn is_as_a_shell_wants_it(&self) -> bool {
        let modes = tcgetattr(&self.slave).expect("its modes").local_modes;
        modes.contains(LocalModes::ICANON | LocalModes::ECHO | LocalModes::ISIG)
            && !self.screen().alternate_screen()
            && !self.screen().hide_cursor()
    }

    /// Takes in what was written, and says whether there was anything for a tenth of a second.
    pub fn read(&mut self) -> bool {
        let mut ready = [PollFd::new(&self.master, PollFlags::IN)];
        let a_while = Timespec {
            tv_sec: 0,
            tv_nsec: 100_000_000,
        };
        if poll(&mut ready, Some(&a_while)).expect("it can be waited for") == 0 {
            return false;
        }
        // Little at a time: a test that waits for a picture sees it also where a busy machine lets all
        // of them be written before it looks.
        let mut bytes = [0; 64];
        let Ok(read) = self.master.read(&mut bytes) else {
            // The program was the leader of the terminal's session, and has ended.
            return false;
        };
        self.screen.process(&bytes[..read]);
        self.written.extend_from_slice(&bytes[..read]);
        read > 0
    }
}
