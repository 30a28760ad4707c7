//! A rig is moved by its own motor to be identified: the real programs, and whatever ends it ends its force.

use haptic_core::{Course, Excitation};
use haptic_ipc::{
    Client, ErrorCode, ExcitationEnd, IdentificationReply, LeaseReply, Request, RigState, Sample, SceneRef, StateReply,
};
use serde_json::Value;
use system_tests::commissioning::{OWN, Ticks, daemon, lease, let_go, renders_the_scene};
use system_tests::fake_rig::FakeRig;
use system_tests::recorded::read;
use system_tests::{Daemon, plain, refused, status, timed, until_some, wait_for};

/// To and fro over some millimetres, for many seconds.
fn excitation() -> Excitation {
    Excitation {
        course: Course::Sweep {
            travel_m: 0.01,
            speed_mps: 0.02,
            rounds: 10,
        },
        force_limit_n: 3.0,
        slew_limit_n_per_s: 200.0,
        stiffness_n_per_m: 1000.0,
        damping_ns_per_m: 20.0,
        travel_limit_m: 0.015,
        speed_limit_mps: 0.3,
        lag_limit_m: 0.006,
        wrong_way_limit_m: 1e-4,
    }
}

/// A client that has the rig alone, of 100 mm of range.
fn begun(daemon: &Daemon) -> Client {
    let mut client = daemon.client();
    lease(&mut client);
    let _: IdentificationReply = client.request(BEGIN).expect("the rig is idle");
    client
}

const BEGIN: Request = Request::IdentifyBegin { range_m: Some(0.1) };

fn again() -> Request {
    Request::IdentifyExcite {
        excitation: excitation(),
    }
}

fn identification(client: &mut Client) -> IdentificationReply {
    client.request(Request::IdentifyStatus {}).expect("it is ours")
}

/// Asks until the excitation has ended.
fn after_it(client: &mut Client) -> IdentificationReply {
    until_some("it does not end", || {
        Some(identification(client)).filter(|reply| !reply.moving)
    })
}

/// A client whose excitation pulls.
fn pulling(daemon: &Daemon) -> Client {
    let mut identifier = begun(daemon);
    let _: IdentificationReply = identifier.request(again()).expect("it is bounded");
    wait_for(&mut identifier, "a force", |status| status.command_force_n.abs() > 0.3);
    let reply = identification(&mut identifier);
    assert!(reply.moving, "{reply:?}");
    identifier
}

fn without_force(client: &mut Client) {
    wait_for(client, "zero force", |status| status.command_force_n == 0.0);
}

fn is_over(row: &Sample) -> bool {
    !matches!(row.state, RigState::Engaging | RigState::Engaged | RigState::Releasing)
}

// hazard: F20
#[test]
fn a_longer_lease_ends_the_identification_and_its_force() {
    let daemon = Daemon::start(&["--hand=free"]);
    let mut identifier = pulling(&daemon);
    let longer = Request::Lease { timeout_ms: 60_000 };
    let _: LeaseReply = identifier.request(longer).expect("a lease");
    wait_for(&mut identifier, "no force", |status| status.state == RigState::Idle);
    let ended = identification(&mut identifier).ended.expect("it has ended");
    assert!(ended.contains("60000 ms") && ended.contains("2000 ms"), "{ended}");
    let error = refused(&mut identifier, again());
    assert!(error.message.contains("60000 ms"), "{error}");
}

// hazard: F20
#[test]
fn stop_in_excitation_acts_at_once_and_scene_returns() {
    let daemon = Daemon::start(&["--hand=free", "--ramp-ms=20"]);
    let mut client = daemon.client();
    let mut identifier = pulling(&daemon);
    let _: StateReply = client.request(Request::Stop {}).expect("a stop");
    without_force(&mut client);
    let reply = after_it(&mut identifier);
    assert_eq!(reply.ended.as_deref(), Some("the rig was stopped"));
    let last = reply.last.as_ref().expect("it had begun");
    assert_eq!(last.end, ExcitationEnd::Interrupted);
    let error = refused(&mut identifier, again());
    assert_eq!(error.code, ErrorCode::Stopped, "{error}");
    assert_eq!(status(&mut client).commissioning, None);
    // Its lease goes with it, before the rig is engaged by somebody else.
    drop(identifier);
    wait_for(&mut client, "its end", |status| status.clients == 1);
    let_go(&mut client);
    renders_the_scene(&daemon, &mut client);
}

