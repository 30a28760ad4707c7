//! `haptic-ctl --all`: every rig of the machine at once, those behind a forwarded socket included.

use haptic_ipc::{Request, RigState};
use serde_json::Value;
use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixListener;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};
use system_tests::{Daemon, binary, copy_binary, is_refused, status, stderr, text};

/// Generous: on a busy machine the program itself takes its time to start.
const SOON: Duration = Duration::from_secs(15);

/// haptic-ctl as somebody has it whose rigs lie in a directory.
fn ctl_at(program: &Path, rigs: &Path, line: &str) -> Command {
    let mut command = Command::new(program);
    command
        .args(line.split(' '))
        .env("XDG_RUNTIME_DIR", rigs)
        .env("HOME", rigs)
        .env_remove("HAPTICD_SOCKET");
    command
}

/// Runs it.
fn ctl(rigs: &Path, line: &str) -> Output {
    let output = ctl_at(&binary("haptic-ctl"), rigs, line).output();
    output.expect("haptic-ctl starts")
}

fn socket_of(rigs: &Path, service: &str) -> PathBuf {
    let directory = rigs.join(service);
    fs::create_dir_all(&directory).expect("made");
    directory.join("control.sock")
}

/// The lines about these rigs, by their first words; this machine may have rigs besides.
fn lines<'a>(output: &'a str, rigs: &[&str]) -> Vec<&'a str> {
    let is_ours = |line: &&str| {
        line.split_whitespace()
            .next()
            .is_some_and(|first| rigs.contains(&first))
    };
    output.lines().filter(is_ours).collect()
}

#[test]
fn all_option_lists_every_rig_without_waiting_for_dead_ones() {
    let directory = tempfile::tempdir().expect("a directory");
    let rigs = directory.path();
    let one = Daemon::start_at(&socket_of(rigs, "hapticd"), &["--ramp-ms", "10"]);
    let left = Daemon::start_at(&socket_of(rigs, "hapticd@left"), &["--ramp-ms", "10"]);
    left.ctl_ok(&["engage", "--wait"]);
    drop(UnixListener::bind(socket_of(rigs, "hapticd@dead")).expect("a socket"));
    // Connects, and nobody ever greets.
    let _hung = UnixListener::bind(socket_of(rigs, "hapticd@hung")).expect("a socket");
    // The first that fails is dead.
    let asked = |line: &str| {
        let began = Instant::now();
        let output = ctl(rigs, line);
        assert!(began.elapsed() < SOON, "{:?}", began.elapsed());
        assert_eq!(output.status.code(), Some(3), "{output:?}");
        output
    };

    let shown = text(&asked("--all status").stdout);
    let shown = lines(&shown, &["dead", "hapticd", "hung", "left"]);
    assert_eq!(shown.len(), 4, "{shown:?}");
    for (line, parts) in shown.iter().zip([
        &["dead", "hapticd@dead/control.sock"][..],
        &["hapticd", "idle", "0.000 N of 20 N", "simulated friction", "fake rig"],
        &["hung", "has not answered for 2.0 s"],
        &["left", "engaged", "N of 20 N", "simulated friction", "fake rig"],
    ]) {
        for part in parts {
            assert!(line.contains(part), "{line} lacks {part}");
        }
    }

    let answers: Vec<Value> = serde_json::from_slice(&asked("--json --all status").stdout).expect("a list");
    for (rig, state, error) in [
        ("left", "engaged".into(), Value::Null),
        ("hapticd", "idle".into(), Value::Null),
        ("dead", Value::Null, "no_daemon".into()),
        ("hung", Value::Null, "no_answer".into()),
    ] {
        let found = answers.iter().find(|answer| answer["rig"] == rig);
        let found = found.unwrap_or_else(|| panic!("{rig} is not in {answers:?}"));
        assert_eq!((&found["status"]["state"], &found["error"]["code"]), (&state, &error));
    }

    let output = asked("--all stop");
    let shown = text(&output.stdout);
    for (rigs, says) in [
        (["hapticd", "left"], "stopped at tick"),
        (["dead", "hung"], "if the motor pulls, cut its power"),
    ] {
        for line in lines(&shown, &rigs) {
            assert!(line.contains(says), "{line}");
        }
    }
    for daemon in [&one, &left] {
        assert_eq!(status(&mut daemon.client()).state, RigState::Stopped);
    }
    let warned = stderr(&output);
    assert!(warned.contains("hung: no answer yet: if the motor pulls"), "{warned}");

    for (line, part) in [
        ("--all engage", "--all goes with `status`, `stop` and `doctor` alone"),
        ("--all --rig left status", "--rig"),
    ] {
        is_refused(line, &ctl(rigs, line), 2, &[part]);
    }
    let nobody = tempfile::tempdir().expect("a directory");
    let alone = ctl(nobody.path(), "--all status");
    is_refused("no rig", &alone, 3, &["there is no socket of a rig"]);
}

/// Two rigs of one person, both engaged.
fn two_engaged(rigs: &Path) -> [Daemon; 2] {
    ["hapticd", "hapticd@left"].map(|service| {
        let daemon = Daemon::start_at(&socket_of(rigs, service), &["--ramp-ms", "10"]);
        daemon.ctl_ok(&["engage", "--wait"]);
        daemon
    })
}

