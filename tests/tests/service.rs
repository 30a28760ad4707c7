//! What hapticd tells a service manager; here the tests are the manager.

use haptic_ipc::{ErrorCode, Request, StateReply, Status};
use rustix::process::Signal;
use std::os::unix::net::UnixDatagram;
use std::process::Command;
use std::time::{Duration, Instant};
use system_tests::{Daemon, HeldThread, PATIENCE, binary, refused, status, until};

/// A manager with the daemon that it started.
struct Manager {
    socket: UnixDatagram,
    daemon: Daemon,
    _directory: tempfile::TempDir,
}

impl Manager {
    fn start(watchdog: Duration) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("notify");
        let socket = UnixDatagram::bind(&path).expect("a socket");
        socket.set_read_timeout(Some(PATIENCE)).expect("a time-out can be set");
        let mut command = Command::new(binary("hapticd"));
        command
            .args(["--device", "fake"])
            .env("NOTIFY_SOCKET", &path)
            .env("WATCHDOG_USEC", watchdog.as_micros().to_string());
        let daemon = Daemon::spawn(command, &directory.path().join("run/control.sock"));
        Self {
            socket,
            daemon,
            _directory: directory,
        }
    }

    fn receive(&self) -> Vec<String> {
        let mut bytes = [0; 4096];
        let length = self.socket.recv(&mut bytes).expect("the daemon says something");
        let message = std::str::from_utf8(&bytes[..length]).expect("text");
        message.lines().map(str::to_owned).collect()
    }

    fn receive_until(&self, line: &str) {
        let began = Instant::now();
        loop {
            let message = self.receive();
            if message.iter().any(|text| text.starts_with(line)) {
                return;
            }
            assert!(began.elapsed() < PATIENCE, "waited in vain for {line}: {message:?}");
        }
    }
}

const FED: &str = "WATCHDOG=1";

#[test]
fn it_says_that_it_is_ready_that_it_goes_on_and_that_it_ends() {
    let watchdog = Duration::from_millis(400);
    let manager = Manager::start(watchdog);
    assert_eq!(manager.receive(), ["READY=1", FED, "STATUS=idle"]);
    let mut client = manager.daemon.client();
    assert!(status(&mut client).tick > 0, "ready means that the loop ticks");

    let mut fed = Vec::new();
    while fed.len() < 21 {
        if manager.receive().iter().any(|line| line == FED) {
            fed.push(Instant::now());
        }
    }
    let mut gaps: Vec<Duration> = fed.windows(2).map(|pair| pair[1] - pair[0]).collect();
    gaps.sort_unstable();
    if test_run::is_long_for("how often the service manager hears that it goes on") {
        assert!(gaps[10] <= watchdog / 2, "{gaps:?}");
    }

    let _: StateReply = client.request(Request::engage()).expect("it is idle");
    manager.receive_until("STATUS=engaged");
    let Manager { socket, daemon, .. } = manager;
    let (ended, printed) = daemon.end(Signal::TERM);
    assert!(ended.success(), "{printed}");
    let last = std::iter::from_fn(|| {
        let mut bytes = [0; 4096];
        socket.set_nonblocking(true).expect("it can");
        let length = socket.recv(&mut bytes).ok()?;
        Some(String::from_utf8_lossy(&bytes[..length]).into_owned())
    });
    assert!(last.into_iter().any(|message| message.contains("STOPPING=1")));
}

#[test]
fn neither_watchdog_nor_client_takes_a_loop_that_hangs_as_alive() {
    let manager = Manager::start(Duration::from_millis(400));
    let mut client = manager.daemon.client();
    manager.receive_until(FED);
    let held = HeldThread::real_time(manager.daemon.pid());
    let error = refused(&mut client, Request::set([("mass", 1.5)].into_iter().collect()));
    assert!(error.message.contains("cut the power"), "{error}");
    assert_eq!(error.code, ErrorCode::NotResponding);
    manager.receive_until("STATUS=the real-time thread has been hanging");
    let stood = status(&mut client);
    let mut asked_to_restart = 0;
    for _ in 0..20 {
        // How long it hangs is reported as often as the watchdog would be fed.
        let message = manager.receive();
        assert!(
            message.iter().any(|line| line.contains("has been hanging")),
            "{message:?}"
        );
        assert!(!message.iter().any(|line| line == FED), "{message:?}");
        asked_to_restart += usize::from(message.iter().any(|line| line == "WATCHDOG=trigger"));
    }
    // The first turns were those of a loop that may have been held up by a sleep of the machine.
    assert!(asked_to_restart >= 17, "{asked_to_restart}");
    assert_eq!(status(&mut client).tick, stood.tick, "the control thread goes on alone");
    drop(held);
    manager.receive_until("STATUS=idle");
    manager.receive_until(FED);
}

#[test]
fn a_manager_that_does_not_listen_keeps_nobody_waiting() {
    // A message a millisecond: more than any socket holds.
    let manager = Manager::start(Duration::from_millis(4));
    until("its loop is slow", || {
        // Through haptic-ctl, which waits for no answer for ever.
        let status = manager.daemon.ctl_ok(&["status", "--json"]);
        serde_json::from_str::<Status>(&status).expect("a status").tick >= 3000
    });
    let stopped = manager.daemon.ctl(&["stop"]);
    assert!(stopped.status.success(), "{stopped:?}");
    let (ended, printed) = manager.daemon.end(Signal::TERM);
    assert!(ended.success(), "{printed}");
}