// hazard: F20
#[test]
fn a_client_that_dies_in_an_excitation_takes_its_force_with_it() {
    // A ramp that is longer than any test waits: along it the force would go on.
    let daemon = Daemon::start(&["--hand=free", "--ramp-ms=600"]);
    let mut client = daemon.client();
    let identifier = pulling(&daemon);
    let ticks = Ticks::of(&daemon);
    drop(identifier);
    let rows = ticks.until("the end", is_over);
    wait_for(&mut client, "the end of it", |status| status.commissioning.is_none());
    without_force(&mut client);
    assert_eq!(rows.last().map(|row| row.state), Some(RigState::Idle));
    let released: Vec<&Sample> = rows.iter().filter(|row| row.state == RigState::Releasing).collect();
    assert!(!released.is_empty(), "{} rows", rows.len());
    // The tick that begins the release may be the one that takes the motion away.
    let forces = released.iter().filter(|row| row.command_force_n != 0.0).count();
    assert!(forces <= 50, "{forces} ticks with force along the release");
    renders_the_scene(&daemon, &mut client);
}

#[test]
fn identify_reply_gives_handle_position_and_travel_limit() {
    let mut rig = FakeRig::start(&["--hand", "free"]);
    let (daemon, mut client) = daemon(&rig, &["--uncommissioned"]);
    // Farther from the encoder's zero than half of the range.
    rig.fail("jump 8000");
    wait_for(&mut client, "the handle at 80 mm", |status| {
        (status.device_position_m - 0.08).abs() < 1e-3
    });
    let_go(&mut client);
    let reply = identification(&mut begun(&daemon));
    assert!((reply.position_m - 0.08).abs() < 1e-3, "{reply:?}");
    assert!((reply.travel_limit_m - 0.05).abs() < 1e-3, "{reply:?}");
}

// hazard: F20
#[test]
fn unplugged_rig_ends_excitation_and_returns_without_force() {
    timed("a rig that is unplugged in an excitation", || {
        let mut rig = FakeRig::start(&["--hand", "free"]);
        let (daemon, mut client) = daemon(&rig, &["--uncommissioned"]);
        let mut identifier = pulling(&daemon);
        rig.fail("hang-up 0.3");
        let reply = after_it(&mut identifier);
        assert!(reply.ended.is_some(), "{reply:?}");
        wait_for(&mut client, "the rig again", |status| {
            matches!(status.state, RigState::Idle | RigState::Faulted)
        });
        wait_for(&mut client, "zero force", |_| rig.force().now_n == 0.0);
        let error = refused(&mut identifier, again());
        assert!(error.message.contains("has ended"), "{error}");
        let_go(&mut client);
        assert_eq!(rig.force().now_n, 0.0);
    });
}

// hazard: H13
#[test]
fn only_a_commissioned_rig_of_a_known_range_is_identified() {
    let rig = FakeRig::start(&OWN);
    let (daemon, mut client) = daemon(&rig, &[]);
    lease(&mut client);
    let error = refused(&mut client, BEGIN);
    assert_eq!(error.code, ErrorCode::NotCommissioned, "{error}");
    drop((daemon, client, rig));
    let daemon = Daemon::start(&["--hand=free"]);
    let mut client = daemon.client();
    lease(&mut client);
    let error = refused(&mut client, Request::IdentifyBegin { range_m: None });
    assert!(error.message.contains("range"), "{error}");
}

