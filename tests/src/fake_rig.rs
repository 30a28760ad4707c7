//! The fake rig behind a pseudo-terminal, as a program of its own.
#![allow(unsafe_code, reason = "a priority and an end are set between fork and exec")]

use crate::{Daemon, binary, pull_until, wait_for_state};
use haptic_ipc::{Client, RigState};
use rustix::process::{Pid, Signal, kill_process, set_parent_process_death_signal};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};

/// A running fake rig. It ends with the test.
#[derive(Debug)]
pub struct FakeRig {
    child: Child,
    asks: ChildStdin,
    answers: BufReader<ChildStdout>,
    link: PathBuf,
    _directory: Option<tempfile::TempDir>,
}

/// What the motor of a fake rig does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorForce {
    /// Now, N.
    pub now_n: f64,
    /// The largest since it was last asked, N.
    pub largest_n: f64,
    /// Whether the firmware's watchdog has switched it off.
    pub watchdog: bool,
}

/// A board does not wait for its host's processors: where that is permitted, this process goes before ordinary ones.
fn has_a_processor_of_its_own() {
    let lowest = libc::sched_param { sched_priority: 1 };
    // SAFETY: the kernel reads one word.
    unsafe {
        libc::sched_setscheduler(0, libc::SCHED_RR, &raw const lowest);
    }
}

impl FakeRig {
    /// Starts one with more arguments; its terminal is there.
    pub fn start(arguments: &[&str]) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let mut rig = Self::start_at(&directory.path().join("rig"), arguments);
        rig._directory = Some(directory);
        rig
    }

    /// Starts one behind a path, in the place of one that was there before.
    pub fn start_at(link: &Path, arguments: &[&str]) -> Self {
        let link = link.to_path_buf();
        // The longest with which a rig engages: only some tests are about a host that is silent.
        let patience: &[&str] = if arguments.iter().any(|argument| argument.starts_with("--watchdog-ms")) {
            &[]
        } else {
            &["--watchdog-ms", "200"]
        };
        let mut command = Command::new(binary("fake-rig"));
        // It ends with who started it. SAFETY: between fork and exec only system calls are made, and nothing is allocated.
        unsafe {
            command.pre_exec(|| {
                has_a_processor_of_its_own();
                Ok(set_parent_process_death_signal(Some(Signal::TERM))?)
            });
        }
        let mut child = command
            .arg("--pty")
            .arg(&link)
            .args(arguments)
            .args(patience)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("fake-rig starts");
        let mut rig = Self {
            asks: child.stdin.take().expect("it is piped"),
            answers: BufReader::new(child.stdout.take().expect("it is piped")),
            child,
            link,
            _directory: None,
        };
        let greeting = rig.line();
        assert!(greeting.starts_with("fake-rig: "), "{greeting}");
        rig
    }

    /// The link that points at its terminal.
    pub fn link(&self) -> &Path {
        &self.link
    }

    /// What `--device` takes.
    pub fn address(&self) -> String {
        format!("serial:{}", self.link.display())
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        let read = self.answers.read_line(&mut line).expect("it writes text");
        assert!(read > 0, "fake-rig has ended");
        line.trim().to_owned()
    }

    fn ask(&mut self, line: &str) -> String {
        writeln!(self.asks, "{line}").expect("it reads");
        self.line()
    }

    /// Has something go wrong; returns when it does.
    pub fn fail(&mut self, fault: &str) {
        assert_eq!(self.ask(fault), format!("done {fault}"));
    }

    /// Ends it by a signal; its directory stays as it leaves it.
    pub fn end(mut self, signal: Signal) -> ExitStatus {
        kill_process(Pid::from_child(&self.child), signal).expect("it runs");
        self.child.wait().expect("it ends")
    }

    /// What its motor does.
    pub fn force(&mut self) -> MotorForce {
        let answer = self.ask("force");
        let words: Vec<&str> = answer.split(' ').collect();
        let ["force", now, "largest", largest, "watchdog", watchdog] = words[..] else {
            panic!("{answer}");
        };
        MotorForce {
            now_n: now.parse().expect("a force"),
            largest_n: largest.parse().expect("a force"),
            watchdog: watchdog == "1",
        }
    }
}

/// A rig with more arguments, and a daemon of a short ramp, with more arguments, that has connected to it.
pub fn connected(rig: &[&str], daemon: &[&str]) -> (FakeRig, Daemon, Client) {
    let rig = FakeRig::start(rig);
    let daemon = Daemon::start_on(&rig.address(), &[&["--ramp-ms", "20"], daemon].concat());
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    (rig, daemon, client)
}

/// Engages a rig and waits until its motor pulls.
pub fn pull(rig: &mut FakeRig, client: &mut Client) {
    pull_until(client, |_| rig.force().now_n.abs() > 2.0);
}

impl Drop for FakeRig {
    fn drop(&mut self) {
        // It may have ended already; either way nothing of it stays.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}
