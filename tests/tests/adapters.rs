//! hapticd on fakes of other makers' motor controllers, each behind a pseudo-terminal and in its
//! published protocol: force acts, and whatever dies, none stays.

use haptic_ipc::{Client, RigState, Status};
use rustix::process::Signal;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;
use system_tests::process::Killed;
use system_tests::{Daemon, PATIENCE, binary, pull_until, stderr, timed, wait_for, wait_for_state};
use tempfile::TempDir;

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
            .args(["odrive", "--pty"])
            .arg(link)
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

    fn wait_for(&mut self, what: &str, wanted: impl Fn(Force) -> bool) -> Force {
        let began = Instant::now();
        loop {
            let force = self.force();
            if wanted(force) {
                return force;
            }
            assert!(began.elapsed() < PATIENCE, "waited in vain for {what}: {force:?}");
            system_tests::pause();
        }
    }
}

/// Arguments of a fake, of each generation of firmwares.
const FIRMWARES: [&[&str]; 2] = [&[], &["--firmware-0-6"]];

/// A daemon on the fake at `board` in this directory.
fn daemon(directory: &Path) -> Daemon {
    let board = directory.join("board");
    let device = format!("odrive:{}?radius_mm=5&torque_limit_nm=0.1", board.display());
    let mut command = Command::new(binary("hapticd"));
    command.args(["--device", &device, "--ramp-ms", "20"]);
    // What is played here is some maker's board, of which nobody knows which way its motor pulls.
    command.arg("--uncommissioned");
    Daemon::spawn(command, &directory.join("run/control.sock"))
}

fn connected(client: &mut Client) -> Status {
    wait_for(client, "a device", |status| {
        status.device.link.as_ref().is_some_and(|link| link.device.is_some()) && status.state == RigState::Idle
    })
}

/// A fake and a daemon on it, which a client has seen connected.
struct Setup {
    client: Client,
    daemon: Daemon,
    board: Board,
    directory: TempDir,
}

impl Setup {
    fn new(arguments: &[&str]) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let board = Board::start(&directory.path().join("board"), arguments);
        let daemon = daemon(directory.path());
        let mut client = daemon.client();
        connected(&mut client);
        Self {
            client,
            daemon,
            board,
            directory,
        }
    }

    /// Waits until the motor pulls.
    fn pull(&mut self) {
        pull_until(&mut self.client, |_| self.board.force().now_n.abs() > 1.0);
    }
}

// hazard: F5
#[test]
fn a_daemon_that_is_killed_leaves_no_force() {
    timed("a killed daemon on boards of others", || {
        for firmware in FIRMWARES {
            let mut setup = Setup::new(firmware);
            setup.pull();
            let Setup {
                mut board,
                daemon: killed,
                directory,
                ..
            } = setup;
            killed.end(Signal::KILL);
            let force = board.wait_for("its own watchdog", |force| force.now_n == 0.0 && !force.on);
            assert!(force.watchdog, "{firmware:?}: {force:?}");
            // The next daemon finds it as it must be, and can use it.
            let next = daemon(directory.path());
            let mut client = next.client();
            connected(&mut client);
            pull_until(&mut client, |_| board.force().now_n.abs() > 1.0);
        }
    });
}

// hazard: H9
#[test]
fn a_motor_that_a_board_does_not_switch_off_is_an_alarm() {
    timed("a board that does not switch its motor off", || {
        for wrong in ["ignore-off", "stay-enabled"] {
            let mut setup = Setup::new(FIRMWARES[0]);
            setup.pull();
            setup.board.ask(wrong);
            let stopped = setup.daemon.ctl(&["--json", "stop"]);
            let message = stderr(&stopped);
            assert!(
                !stopped.status.success() && message.contains("not_confirmed"),
                "{wrong}: {message}"
            );
            let alarmed = wait_for_state(&mut setup.client, RigState::Faulted);
            let fault = alarmed.fault.unwrap_or_default();
            assert!(fault.starts_with("still_enabled"), "{fault}");
            setup.board.ask("honest");
            setup
                .board
                .wait_for("the motor to be off", |force| !force.on && force.now_n == 0.0);
            // A release, and the end of the daemon, are no better than a stop.
            setup.pull();
            setup.board.ask(wrong);
            let released = setup.daemon.ctl(&["release", "--wait"]);
            let message = stderr(&released);
            assert_eq!(released.status.code(), Some(6), "{wrong}: {message}");
            assert!(message.contains("still_enabled"), "{wrong}: {message}");
            let (ended, message) = setup.daemon.end(Signal::TERM);
            assert!(
                !ended.success() && message.contains("has not confirmed"),
                "{wrong}: {message}"
            );
        }
    });
}
