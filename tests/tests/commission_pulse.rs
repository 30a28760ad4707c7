//! Whatever ends a commissioning in the middle of a pulse, the force ends with it.

use haptic_ipc::{CommissionReply, ErrorCode, LeaseReply, PulseEnd, Request, RigState, SceneRef, StateReply};
use serde_json::Value;
use std::process::{Command, Stdio};
use system_tests::commissioning::{
    OWN, PUSH_N, Ticks, after_the_pulse, begun, daemon, let_go, pulse, renders_the_scene,
};
use system_tests::fake_rig::FakeRig;
use system_tests::{binary, refused, status, timed, wait_for, wait_for_state};

// hazard: H13
#[test]
fn reversed_motor_ends_in_zero_force_and_is_not_kept() {
    timed("a commissioning of a reversed motor", || {
        let rig = FakeRig::start(&[&OWN[..], &["--reversed"]].concat());
        let (daemon, mut client) = daemon(&rig, &[]);
        let ticks = Ticks::of(&daemon);
        let message = daemon.ctl_refused(&["commission", "--yes"], 1, "wired the other way");
        assert!(message.contains("the wrong way"), "{message}");
        let rows = ticks.come_so_far();
        // From the first count against the force to the last force.
        let last = rows
            .iter()
            .rposition(|row| row.command_force_n != 0.0)
            .expect("a force");
        let force_n = rows[last].command_force_n;
        let moved = rows
            .iter()
            .position(|row| row.device_position_m * force_n.signum() < -0.5e-5)
            .expect("it moved against the force");
        assert!(
            rows[last].tick < rows[moved].tick + 50,
            "{:?} {:?}",
            rows[moved],
            rows[last]
        );
        let farthest = rows.iter().map(|row| row.device_position_m.abs()).fold(0.0, f64::max);
        assert!(farthest < 5e-3, "{farthest} m");
        wait_for_state(&mut client, RigState::Idle);
        assert_eq!(refused(&mut client, Request::engage()).code, ErrorCode::NotCommissioned);
        let kept = daemon.scene_dir().with_file_name("state").join("commissioned");
        assert!(!kept.exists(), "nothing is kept");
    });
}

// hazard: H13
#[test]
fn stop_in_pulse_acts_at_once_and_ends_commissioning() {
    timed("a stop in a pulse", || {
        let mut rig = FakeRig::start(&["--hand", "free"]);
        let (daemon, mut client) = daemon(&rig, &["--uncommissioned"]);
        let mut commissioner = begun(&daemon);
        let _: CommissionReply = commissioner.request(pulse(PUSH_N, 300.0)).expect("it is bounded");
        wait_for(&mut client, "a force", |_| rig.force().now_n > 0.5);
        let _: StateReply = client.request(Request::Stop {}).expect("a stop");
        wait_for(&mut client, "zero force", |_| rig.force().now_n == 0.0);
        let reply = after_the_pulse(&mut commissioner);
        assert_eq!(reply.ended.as_deref(), Some("the rig was stopped"));
        let error = refused(&mut commissioner, pulse(PUSH_N, 100.0));
        assert_eq!(error.code, ErrorCode::Stopped, "{error}");
        assert_eq!(status(&mut client).commissioning, None);
        let _: StateReply = client.request(Request::Reset {}).expect("it is stopped");
        assert_eq!(reply.last.expect("a pulse").end, PulseEnd::Interrupted);
        renders_the_scene(&daemon, &mut client);
    });
}

// hazard: H13
#[test]
fn haptic_ctl_killed_in_pulse_leaves_no_force() {
    timed("haptic-ctl killed in a pulse", || {
        let mut rig = FakeRig::start(&OWN);
        let (daemon, mut client) = daemon(&rig, &[]);
        let mut child = Command::new(binary("haptic-ctl"))
            .args(["commission", "--yes", "--socket"])
            .arg(daemon.socket())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("haptic-ctl starts");
        wait_for(&mut client, "a pulse", |_| rig.force().now_n.abs() > 0.1);
        child.kill().expect("it runs");
        child.wait().expect("it ends");
        wait_for(&mut client, "the end of it", |status| {
            status.commissioning.is_none() && !status.state.is_live()
        });
        wait_for(&mut client, "zero force", |_| rig.force().now_n == 0.0);
        let_go(&mut client);
        assert_eq!(refused(&mut client, Request::engage()).code, ErrorCode::NotCommissioned);
    });
}

// hazard: H13
#[test]
fn commissioning_locks_out_other_clients_and_names_the_holder() {
    let rig = FakeRig::start(&["--hand", "free"]);
    let (daemon, mut other) = daemon(&rig, &["--uncommissioned"]);
    let _: LeaseReply = other.request(Request::Lease { timeout_ms: 5000 }).expect("a lease");
    let error = refused(&mut other, Request::commission(None));
    assert!(error.message.contains("2000 ms"), "the lease is too long: {error}");
    let _: LeaseReply = other.request(Request::Lease { timeout_ms: 0 }).expect("no lease");

    let mut commissioner = begun(&daemon);
    let by = status(&mut other).commissioning.expect("somebody").to_string();
    for request in [
        Request::engage(),
        Request::load(SceneRef::Name("viscous-drag".to_owned())),
        Request::commission(None),
    ] {
        let error = refused(&mut other, request);
        assert_eq!(error.code, ErrorCode::Commissioning);
        assert!(error.message.contains(&by), "{error} lacks {by}");
    }
    assert_eq!(
        refused(&mut commissioner, Request::engage()).code,
        ErrorCode::Commissioning
    );
    for request in [
        pulse(1.0, 100.0),
        Request::CommissionStatus {},
        Request::CommissionEnd {},
    ] {
        assert_eq!(refused(&mut other, request).code, ErrorCode::WrongState);
    }
    // Half of what the rig may give, and no longer than a pulse may be.
    for (request, field) in [
        (pulse(-10.1, 100.0), "force_N"),
        (pulse(0.0, 100.0), "force_N"),
        (pulse(1.0, 301.0), "duration_ms"),
    ] {
        let error = refused(&mut commissioner, request);
        let facts = (error.code, error.param.as_deref());
        assert_eq!(facts, (ErrorCode::OutOfRange, Some(field)), "{error}");
    }
    let ended: CommissionReply = commissioner.request(Request::CommissionEnd {}).expect("it is ours");
    assert_eq!(ended.ended.as_deref(), Some("its client has ended it"));
    let set = Request::set([("mass".to_owned(), 1.5)].into_iter().collect());
    let _: Value = other.request(set).expect("the rig is everybody's again");
}
