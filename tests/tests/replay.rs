//! A recording holds all that its forces were computed from: a servo that is built from its metadata and
//! stepped through its rows gives every one of them again, to the last bit.

use haptic_ipc::RigState;
use haptic_lab::replay;
use haptic_recording::{Ending, Mark, Recording};
use rustix::process::Signal;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use system_tests::fake_rig::FakeRig;
use system_tests::process::end;
use system_tests::recorded::{entries, is_whole, wait_for_more_rows};
use system_tests::{Daemon, binary, is_refused, stderr, text, wait_for, wait_for_state};

/// `haptic-ctl replay` of a file.
fn ctl(file: &Path, arguments: &[&str]) -> Output {
    Command::new(binary("haptic-ctl"))
        .arg("replay")
        .arg(file)
        .args(arguments)
        .output()
        .expect("haptic-ctl runs")
}

/// What `haptic-ctl replay` says of a file, and its exit code.
fn ctl_json(file: &Path, arguments: &[&str]) -> (Value, Option<i32>) {
    let output = ctl(file, &[arguments, &["--json"]].concat());
    let report = serde_json::from_slice(&output.stdout);
    (
        report.unwrap_or_else(|error| panic!("{error}: {}", stderr(&output))),
        output.status.code(),
    )
}

/// Recordings by earlier builds, as far as their names begin so. The settings of their loops have no usual value.
fn recordings_of(beginning: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    ["csv", "mcap"]
        .map(|kind| folder.join(format!("recording-of-{beginning}.{kind}")))
        .into()
}

/// Those by this version of the servo.
fn fixtures() -> Vec<PathBuf> {
    recordings_of(&format!("servo-{}", haptic_core::servo::VERSION))
}

/// Schedules four changes, one of them with a ramp and one to another law and back; returns their ticks once the last
/// is rendered.
fn schedule(daemon: &Daemon, file: &Path) -> [u64; 4] {
    let file = file.with_extension("json");
    let now = daemon.ctl_json(&["status"]);
    // No machine is slower to start haptic-ctl.
    let first = now["tick"].as_u64().expect("a number") + 3000;
    let ticks = [first, first + 7, first + 150, first + 190];
    let changes = serde_json::json!([
        {"at_tick": ticks[0], "params": {"Fs": {"plus": 0.5}}},
        {"at_tick": ticks[1], "params": {"M": {"times": 1.5}}, "ramp_ms": 100},
        {"at_tick": ticks[2], "scene": "lugre"},
        {"at_tick": ticks[3], "scene": "simulated-friction"},
    ]);
    std::fs::write(&file, changes.to_string()).expect("written");
    daemon.ctl_ok(&["schedule", file.to_str().expect("a plain path"), "--anyway"]);
    ticks
}

/// Some thousand ticks with force, from the first row on, of which nothing has its usual value: two ramps, of which the
/// second interrupts the first, another law, a schedule, a stop, and force again. Such a rig chatters.
fn session(file: &Path) -> Recording {
    let daemon = Daemon::start(&[
        "--ramp-ms=70",
        "--slew-limit-n-per-s=900",
        "--force-limit-n=6",
        "--passivity-control-n=1.5",
        "--rig-friction-n=0.05",
        "--rig-damping-ns-per-m=0.1",
        "--velocity=low-pass",
        "--scheme=literal:2",
        "--hand=arm",
        "--hand-frequency-hz=2",
    ]);
    daemon.ctl_ok(&["engage", "--wait", "--anyway"]);
    let recorder = daemon.recorder(file, &[]);
    wait_for_more_rows(file, 200);
    daemon.ctl_ok(&["set", "Fs=8", "Fd=5", "K=9000", "--ramp=400ms", "--anyway"]);
    daemon.ctl_ok(&["set", "M=1.5", "Fs+=6", "--ramp=300ms", "--anyway"]);
    wait_for_more_rows(file, 600);
    daemon.ctl_ok(&["scene", "load", "viscous-drag", "--ramp=200ms", "--anyway"]);
    wait_for_more_rows(file, 400);
    daemon.ctl_ok(&["undo", "--anyway"]);
    wait_for_more_rows(file, 200);
    let scheduled = schedule(&daemon, file);
    wait_for_more_rows(file, 100);
    daemon.ctl_ok(&["stop"]);
    wait_for_more_rows(file, 100);
    daemon.ctl_ok(&["reset"]);
    daemon.ctl_ok(&["engage", "--wait", "--anyway"]);
    wait_for_more_rows(file, 300);
    daemon.ctl_ok(&["release", "--wait"]);
    wait_for_more_rows(file, 100);
    assert!(end(recorder, Signal::INT).status.success());
    let recording = haptic_recording::read(file).expect("a recording");
    let arrived = |at: u64| {
        let is_at = |(_, mark): &(usize, Mark)| matches!(mark, Mark::Scene { tick, .. } if *tick == at);
        recording.marks.iter().any(is_at)
    };
    assert!(scheduled.into_iter().all(arrived), "{scheduled:?}");
    recording
}

