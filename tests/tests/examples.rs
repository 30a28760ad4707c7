//! The example clients do what they show, against a running daemon.

use haptic_ipc::{Request, RigState, SceneReply};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use system_tests::{Daemon, status, stderr, text};

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name)
}

fn run(mut command: Command) -> Output {
    command.stdin(Stdio::null()).output().expect("it starts")
}

fn printed(output: &Output) -> String {
    assert!(output.status.success(), "{}{}", text(&output.stdout), stderr(output));
    text(&output.stdout)
}

/// The block is heavier, and the rig stopped.
fn has_changed_and_stopped(daemon: &Daemon) {
    let mut client = daemon.client();
    let scene: SceneReply = client.request(Request::get()).expect("the scene");
    assert_eq!(
        (scene.params["mass"].positive, scene.params["static_force"].positive),
        (1.5, 5.0)
    );
    assert_eq!(status(&mut client).state, RigState::Stopped);
}

#[test]
fn the_one_in_python_is_short_and_drives_the_rig() {
    let path = example("client.py");
    let lines = std::fs::read_to_string(&path).expect("text").lines().count();
    assert!(lines < 60, "{lines} lines");
    if !test_run::has(&["python3"]) {
        return;
    }
    let daemon = Daemon::start(&["--ramp-ms", "20"]);
    let mut python = Command::new("python3");
    python.arg("-B").arg(&path).arg(daemon.socket());
    assert!(printed(&run(python)).contains("the rig is stopped"));
    has_changed_and_stopped(&daemon);
}

#[test]
fn the_one_in_python_is_a_module_that_tells_why_it_is_refused() {
    if !test_run::has(&["python3"]) {
        return;
    }
    let daemon = Daemon::start(&[]);
    let mut python = Command::new("python3");
    let program = "
import sys
from client import Hapticd, Refused
rig = Hapticd(sys.argv[1])
rig.request('subscribe', topics=['samples'])
try:
    rig.request('set', params={'mass': -1})
except Refused as refused:
    print(refused.error['code'], refused.error['max'], refused)
ticks = [row[0] for _, event in zip(range(20), rig.events()) for row in event['rows']]
print('in order' if ticks == list(range(ticks[0], ticks[0] + len(ticks))) else ticks)
";
    python
        .args(["-B", "-c", program])
        .arg(daemon.socket())
        .env("PYTHONPATH", example(""));
    let printed = printed(&run(python));
    assert!(
        printed.starts_with("out_of_range 100.0 mass = -1 kg is out of range"),
        "{printed}"
    );
    assert!(printed.ends_with("in order\n"), "{printed}");
}

#[test]
fn the_one_for_the_shell_drives_the_rig_and_says_why_it_cannot() {
    if !test_run::has(&["bash", "socat", "jq"]) {
        return;
    }
    let daemon = Daemon::start(&["--ramp-ms", "20"]);
    let shell = || {
        let mut shell = Command::new("bash");
        shell.arg(example("client.sh")).arg(daemon.socket());
        run(shell)
    };
    let first = printed(&shell());
    for part in ["state: engaged, 0.5 kg", "state: engaged, 1.5 kg", "the rig is stopped"] {
        assert!(first.contains(part), "{first}");
    }
    has_changed_and_stopped(&daemon);
    // It is stopped now, and a stop is not engaged away.
    let again = shell();
    assert_eq!(again.status.code(), Some(1));
    let message = stderr(&again);
    assert!(
        message.contains("refused: stopped: ") && message.contains("reset"),
        "{message}"
    );
}

#[test]
fn without_a_daemon_each_says_so_in_one_line() {
    let nowhere = Path::new("/nonexistent/control.sock");
    for (program, name) in [("python3", "client.py"), ("bash", "client.sh")] {
        if !test_run::has(&[program]) {
            continue;
        }
        let mut command = Command::new(program);
        command.arg(example(name)).arg(nowhere);
        let output = run(command);
        assert_eq!(output.status.code(), Some(1));
        let message = stderr(&output);
        assert!(
            message.starts_with("hapticd at /nonexistent/control.sock") && message.lines().count() == 1,
            "{message}"
        );
    }
}

#[test]
fn each_looks_where_the_command_line_looks() {
    let directory = tempfile::tempdir().expect("a directory");
    let daemon = Daemon::start_at(&directory.path().join("hapticd/control.sock"), &["--ramp-ms", "20"]);
    for (programs, name) in [(&["python3"][..], "client.py"), (&["bash", "socat", "jq"], "client.sh")] {
        if !test_run::has(programs) {
            continue;
        }
        for (variable, value) in [
            ("XDG_RUNTIME_DIR", directory.path()),
            ("HAPTICD_SOCKET", daemon.socket()),
        ] {
            let mut command = Command::new(programs[0]);
            command
                .arg(example(name))
                .env_remove("XDG_RUNTIME_DIR")
                .env_remove("HAPTICD_SOCKET");
            command.env(variable, value);
            assert!(
                printed(&run(command)).contains("the rig is stopped"),
                "{name} by {variable}"
            );
            daemon.ctl_ok(&["reset"]);
        }
    }
}
