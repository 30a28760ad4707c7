//! hapticd on fakes of other makers' motor controllers, each behind a pseudo-terminal and in its
//! published protocol: force acts, and whatever dies, none stays.

use haptic_ipc::{Client, LinkCounts, RigState, Status};
use rustix::process::Signal;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;
use system_tests::process::Killed;
use system_tests::{Daemon, PATIENCE, binary, pull_until, status, stderr, timed, wait_for, wait_for_state};
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
    largest_n: f64,
    on: bool,
    watchdog: bool,
}

impl Board {
    fn start(kind: &str, link: &Path, arguments: &[&str]) -> Self {
        let mut child = Command::new(binary("fake-board"))
            .arg(kind)
            .arg("--pty")
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
        let ["force", now, "largest", largest, "on", on, "watchdog", watchdog] = words[..] else {
            panic!("{line}");
        };
        Force {
            now_n: now.parse().expect("a number"),
            largest_n: largest.parse().expect("a number"),
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

/// A kind of fake, and how it is named to hapticd.
struct FakeKind {
    name: &'static str,
    board: &'static [&'static str],
    options: &'static str,
    firmware: &'static str,
}

const KINDS: [FakeKind; 2] = [
    FakeKind {
        name: "odrive",
        board: &[],
        options: "radius_mm=5&torque_limit_nm=0.1",
        firmware: "ODrive 0.5.6",
    },
    FakeKind {
        name: "odrive",
        board: &["--firmware-0-6"],
        options: "radius_mm=5&torque_limit_nm=0.1",
        firmware: "ODrive 0.6.9",
    },
];

/// A daemon on the fake at `board` in this directory.
fn daemon(kind: &FakeKind, directory: &Path) -> Daemon {
    let device = format!("{}:{}?{}", kind.name, directory.join("board").display(), kind.options);
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

fn counts(status: &Status) -> LinkCounts {
    status.device.link.as_ref().expect("a link").counts
}

fn samples(status: &Status) -> u64 {
    counts(status).samples
}

/// A fake and a daemon on it, which a client has seen connected.
struct Setup {
    client: Client,
    daemon: Daemon,
    board: Board,
    directory: TempDir,
}

impl Setup {
    fn new(kind: &FakeKind) -> Self {
        Self::with_board(kind, kind.board)
    }

    fn with_board(kind: &FakeKind, arguments: &[&str]) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let board = Board::start(kind.name, &directory.path().join("board"), arguments);
        let daemon = daemon(kind, directory.path());
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

#[test]
fn the_papers_scene_is_felt_on_every_board() {
    timed("a scene felt on boards of others", || {
        for kind in &KINDS {
            let mut setup = Setup::new(kind);
            let link = status(&mut setup.client).device.link;
            let device = link.and_then(|link| link.device).expect("one");
            assert!(device.firmware.starts_with(kind.firmware), "{}", device.firmware);
            assert!((device.force_limit_n - 20.0).abs() < 1e-9, "{device:?}");
            assert!(!setup.board.force().on, "no motor before it is wanted");
            // Two seconds and more of its ticks, in which the hand goes to and fro over the block's stiction.
            setup.pull();
            let before = counts(&status(&mut setup.client));
            let after = wait_for(&mut setup.client, "samples", |status| {
                samples(status) > before.samples + 2000 || status.state != RigState::Engaged
            });
            assert_eq!(after.state, RigState::Engaged, "{:?}", after.fault);
            let force = setup.board.force();
            setup.daemon.ctl_ok(&["release"]);
            assert!(force.on, "{force:?}");
            // Its kinetic friction is 3.5 N and its stiction 4 N; the limit is 20 N.
            assert!((3.0..20.001).contains(&force.largest_n), "{}: {force:?}", kind.firmware);
            let force = setup.board.wait_for("the motor to be off", |force| !force.on);
            assert_eq!(force.now_n, 0.0);
            let after = counts(&status(&mut setup.client));
            assert_eq!(
                (after.bad_crc, after.malformed),
                (before.bad_crc, before.malformed),
                "{after:?}"
            );
            println!("{}: {after:?}", kind.firmware);
        }
    });
}

// hazard: F5
#[test]
fn a_daemon_that_is_killed_leaves_no_force() {
    timed("a killed daemon on boards of others", || {
        for kind in &KINDS {
            let mut setup = Setup::new(kind);
            setup.pull();
            let Setup {
                mut board,
                daemon: killed,
                directory,
                ..
            } = setup;
            killed.end(Signal::KILL);
            let force = board.wait_for("its own watchdog", |force| force.now_n == 0.0 && !force.on);
            assert!(force.watchdog, "{}: {force:?}", kind.firmware);
            // The next daemon finds it as it must be, and can use it.
            let next = daemon(kind, directory.path());
            let mut client = next.client();
            connected(&mut client);
            pull_until(&mut client, |_| board.force().now_n.abs() > 1.0);
        }
    });
}

#[test]
fn unplugged_board_disconnects_and_comes_back_idle() {
    timed("boards of others, unplugged", || {
        for kind in &KINDS {
            let mut setup = Setup::new(kind);
            setup.pull();
            let Setup { client, board, .. } = &mut setup;
            let before = counts(&status(client)).connections;
            board.ask("hang-up 1");
            wait_for(client, "the hang-up", |status| {
                status.state == RigState::Disconnected || counts(status).connections > before
            });
            board.wait_for("its own watchdog", |force| force.now_n == 0.0 && !force.on);
            let back = connected(client);
            assert!(counts(&back).connections > before, "{back:?}");
            board.force();
            let before = samples(&status(client));
            wait_for(client, "samples", |status| samples(status) > before + 200);
            let force = board.force();
            assert_eq!((force.largest_n, force.on), (0.0, false), "it never engages by itself");
        }
    });
}

#[test]
fn a_board_that_cannot_be_used_says_why() {
    let mut setup = Setup::with_board(&KINDS[0], &["--uncalibrated"]);
    assert!(setup.daemon.ctl(&["engage"]).status.code().is_some());
    wait_for_state(&mut setup.client, RigState::Faulted);
    assert_eq!(setup.board.force().largest_n, 0.0);
}

// hazard: H9
#[test]
fn a_motor_that_a_board_does_not_switch_off_is_an_alarm() {
    timed("a board that does not switch its motor off", || {
        for wrong in ["ignore-off", "stay-enabled"] {
            let mut setup = Setup::new(&KINDS[0]);
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