#[test]
fn a_recording_gives_its_forces_again_to_the_last_bit() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("session.csv");
    let recording = session(&file);
    assert!(is_whole(&recording), "rows are lost");
    assert_eq!(recording.ending, Ending::Complete);
    let live = recording.rows.iter().filter(|row| row.command_force_n != 0.0).count() as u64;
    assert!(live > 1500, "force flowed in {live} ticks");
    let arrivals = |wants_ramp: bool| {
        let arrival = |(_, mark): &(usize, Mark)| match mark {
            Mark::Scene {
                arrival: Some(arrival), ..
            } => !wants_ramp || arrival.ramp.is_some(),
            _ => false,
        };
        recording.marks.iter().filter(|mark| arrival(mark)).count()
    };
    assert_eq!((arrivals(true), arrivals(false)), (4, 8));
    assert!(recording.rows.iter().any(|row| row.state == RigState::Stopped));
    let report = replay::replay(&recording.metadata, entries(&recording).map(Ok)).expect("it is replayed");
    assert_eq!((report.differing, &report.first_differing), (0, &None));
    assert_eq!((report.not_compared, report.uncompared.len()), (0, 0), "{report:?}");
    assert_eq!(report.with_force, live);
    let (printed, code) = ctl_json(&file, &[]);
    assert_eq!(
        (&printed["ticks"], &printed["differing"]),
        (&report.ticks.into(), &0.into())
    );
    assert_eq!((&printed["first_differing"], code), (&Value::Null, Some(0)));
    println!("{} ticks, {live} of them with force, are the same", report.compared());
}

#[test]
fn rig_behind_link_replays_its_forces_after_device_swap() {
    let _one = crate::one_of_two();
    let directory = tempfile::tempdir().expect("a directory");
    let link = directory.path().join("rig");
    let rig = FakeRig::start_at(&link, &["--hand", "arm"]);
    let daemon = Daemon::start_on(&rig.address(), &["--ramp-ms=20", "--velocity=foaw-end-fit"]);
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    // What a replay knows nothing of: an engagement before the recording.
    drop(daemon.ctl(&["engage", "--wait"]));
    drop(daemon.ctl(&["release", "--wait"]));
    let file = directory.path().join("session.mcap");
    let recorder = daemon.recorder(&file, &[]);
    wait_for_more_rows(&file, 300);
    drop(daemon.ctl(&["engage", "--wait"]));
    wait_for_more_rows(&file, 300);
    drop(daemon.ctl(&["release", "--wait"]));
    drop(rig);
    // A fault by a busy machine stays a fault without a device.
    wait_for(&mut client, "no device", |status| {
        status.device.link.as_ref().is_some_and(|link| link.device.is_none())
    });
    let _other = FakeRig::start_at(
        &link,
        &["--hand", "arm", "--resolution-mm", "0.05", "--force-limit-n", "7"],
    );
    wait_for(&mut client, "the other device", |status| {
        status.device.link.as_ref().is_some_and(|link| link.device.is_some())
    });
    drop(daemon.ctl(&["reset"]));
    wait_for_more_rows(&file, 300);
    // A busy machine may fault the rig: that is recorded, too.
    drop(daemon.ctl(&["engage", "--wait"]));
    wait_for_more_rows(&file, 300);
    assert!(end(recorder, Signal::INT).status.success());
    let (printed, _) = ctl_json(&file, &[]);
    assert_eq!(
        (&printed["differing"], &printed["first_differing"]),
        (&0.into(), &Value::Null),
        "{printed}"
    );
    let recording = haptic_recording::read(&file).expect("a recording");
    let newest = recording.marks.iter().rev().find_map(|(_, mark)| match mark {
        Mark::Servo { servo, .. } => Some(servo),
        _ => None,
    });
    let newest = newest.expect("another device was recorded");
    assert_eq!(
        (newest.device_resolution_m, newest.device_force_limit_n),
        (5e-5, Some(7.0))
    );
    println!("{printed}");
}

