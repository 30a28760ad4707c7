//! A rig is commissioned by small pulses before it is engaged: the real programs, a fake rig with a
//! firmware of somebody's own behind a pseudo-terminal.

use haptic_core::scene::Coupling;
use haptic_ipc::{
    ChangeReply, Client, CommissionReply, ErrorCode, LeaseReply, LossSource, Request, RigState, SceneRef, SceneReply,
    StateReply,
};
use serde_json::{Value, json};
use std::path::Path;
use system_tests::commissioning::{
    OWN, PUSH_N, Ticks, after_the_pulse, begun, commission, daemon, daemon_at, pulse, renders_the_scene,
};
use system_tests::fake_rig::FakeRig;
use system_tests::terminal::Terminal;
use system_tests::{
    Daemon, ctl_command, engage, is_refused, plain, refused, status, stderr, text, timed, wait_for, wait_for_state,
};

// hazard: H13
#[test]
fn custom_rig_engages_only_once_commissioned_and_unchanged() {
    timed("a whole commissioning of a rig of one's own", || {
        let directory = tempfile::tempdir().expect("a directory");
        let link = directory.path().join("rig");
        let mut rig = FakeRig::start_at(&link, &[&OWN[..], &["--stops-mm", "15"]].concat());
        let (daemon, mut client) = daemon_at(&rig, directory.path(), &[]);

        let parts = [
            "mine 1.0",
            "never commissioned",
            "haptic-ctl commission",
            "--uncommissioned",
        ];
        is_refused("engage", &daemon.ctl(&["engage"]), 1, &parts);
        assert_eq!(refused(&mut client, Request::engage()).code, ErrorCode::NotCommissioned);
        let problems = status(&mut client).device.engage_refused;
        let is_advised = problems
            .iter()
            .any(|problem| problem.remedy.contains("haptic-ctl commission"));
        assert!(is_advised, "{problems:?}");
        let checked = text(&daemon.ctl(&["doctor"]).stdout);
        assert!(checked.contains("fail  engage: "), "{checked}");

        // A handle that is not in the middle: the first pulses of its friction meet an end, which takes up their
        // energy.
        let mut mover = begun(&daemon);
        for _ in 0..10 {
            let _: CommissionReply = mover.request(pulse(PUSH_N, 100.0)).expect("it is bounded");
            if after_the_pulse(&mut mover).position_m > 0.007 {
                break;
            }
        }
        drop(mover.request::<CommissionReply>(Request::CommissionEnd {}));
        drop(mover.request::<LeaseReply>(Request::Lease { timeout_ms: 0 }));
        let found = commission(&daemon, &[]);
        println!("{found}");
        let number = |pointer: &str| found.pointer(pointer).and_then(Value::as_f64).expect(pointer);
        assert_eq!(found["sign"], 1);
        for direction in ["positive", "negative"] {
            let friction_n = number(&format!("/friction_N/{direction}"));
            assert!((friction_n - 0.8).abs() <= 0.1 * 0.8, "{friction_n} N");
            let breakaway_n = number(&format!("/breakaway_N/{direction}"));
            assert!((0.8..=0.8 * 1.5).contains(&breakaway_n), "{breakaway_n} N");
        }
        assert!((number("/range_m") - 0.03).abs() <= 0.05 * 0.03, "{found}");
        assert!((number("/step_m") - 1e-5).abs() < 1e-9, "{found}");
        // A machine that is held up may keep the pulses from agreeing on the mass, and the search from ending.
        if let Some(mass_kg) = found["mass_kg"].as_f64() {
            assert!((mass_kg - 1.4).abs() <= 0.15 * 1.4, "{mass_kg} kg");
        }
        let coupling = &found["coupling"];
        if let Some(stiffness) = coupling["stiffness"].as_f64() {
            assert!(stiffness > 100.0 && stiffness < 30_000.0, "{found}");
            let surface = SceneRef::Name("high-stiction".to_owned());
            assert_eq!(grip(&mut client, Some(surface)), *coupling);
        }
        let friction = status(&mut client).device.rig_friction.expect("it is reported");
        assert_eq!(friction.friction_from, LossSource::Commissioned);
        assert!((friction.friction_n - 0.8).abs() <= 0.1 * 0.8, "{friction:?}");
        let path = found["path"].as_str().expect("a path");
        let kept = std::fs::read_to_string(path).expect("it is kept");
        for part in ["mine 1.0", "resolution_m", "friction_N"] {
            assert!(kept.contains(part), "{kept} lacks {part}");
        }

        // At once, and after a restart once somebody has stated that it is the same.
        renders_the_scene(&daemon, &mut client);
        assert_eq!(status(&mut client).device.engage_refused, []);
        drop((daemon, client));
        let surface = directory.path().join("surface.toml");
        std::fs::write(&surface, include_str!("../../scenes/high-stiction.toml")).expect("it can be written");
        let (daemon, mut client) = daemon_at(&rig, directory.path(), &["--scene", plain(&surface)]);
        if coupling.is_object() {
            wait_for(&mut client, "the rig's coupling", |status| status.revision == 2);
            assert_eq!(grip(&mut client, None), *coupling);
        }
        drop((daemon, client));
        let (daemon, mut client) = daemon_at(&rig, directory.path(), &[]);
        assert_eq!(refused(&mut client, Request::engage()).code, ErrorCode::MaybeAnotherRig);
        let _: StateReply = client
            .request(Request::CommissionConfirm {})
            .expect("it was commissioned");
        renders_the_scene(&daemon, &mut client);

        // Another rig behind the same path. A scene that leaves its grip to the rig takes it anew.
        let load = Request::load(SceneRef::Name("high-stiction".to_owned()));
        let loaded: ChangeReply = client.request(load).expect("it is loaded");
        if coupling.is_object() {
            assert_eq!(grip(&mut client, None), *coupling);
        }
        for (other, code, why) in [
            (
                ["--firmware-name=mine 1.0", "--resolution-mm=0.005"],
                ErrorCode::NotCommissioned,
                "5.0000 um",
            ),
            (
                ["--firmware-name=theirs 2", "--resolution-mm=0.01"],
                ErrorCode::MaybeAnotherRig,
                "theirs 2",
            ),
        ] {
            rig = plugged_in(rig, &link, &other, &mut client);
            let error = refused(&mut client, Request::engage());
            assert_eq!(error.code, code, "{error}");
            assert!(error.message.contains(why), "{error} lacks {why}");
            if code == ErrorCode::NotCommissioned && coupling.is_object() {
                wait_for(&mut client, "another grip", |status| status.revision > loaded.revision);
                assert_eq!(grip(&mut client, None), json!(Coupling::CALM));
            }
        }
        drop(rig);
    });
}