// hazard: F20
#[test]
fn identification_locks_out_others_and_names_exceeded_bound() {
    let daemon = Daemon::start(&["--hand=free"]);
    let mut other = daemon.client();
    let error = refused(&mut other, BEGIN);
    assert!(error.message.contains("lease"), "{error}");
    let mut identifier = begun(&daemon);
    let by = status(&mut other).commissioning.expect("somebody").to_string();
    for request in [
        Request::engage(),
        Request::load(SceneRef::Name("viscous-drag".to_owned())),
        Request::commission(None),
        BEGIN,
    ] {
        lease(&mut other);
        let error = refused(&mut other, request);
        assert_eq!(error.code, ErrorCode::Commissioning, "{error}");
        assert!(
            error.message.contains(&by) && error.message.contains("identifying"),
            "{error}"
        );
    }
    let bounded: [(fn(&mut Excitation), _, _); 4] = [
        (|of| of.force_limit_n = 10.1, "force_limit_N", "N"),
        (|of| of.travel_limit_m = 0.051, "travel_limit_m", "m"),
        (|of| of.speed_limit_mps = 0.6, "speed_limit_mps", "m/s"),
        (|of| of.slew_limit_n_per_s = 1e5, "slew_limit_N_per_s", "N/s"),
    ];
    for (exceed, field, unit) in bounded {
        let mut excitation = excitation();
        exceed(&mut excitation);
        let error = refused(&mut identifier, Request::IdentifyExcite { excitation });
        let facts = (error.code, error.param.as_deref(), error.unit.as_deref());
        assert_eq!(facts, (ErrorCode::OutOfRange, Some(field), Some(unit)), "{error}");
        assert!(
            error.value.is_some() && error.min.is_some() && error.max.is_some(),
            "{error}"
        );
    }
    let ended: IdentificationReply = identifier.request(Request::IdentifyEnd {}).expect("it is ours");
    assert_eq!(ended.ended.as_deref(), Some("its client has ended it"));
    let change = Request::set([("mass", 1.5)].into_iter().collect());
    let _: Value = other.request(change).expect("the rig is everybody's again");
}

fn near(found: &Value, pointer: &str, truth: f64, tolerance: f64) {
    let value = found.pointer(pointer).and_then(Value::as_f64);
    let value = value.unwrap_or_else(|| panic!("{found} lacks {pointer}"));
    assert!(
        (value - truth).abs() <= tolerance * truth,
        "{pointer} = {value}, truly {truth}"
    );
}

#[test]
fn haptic_ctl_measures_the_rig_itself_and_its_load() {
    timed("a rig that measures itself, and what is on it, for a minute", || {
        // Nobody holds its handle.
        let daemon = Daemon::start(&[
            "--hand=free",
            "--rig-mass-kg=1.2",
            "--rig-friction-n=0.6",
            "--rig-damping-ns-per-m=2",
        ]);
        let usual = ["identify", "--yes", "--range-mm=100", "--chirp-s=6", "--ramps=1"];
        let rig = daemon.ctl_json(&[&usual[..], &["--rig"]].concat());
        println!("{rig}");
        near(&rig, "/mass_kg", 1.2, 0.03);
        for direction in ["positive", "negative"] {
            near(&rig, &format!("/dynamic_force_N/{direction}"), 0.6, 0.03);
            near(&rig, &format!("/viscous_Ns_per_m/{direction}"), 2.0, 0.1);
        }
        let path = rig["path"].as_str().expect("a path");
        let kept = std::fs::read_to_string(path).expect("it is kept");
        assert!(kept.contains("mass_kg"), "{kept}");

        let directory = tempfile::tempdir().expect("a directory");
        let file = directory.path().join("run.csv");
        let whole = ["--run", "--whole", "--record", plain(&file)];
        let whole = daemon.ctl_json(&[&usual[..], &whole].concat());
        println!("{whole}");
        near(&whole, "/mass_kg", 1.2, 0.03);
        let recording = read(&file);
        let is_excited = |row: &&Sample| row.input_flags >> 22 & 1 == 1;
        let excited = recording.rows.iter().filter(is_excited).count();
        assert!(excited > 10_000, "{excited} of {} rows", recording.rows.len());
        assert!(recording.metadata.notes.expect("notes").contains("drives the handle"));
        assert_eq!(status(&mut daemon.client()).state, RigState::Idle);
    });
}