#[test]
fn a_recording_of_an_earlier_build_gives_its_forces_again() {
    let directory = tempfile::tempdir().expect("a directory");
    // As an earlier recorder wrote it: the servo settles within its rest.
    let without = directory.path().join("without-snapshots.csv");
    let text = std::fs::read_to_string(&fixtures()[0]).expect("the fixture");
    let kept: Vec<&str> = text
        .lines()
        .filter(|line| !line.contains(r#""mark":"snapshot""#))
        .collect();
    assert_eq!(kept.len() + 1, text.lines().count());
    std::fs::write(&without, kept.join("\n") + "\n").expect("it is written");
    let files = fixtures().into_iter().map(|file| (file, 0)).chain([(without, 300)]);
    for (file, most) in files {
        let (printed, code) = ctl_json(&file, &[]);
        assert_eq!(
            (&printed["differing"], code),
            (&0.into(), Some(0)),
            "{}: {printed}",
            file.display()
        );
        assert_eq!(printed["ticks"], 2300, "{printed}");
        assert!(printed["not_compared"].as_u64() <= Some(most), "{printed}");
        assert!(printed["with_force"].as_u64() > Some(1500), "{printed}");
    }
}

#[test]
fn recording_by_other_servo_is_named_and_still_rendered() {
    for file in recordings_of("0.1.0") {
        is_refused("0.1.0", &ctl(&file, &[]), 1, &["made by version 1 of the servo"]);
        let (rendered, code) = ctl_json(&file, &["--scheme", "exact"]);
        assert_eq!(
            (code, &rendered["what_if"]["ticks"]),
            (Some(0), &rendered["recorded"]["ticks"])
        );
    }
}

/// The first recording by an earlier build, with the cell of a column changed in one of its rows.
fn damaged(to: &Path, line: usize, column: &str, cell: &str) -> u64 {
    let text = std::fs::read_to_string(&fixtures()[0]).expect("the fixture");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let place = haptic_ipc::SAMPLE_COLUMNS.iter().position(|name| *name == column);
    let mut cells: Vec<&str> = lines[line].split(',').collect();
    let tick = cells[0].parse().expect("a row");
    cells[place.expect("a column")] = cell;
    lines[line] = cells.join(",");
    std::fs::write(to, lines.join("\n") + "\n").expect("it is written");
    tick
}

#[test]
fn the_first_tick_that_differs_is_named_and_the_exit_code_is_1() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("damaged.csv");
    let tick = damaged(&file, 700, "command_force_N", "1.5");
    let (printed, code) = ctl_json(&file, &[]);
    assert_eq!((&printed["differing"], code), (&1.into(), Some(1)), "{printed}");
    let first = &printed["first_differing"];
    assert_eq!(
        (&first["tick"], &first["column"]),
        (&tick.into(), &"command_force_N".into())
    );
    assert_eq!(first["recorded"], 1.5);
    assert!(
        first["likely"]
            .as_str()
            .is_some_and(|text| text.contains("revision 3 (karnopp)")),
        "{first}"
    );
    let printed = text(&ctl(&file, &[]).stdout);
    assert!(printed.contains(&format!("first at tick {tick}")), "{printed}");
}
