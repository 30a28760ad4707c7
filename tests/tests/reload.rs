//! The configuration is read again while force flows: by `haptic-ctl reload`, and by SIGHUP.

use haptic_ipc::{Client, ReloadReply, RigState, Status, WireError};
use rustix::process::{Signal, kill_process};
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use system_tests::recorded::wait_for_more_rows;
use system_tests::terminal::Terminal;
use system_tests::{
    Daemon, be_patient, binary, ctl_offline_json, engage, journal, plain, process, pull_until, status, until, wait_for,
};

/// A hand that moves for 50 s one way with next to no acceleration, so that the paper's block soon slides and the force
/// is its kinetic friction, 3.5 N.
const STEADY: [&str; 4] = ["--hand-amplitude-m", "1", "--hand-frequency-hz", "0.01"];

/// A daemon without a terminal and with a configuration file, whose hand moves steadily.
struct Reloaded {
    daemon: Daemon,
    file: PathBuf,
    directory: tempfile::TempDir,
}

impl Reloaded {
    fn start(configuration: &str) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let file = directory.path().join("hapticd.toml");
        fs::write(&file, configuration).expect("written");
        let mut command = Command::new("setsid");
        command
            .arg(binary("hapticd"))
            .args(["--device", "fake", "--encoder-resolution-m", "0", "--config"])
            .arg(&file)
            .args(STEADY)
            .arg("--scene-dir")
            .arg(directory.path().join("scenes"));
        let daemon = Daemon::spawn(command, &directory.path().join("run/control.sock"));
        Self {
            daemon,
            file,
            directory,
        }
    }

    fn write(&self, configuration: &str) {
        fs::write(&self.file, configuration).expect("written");
    }

    fn ctl_reload(&self) -> ReloadReply {
        serde_json::from_value(self.daemon.ctl_json(&["reload"])).expect("an answer")
    }

    fn hang_up(&self) {
        process::signal(self.daemon.pid(), Signal::HUP);
    }
}

/// Engages and waits until the block slides.
fn pull(client: &mut Client) {
    pull_until(client, |status| (status.command_force_n.abs() - 3.5).abs() < 0.01);
}

fn limited(client: &mut Client, force_n: f64) -> Status {
    wait_for(client, "another limit", |status| {
        status.device.force_limit_n == force_n && status.command_force_n.abs() <= force_n
    })
}

/// The entries of the journal of this operation, as text.
fn entries(client: &mut Client, op: &str) -> Vec<String> {
    let entries = journal(client).into_iter().filter(|entry| entry.op == op);
    entries.map(|entry| entry.to_string()).collect()
}

// hazard: H21
#[test]
fn limit_change_under_hand_makes_no_step_and_replays_exactly() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("session.mcap");
    let rig = Reloaded::start("force-limit-n = 20\nramp-ms = 200\n");
    let recorder = rig.daemon.recorder(&file, &[]);
    wait_for_more_rows(&file, 300);
    let mut client = rig.daemon.client();
    pull(&mut client);

    rig.write("force-limit-n = 2\nramp-ms = 200\nrate = 2000\n");
    let lower = rig.ctl_reload();
    assert_eq!(lower.needs_restart, ["rate"], "{lower:?}");
    let change = lower.limits.expect("another limit");
    assert_eq!((change.before.force_n, change.after.force_n), (20.0, 2.0));
    assert_eq!(limited(&mut client, 2.0).state, RigState::Engaged);
    rig.write("force-limit-n = 10\nramp-ms = 200\n");
    rig.hang_up();
    wait_for(&mut client, "the force of the surface", |status| {
        status.device.force_limit_n == 10.0 && (status.command_force_n.abs() - 3.5).abs() < 0.01
    });
    rig.daemon.ctl_ok(&["release", "--wait"]);
    wait_for_more_rows(&file, 100);
    assert!(process::end(recorder, Signal::INT).status.success());

    // From 2 N to 10 N in 200 ms is the fastest of all, beside what the surface itself does in a tick that comes late,
    // N.
    const FASTEST_N_PER_S: f64 = 8.0 / 0.2;
    const OWN_STEP_N: f64 = 0.3;
    let rows = haptic_recording::read(&file).expect("a recording").rows;
    let is_engaged = |row: &haptic_ipc::Sample| row.state == RigState::Engaged;
    let (from, to) = (rows.iter().position(is_engaged), rows.iter().rposition(is_engaged));
    let engaged = &rows[from.expect("a beginning")..=to.expect("an end")];
    assert!(engaged.iter().all(is_engaged), "force flowed without a break");
    for pair in engaged.windows(2).filter(|pair| pair[1].tick > change.tick) {
        let elapsed_s = (pair[1].elapsed_ns as f64 * 1e-9).min(5e-3);
        let step_n = (pair[1].command_force_n - pair[0].command_force_n).abs();
        let most_n = FASTEST_N_PER_S * elapsed_s + OWN_STEP_N;
        assert!(step_n <= most_n, "{step_n} N in tick {}", pair[1].tick);
    }
    let report = ctl_offline_json(&["replay", plain(&file)]);
    assert_eq!(report["differing"], 0, "{report}");
    assert!(report["with_force"].as_u64() > Some(300), "{report}");
}

