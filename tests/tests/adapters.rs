//! hapticd on fakes of other makers' motor controllers, each behind a pseudo-terminal and in its
//! published protocol: force acts, and whatever dies, none stays.

use haptic_ipc::{Client, RigState};
use rustix::process::Signal;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use system_tests::process::Killed;
use system_tests::{Daemon, binary, plain, pull_until, stderr, timed, until_some, wait_for, wait_for_state};

/// A running fake-board. It is killed when the test ends.
struct Board {
    _child: Killed,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

/// What the motor of a fake gives.
#[derive(Clone, Copy, Debug)]
struct Force {
    now_n: f64,
    on: bool,
    watchdog: bool,
}

impl Board {
    fn start(link: &Path, arguments: &[&str]) -> Self {
        let mut child = Command::new(binary("fake-board"))
            .args(["odrive", "--pty", plain(link)])
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("fake-board starts");
        let mut board = Self {
            input: child.stdin.take().expect("it is piped"),
            output: BufReader::new(child.stdout.take().expect("it is piped")),
            _child: Killed(child),
        };
        assert!(board.line().starts_with("fake-board: "));
        board
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.output.read_line(&mut line).expect("it says text");
        assert!(!line.is_empty(), "fake-board has ended");
        line
    }

    fn ask(&mut self, line: &str) -> String {
        writeln!(self.input, "{line}").expect("it reads");
        self.line()
    }

    fn force(&mut self) -> Force {
        let line = self.ask("force");
        let words: Vec<&str> = line.split_whitespace().collect();
        let ["force", now, "largest", _, "on", on, "watchdog", watchdog] = words[..] else {
            panic!("{line}");
        };
        Force {
            now_n: now.parse().expect("a number"),
            on: on == "1",
            watchdog: watchdog == "1",
        }
    }

    /// Waits until its motor is off.
    fn lets_go(&mut self) -> Force {
        until_some("the motor stays on", || {
            Some(self.force()).filter(|force| !force.on && force.now_n == 0.0)
        })
    }
}

/// Arguments of a fake, of each generation of firmwares.
const FIRMWARES: [&[&str]; 2] = [&[], &["--firmware-0-6"]];

/// A daemon on the fake at `board` in this directory, and a client that has seen it connected.
fn connected(directory: &Path) -> (Daemon, Client) {
    let board = directory.join("board");
    let device = format!("odrive:{}?radius_mm=5&torque_limit_nm=0.1", board.display());
    // What is played here is some maker's board, of which nobody knows which way its motor pulls.
    let daemon = Daemon::start_in(directory, &device, &["--ramp-ms", "20", "--uncommissioned"]);
    let mut client = daemon.client();
    wait_for(&mut client, "a device", |status| {
        status.device.link.as_ref().is_some_and(|link| link.device.is_some()) && status.state == RigState::Idle
    });
    (daemon, client)
}

/// Waits until the motor pulls.
fn pull(board: &mut Board, client: &mut Client) {
    pull_until(client, |_| board.force().now_n.abs() > 1.0);
}

// hazard: F5
#[test]
fn a_daemon_that_is_killed_leaves_no_force() {
    timed("a killed daemon on boards of others", || {
        for firmware in FIRMWARES {
            let directory = tempfile::tempdir().expect("a directory");
            let mut board = Board::start(&directory.path().join("board"), firmware);
            let (killed, mut client) = connected(directory.path());
            pull(&mut board, &mut client);
            killed.end(Signal::KILL);
            let force = board.lets_go();
            assert!(force.watchdog, "{firmware:?}: {force:?}");
            // The next daemon finds it as it must be, and can use it.
            let (_next, mut client) = connected(directory.path());
            pull(&mut board, &mut client);
        }
    });
}

// hazard: H9
#[test]
fn a_motor_that_a_board_does_not_switch_off_is_an_alarm() {
    timed("a board that does not switch its motor off", || {
        for wrong in ["ignore-off", "stay-enabled"] {
            let directory = tempfile::tempdir().expect("a directory");
            let mut board = Board::start(&directory.path().join("board"), &[]);
            let (daemon, mut client) = connected(directory.path());
            pull(&mut board, &mut client);
            board.ask(wrong);
            let stopped = daemon.ctl(&["--json", "stop"]);
            let message = stderr(&stopped);
            assert!(
                !stopped.status.success() && message.contains("not_confirmed"),
                "{wrong}: {message}"
            );
            let alarmed = wait_for_state(&mut client, RigState::Faulted);
            let fault = alarmed.fault.unwrap_or_default();
            assert!(fault.starts_with("still_enabled"), "{fault}");
            board.ask("honest");
            board.lets_go();
            // A release, and the end of the daemon, are no better than a stop.
            pull(&mut board, &mut client);
            board.ask(wrong);
            daemon.ctl_refused(&["release", "--wait"], 6, "still_enabled");
            let (ended, message) = daemon.end(Signal::TERM);
            assert!(
                !ended.success() && message.contains("has not confirmed"),
                "{wrong}: {message}"
            );
        }
    });
}
