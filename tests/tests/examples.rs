//! The example clients do what they show, against a running daemon.

use haptic_ipc::{Request, RigState, SceneReply};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use system_tests::{Daemon, status, stderr, text};

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name)
}

/// Runs one against a daemon.
fn run(command: &[&str], name: &str, daemon: &Daemon) -> Output {
    let mut client = Command::new(command[0]);
    client.args(&command[1..]).arg(example(name)).arg(daemon.socket());
    client.stdin(Stdio::null()).output().expect("it starts")
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
    let lines = std::fs::read_to_string(example("client.py"))
        .expect("text")
        .lines()
        .count();
    assert!(lines < 60, "{lines} lines");
    if !test_run::has(&["python3"]) {
        return;
    }
    let daemon = Daemon::start(&["--ramp-ms", "20"]);
    let printed = printed(&run(&["python3", "-B"], "client.py", &daemon));
    assert!(printed.contains("the rig is stopped"), "{printed}");
    has_changed_and_stopped(&daemon);
}

#[test]
fn the_one_for_the_shell_drives_the_rig_and_says_why_it_cannot() {
    if !test_run::has(&["bash", "socat", "jq"]) {
        return;
    }
    let daemon = Daemon::start(&["--ramp-ms", "20"]);
    let shell = || run(&["bash"], "client.sh", &daemon);
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