#[test]
fn a_wrong_file_changes_nothing_and_is_reported_in_one_line() {
    let rig = Reloaded::start("force-limit-n = 12\n");
    let mut client = rig.daemon.client();
    pull(&mut client);
    let wrong = "force-limit-n = 3\n\nspeed-limit-mps = 1000\nstale-ms = 40\n";
    rig.write(wrong);
    let answer = rig.daemon.ctl_refused(&["reload", "--json"], 1, "");
    let answer: serde_json::Value = serde_json::from_str(&answer).expect("an error");
    let error: WireError = serde_json::from_value(answer["error"].clone()).expect("an error of the daemon");
    let expected = format!(
        "{}: line 3: speed-limit-mps = 1000 m/s is out of range: it must be from 0.01 to 100 m/s",
        rig.file.display()
    );
    assert_eq!(error.message, expected);
    let unharmed = |client: &mut Client| {
        let status = status(client);
        assert_eq!((status.state, status.device.force_limit_n), (RigState::Engaged, 12.0));
    };
    unharmed(&mut client);

    rig.hang_up();
    until("the signal has no effect", || {
        entries(&mut client, "reload_refused").len() >= 2
    });
    unharmed(&mut client);
    let entry = entries(&mut client, "reload_refused").pop().expect("an entry");
    let wanted = format!("hapticd  reload_refused  {expected}: nothing has changed");
    assert_eq!(entry, wanted);

    fs::remove_file(&rig.file).expect("removed");
    rig.daemon.ctl_refused(&["reload"], 1, "");
    unharmed(&mut client);

    // What is right again takes effect, all of it.
    rig.write("force-limit-n = 3\nspeed-limit-mps = 2\nstale-ms = 40\n");
    let reply = rig.ctl_reload();
    assert!(
        reply.needs_restart.is_empty(),
        "the command line has `stale-ms`: {reply:?}"
    );
    let after = reply.limits.expect("other limits").after;
    assert_eq!((after.force_n, after.speed_mps), (3.0, 2.0));
    limited(&mut client, 3.0);
    assert_eq!(status(&mut client).device.speed_limit_mps, 2.0);
    let (ended, printed) = rig.daemon.end(Signal::TERM);
    assert!(ended.success(), "{printed}");
    let lines = printed.lines().filter(|line| line.contains(&expected));
    assert_eq!(lines.count(), 2, "{printed}");
}

#[test]
fn signal_flood_delays_nobody_and_ends_with_newest_file() {
    let rig = Reloaded::start("force-limit-n = 12\n");
    let mut client = rig.daemon.client();
    pull(&mut client);
    for round in 0..1000 {
        if round % 100 == 0 {
            rig.write(&format!("force-limit-n = {}\n", 4 + round / 100));
            assert_eq!(status(&mut client).state, RigState::Engaged);
        }
        rig.hang_up();
    }
    wait_for(&mut client, "the newest file", |status| {
        status.device.force_limit_n == 13.0
    });
    assert_eq!(status(&mut client).state, RigState::Engaged);
    let (ended, printed) = rig.daemon.end(Signal::TERM);
    assert!(ended.success(), "{printed}");
}

#[test]
fn active_scene_stays_when_its_file_changes() {
    let rig = Reloaded::start("");
    let mut client = rig.daemon.client();
    rig.daemon.ctl_ok(&["scene", "save", "mine"]);
    let named = |client: &mut Client| status(client).library_scene.map(|scene| scene.name);
    assert_eq!(named(&mut client).as_deref(), Some("mine"));
    assert_eq!(rig.ctl_reload().changed_scene, None, "its file is the same");

    let scenes = rig.directory.path().join("scenes");
    let text = fs::read_to_string(scenes.join("mine.toml")).expect("it is saved");
    fs::write(scenes.join("mine.toml"), text.replace("0.1", "0.15")).expect("written");
    fs::write(scenes.join("broken.toml"), "law = 7\n").expect("written");
    let before = status(&mut client).revision;
    let reply = rig.ctl_reload();
    assert_eq!(reply.changed_scene.as_deref(), Some("mine"));
    assert_eq!(reply.scene_problems.len(), 1, "{reply:?}");
    assert!(reply.scene_problems[0].contains("broken.toml"), "{reply:?}");
    assert_eq!((status(&mut client).revision, named(&mut client)), (before, None));
    let mass = || rig.daemon.ctl_ok(&["get", "mass"]);
    assert!(mass().starts_with("0.1 "), "{}", mass());
    rig.daemon.ctl_ok(&["scene", "load", "mine"]);
    assert!(mass().starts_with("0.15 "), "{}", mass());
}

// hazard: H22
#[test]
fn a_daemon_whose_terminal_is_gone_lets_the_force_down_and_ends() {
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("run/control.sock");
    let mut command = Command::new("setsid");
    command
        .arg("--ctty")
        .arg(binary("hapticd"))
        .args(["--device=fake", "--ramp-ms=50", "--socket"])
        .arg(&socket);
    be_patient(&mut command);
    let mut terminal = Terminal::start(command);
    terminal.wait_for("the daemon", |shown| shown.contains(" Hz, "));
    let mut client = Client::connect(&socket).expect("the daemon serves");
    engage(&mut client);
    kill_process(terminal.pid(), Signal::HUP).expect("it runs");
    assert!(terminal.end().success(), "{}", terminal.written());
    assert!(!terminal.written().contains("reload"), "{}", terminal.written());
}