/// How firmly a scene grips, or the one that is rendered.
fn grip(client: &mut Client, scene: Option<SceneRef>) -> Value {
    let reply: SceneReply = client.request(Request::Get { scene }).expect("a scene");
    json!(reply.scene.coupling)
}

/// Another rig in the place of one; it is idle.
fn plugged_in(rig: FakeRig, link: &Path, other: &[&str], client: &mut Client) -> FakeRig {
    let before = status(client).device.link.map_or(0, |link| link.counts.connections);
    drop(rig);
    let rig = FakeRig::start_at(link, other);
    wait_for(client, "another connection", |status| {
        let link = status.device.link.as_ref().expect("a link");
        link.counts.connections > before && link.device.is_some() && status.state == RigState::Idle
    });
    rig
}

// hazard: H27
#[test]
fn board_without_serial_number_is_confirmed_at_each_connection() {
    timed("a board without a serial number", || {
        let directory = tempfile::tempdir().expect("a directory");
        let link = directory.path().join("rig");
        let rig = FakeRig::start_at(&link, &OWN);
        let (daemon, mut client) = daemon_at(&rig, directory.path(), &[]);
        let ticks = Ticks::of(&daemon);
        let check = ["commission", "--check", "--yes"];
        daemon.ctl_refused(&check, 1, "never commissioned");
        let is_pushed = ticks.come_so_far().iter().any(|row| row.command_force_n != 0.0);
        assert!(!is_pushed, "no push");
        commission(&daemon, &["--range", "skip"]);
        engage(&mut client);

        // Another board, which pulls the other way.
        let rig = plugged_in(rig, &link, &[&OWN[..], &["--reversed"]].concat(), &mut client);
        let error = refused(&mut client, Request::engage());
        assert_eq!(error.code, ErrorCode::MaybeAnotherRig, "{error}");
        for part in ["no serial number", "commission --check", "engage --same-rig"] {
            assert!(error.message.contains(part), "{error} lacks {part}");
        }
        let ticks = Ticks::of(&daemon);
        let checked = daemon.ctl(&check);
        let reason = stderr(&checked);
        assert!(
            !checked.status.success() && reason.contains("the other way"),
            "{reason}"
        );
        let forces_n = ticks.come_so_far().into_iter().map(|row| row.command_force_n.abs());
        let largest_n = forces_n.fold(0.0, f64::max);
        assert!((0.5..=1.0).contains(&largest_n), "{largest_n} N");
        assert_eq!(refused(&mut client, Request::engage()).code, ErrorCode::NotCommissioned);
        daemon.ctl_refused(&["engage", "--same-rig"], 1, "moved the handle the wrong way");

        // The first again: a push shows it, or a person says so; each time that it is plugged in.
        let rig = plugged_in(rig, &link, &OWN, &mut client);
        let printed = daemon.ctl_ok(&check);
        assert!(printed.contains("moves as it was commissioned"), "{printed}");
        renders_the_scene(&daemon, &mut client);
        let rig = plugged_in(rig, &link, &OWN, &mut client);
        assert_eq!(refused(&mut client, Request::engage()).code, ErrorCode::MaybeAnotherRig);
        daemon.ctl_ok(&["engage", "--same-rig", "--wait"]);
        let _: StateReply = client.request(Request::Release {}).expect("it is engaged");
        wait_for_state(&mut client, RigState::Idle);
        drop(rig);
    });
}