fn states(rigs: &[Daemon; 2]) -> [RigState; 2] {
    [0, 1].map(|index: usize| status(&mut rigs[index].client()).state)
}

// hazard: H26
#[test]
fn a_stop_reaches_every_rig_whatever_else_is_on_its_line() {
    use RigState::{Engaged, Stopped};
    let directory = tempfile::tempdir().expect("a directory");
    let rigs = directory.path();
    let daemons = two_engaged(rigs);
    let left = rigs.join("hapticd@left/control.sock").display().to_string();
    let own = rigs.join("hapticd/control.sock").display().to_string();
    for (line, code, stopped, says) in [
        ("stop --help", 0, [Engaged, Engaged], "Set zero force at once"),
        ("stop", 0, [Stopped, Stopped], &*left),
        ("stop --all", 0, [Stopped, Stopped], &*own),
        ("stop -q", 0, [Stopped, Stopped], ""),
        ("stop now", 2, [Stopped, Stopped], "every rig in reach is stopped"),
        (
            "stop --hard --json",
            2,
            [Stopped, Stopped],
            "every rig in reach is stopped",
        ),
        ("--rig stop", 2, [Stopped, Stopped], "every rig in reach is stopped"),
        ("stop --rig lefft", 3, [Stopped, Stopped], "there is no rig lefft"),
        (
            "stop --socket /nowhere/control.sock",
            3,
            [Stopped, Stopped],
            "/nowhere/control.sock is missing",
        ),
        ("stop --rig left", 0, [Engaged, Stopped], "still engaged: hapticd (fake"),
        ("--rig left stop", 0, [Engaged, Stopped], &*left),
        ("stop --rig=left --json", 0, [Engaged, Stopped], "\"state\":\"stopped\""),
    ] {
        let output = ctl(rigs, line);
        let printed = text(&output.stdout) + &stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{line}: {printed}");
        assert_eq!(states(&daemons), stopped, "{line}: {printed}");
        assert!(printed.contains(says), "{line}: {printed} lacks {says}");
        for daemon in &daemons {
            let mut client = daemon.client();
            let _: haptic_ipc::StateReply = client.request(Request::Reset {}).expect("it is there");
            system_tests::engage(&mut client);
        }
    }
}

// hazard: H29
#[test]
fn a_rig_that_is_closed_to_a_user_is_not_an_absent_rig() {
    let directory = tempfile::tempdir().expect("a directory");
    let rigs = directory.path();
    let copy = rigs.join("haptic-ctl");
    copy_binary("haptic-ctl", &copy);
    fs::set_permissions(rigs, Permissions::from_mode(0o755)).expect("ours");
    for (service, name) in [("hapticd@left", Some("left")), ("hapticd", None)] {
        let closed = rigs.join(service);
        fs::create_dir(&closed).expect("made");
        // For the group, and neither for its owner, who runs this, nor for others.
        fs::set_permissions(&closed, Permissions::from_mode(0o050)).expect("ours");
        let mut lines = vec!["status", "stop", "status --all", "stop --all"];
        lines.extend(name.iter().flat_map(|_| ["--rig left engage", "stop --rig left"]));
        for line in lines {
            let mut command = ctl_at(&copy, rigs, line);
            if rustix::process::geteuid().is_root() {
                const NOBODY: u32 = 65534;
                command.uid(NOBODY).gid(NOBODY);
            }
            let output = command.output().expect("haptic-ctl starts");
            let printed = text(&output.stdout) + &stderr(&output);
            assert_eq!(output.status.code(), Some(4), "{line}: {printed}");
            for part in [&*closed.display().to_string(), "usermod -aG", "log in again"] {
                assert!(printed.contains(part), "{line}: {printed} lacks {part}");
            }
            assert!(
                !printed.contains("--demo") && !printed.contains("no rig"),
                "{line}: {printed}"
            );
        }
        fs::remove_dir(&closed).expect("ours");
    }
}

#[test]
fn with_several_rigs_in_reach_every_other_command_asks_for_one() {
    let directory = tempfile::tempdir().expect("a directory");
    let rigs = directory.path();
    let daemons = two_engaged(rigs);
    let refused = |line: &str, code: i32, parts: &[&str]| is_refused(line, &ctl(rigs, line), code, parts);
    for line in ["status", "set Fs=3", "release", "reset", "devices --probe fake"] {
        refused(line, 2, &["2 rigs are in reach", "hapticd (", "left (", "--rig NAME"]);
    }
    // The rig without a name is named by its service; what needs no daemon asks for none.
    for line in [
        "status --rig left",
        "--rig left status",
        "status --rig=left --json",
        "status --all",
        "--rig hapticd status",
        "devices",
    ] {
        assert_eq!(ctl(rigs, line).status.code(), Some(0), "{line}");
    }
    // For an unknown one, all are listed.
    let said = refused(
        "--rig lefft status",
        3,
        &["no rig `lefft`", "hapticd, left", "`--rig hapticd`"],
    );
    assert!(!said.contains("--demo"), "{said}");
    let [own, left] = daemons;
    drop(own);
    // Its socket is left behind: the other one is in reach alone, and may not be the one that is meant.
    refused(
        "status",
        2,
        &["left is in reach", "hapticd does not answer", "--rig NAME"],
    );
    assert_eq!(ctl(rigs, "--rig left status").status.code(), Some(0));
    drop(left);
    refused("status", 3, &[]);
}