// hazard: H27
#[test]
fn a_device_that_calls_itself_fake_rig_needs_a_commissioning() {
    let rig = FakeRig::start(&[]);
    let (_daemon, mut client) = daemon(&rig, &[]);
    assert_eq!(refused(&mut client, Request::engage()).code, ErrorCode::NotCommissioned);
}

#[test]
fn refused_commissioning_or_identification_takes_no_force_away() {
    let daemon = Daemon::start_on("fake", &["--hand", "free"]);
    let mut client = daemon.client();
    engage(&mut client);
    for arguments in [
        &["commission", "--yes"][..],
        &["identify", "--rig", "--yes", "--range-mm", "60"],
    ] {
        daemon.ctl_refused(arguments, 1, "while the rig is engaged");
        let log = daemon.ctl_ok(&["log"]);
        assert!(!log.contains("lease_lapsed"), "{log}");
        assert_eq!(status(&mut client).state, RigState::Engaged, "{arguments:?}");
    }
}

// hazard: H13
#[test]
fn a_failed_save_is_reported_and_leaves_the_rig_uncommissioned() {
    let directory = tempfile::tempdir().expect("a directory");
    // A file stands where the directory should be: not even root can write there.
    let folder = directory.path().join("state");
    std::fs::write(&folder, "").expect("a file");
    let daemon = Daemon::start_in(directory.path(), "fake", &["--hand", "free", "--ramp-ms", "20"]);
    // haptic-ctl finds it before the first pulse.
    daemon.ctl_refused(&["commission", "--yes"], 1, "nothing was moved");
    std::fs::remove_file(&folder).expect("it is ours");
    let mut client = begun(&daemon);
    std::fs::write(&folder, "").expect("a file");
    for force_n in [PUSH_N, -PUSH_N].into_iter().cycle().take(8) {
        let _: CommissionReply = client.request(pulse(force_n, 100.0)).expect("it is at rest");
        after_the_pulse(&mut client);
    }
    let store = Request::CommissionStore {
        range_m: None,
        friction_n: None,
        mass_kg: None,
    };
    let error = refused(&mut client, store);
    assert_eq!(error.code, ErrorCode::StateFile, "{error}");
    assert!(
        error.message.contains(plain(&folder)) && error.message.contains("--state-dir"),
        "{error}"
    );
}

#[test]
fn commissioning_asks_before_each_step_and_before_keeping() {
    timed("the questions of a commissioning", || {
        let rig = FakeRig::start(&[&OWN[..], &["--stops-mm", "5"]].concat());
        let directory = tempfile::tempdir().expect("a directory");
        let scene = directory.path().join("mine.toml");
        let text = "coupling = \"rig\"\n[block]\nmass = 0.1\n[friction]\nlaw = \"viscous\"\nviscous = 1.0\n";
        std::fs::write(&scene, text).expect("it can be written");
        let (daemon, mut client) = daemon(&rig, &["--scene", plain(&scene)]);
        daemon.ctl_refused(&["commission"], 2, "--yes");

        let on_a_terminal = |arguments: &[&str]| Terminal::start(ctl_command(daemon.socket(), arguments));
        let mut terminal = on_a_terminal(&["commission"]);
        terminal.wait_for("the first question", |shown| shown.contains("1. Direction"));
        assert_eq!(status(&mut client).state, RigState::Idle, "nothing moves before a yes");
        assert!(status(&mut client).commissioning.is_some());
        terminal.type_in("\n");
        assert_eq!(terminal.end().code(), Some(130), "no is what is meant without a word");
        assert!(terminal.written().contains("Nothing is kept"), "{}", terminal.written());
        wait_for(&mut client, "the end of it", |status| status.commissioning.is_none());

        let mut terminal = on_a_terminal(&["commission", "--range", "by-hand"]);
        for question in [
            "1. Direction",
            "2. Friction",
            "3. Range: the motor is off",
            "Keep this?",
        ] {
            let shown = terminal.wait_for(question, |shown| {
                shown.contains(question) || shown.contains("has ended")
            });
            assert!(shown.contains(question), "{shown}");
            terminal.type_in("y\n");
        }
        assert_eq!(terminal.end().code(), Some(0), "{}", terminal.written());
        let written = terminal.written();
        for part in ["is commissioned", "friction", "range", "encoder step", "kept in"] {
            assert!(written.contains(part), "{written} lacks {part}");
        }
        // A machine that is held up may keep the search for a grip from ending.
        if written.contains("The stiffest grip") {
            let stated = format!("has this grip, as revision {}", status(&mut client).revision);
            assert!(written.contains(&stated), "{written} lacks {stated}");
        }
        engage(&mut client);
    });
}
