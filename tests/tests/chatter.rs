//! A scene that would chatter on the rig is refused wherever force flows or is to flow, unless it is asked for anyway.

use haptic_core::scene::Coupling;
use haptic_ipc::{
    AdviceReply, ChangeOptions, ChangeReply, Envelope, ErrorCode, Request, RigState, SceneRef, SceneReply, StateReply,
    Status, WireError,
};
use system_tests::fake_rig::FakeRig;
use system_tests::{Daemon, LIGHT_BLOCK, PAPER_SCENE, refused, status, text, timed, wait_for, wait_for_state};

/// As light and as weak as a rig of a kit, with next to no friction.
const LIGHT: [&str; 8] = [
    "--rig-mass-kg=0.1",
    "--rig-friction-n=0.15",
    "--rig-damping-ns-per-m=0",
    "--force-limit-n=5",
    "--hand=free",
    "--ramp-ms=20",
    "--scene",
    LIGHT_BLOCK,
];

fn stiff() -> Request {
    Request::set([("stiffness".to_owned(), 25_000.0)].into_iter().collect())
}

fn paper() -> Request {
    Request::load(SceneRef::Name("simulated-friction".to_owned()))
}

/// The same change with other options.
fn with(request: Request, change: impl FnOnce(&mut ChangeOptions)) -> Request {
    let mut request = request;
    match &mut request {
        Request::Set { options, .. } | Request::SceneLoad { options, .. } => change(options),
        other => panic!("{other:?} takes no options here"),
    }
    request
}

fn would_chatter(error: &WireError) {
    assert_eq!(error.code, ErrorCode::WouldChatter, "{error}");
    for part in [
        "changes sign",
        "times a second",
        "rig's limit",
        "would pass with a factor of 2",
        "--anyway",
    ] {
        assert!(error.message.contains(part), "{error} lacks {part}");
    }
    assert_eq!(
        (error.param.as_deref(), error.unit.as_deref()),
        (Some("stiffness"), Some("N/m"))
    );
    assert!(error.value > error.max && error.max > Some(0.0), "{error:?}");
}

// hazard: H30
#[test]
fn a_scene_that_would_chatter_now_or_later_is_not_engaged() {
    let daemon = Daemon::start(&LIGHT);
    let mut client = daemon.client();
    let ahead = status(&mut client).tick + 60_000;
    let _: ChangeReply = client
        .request(with(paper(), |options| options.at_tick = Some(ahead)))
        .expect("without force it may wait");
    would_chatter(&refused(&mut client, Request::engage()));
    daemon.ctl_ok(&["schedule", "cancel"]);
    let _: StateReply = client.request(Request::engage()).expect("nothing waits");
    let _: StateReply = client.request(Request::Release {}).expect("it has force");
    wait_for_state(&mut client, RigState::Idle);
    let _: ChangeReply = client
        .request(paper())
        .expect("without force it is a scene as any other");
    would_chatter(&refused(&mut client, Request::engage()));
    let reported = status(&mut client);
    assert_eq!(reported.state, RigState::Idle);
    let [problem] = &reported.device.engage_refused[..] else {
        panic!("{reported:?}");
    };
    assert!(problem.what.contains("would chatter"), "{problem:?}");
    assert!(problem.remedy.contains("--anyway"), "{problem:?}");
    assert!(reported.broken_bounds.contains(&"friction".to_owned()), "{reported:?}");
    for (command, parts) in [
        ("status", ["will not engage", "advice"]),
        ("doctor", ["fail  engage: the scene would chatter", "warn  scene: "]),
    ] {
        let printed = text(&daemon.ctl(&[command]).stdout);
        assert!(parts.iter().all(|part| printed.contains(part)), "{printed}");
    }
    daemon.ctl_refused(&["engage"], 1, "--anyway");
    // A stop comes before what may be done all the same.
    daemon.ctl_ok(&["stop"]);
    assert_eq!(refused(&mut client, Request::engage()).code, ErrorCode::Stopped);
    daemon.ctl_ok(&["reset"]);
    daemon.ctl_ok(&["engage", "--anyway", "--wait"]);
    let _: StateReply = client.request(Request::Release {}).expect("it has force");
    wait_for_state(&mut client, RigState::Idle);
    would_chatter(&refused(&mut client, Request::engage()));
    // What it proposes is engaged.
    let error = refused(&mut client, Request::engage());
    let proposed = error.max.expect("a stiffness");
    daemon.ctl_ok(&["set", &format!("stiffness={proposed}")]);
    let _: StateReply = client.request(Request::engage()).expect("it is calm");
}

// hazard: H30
#[test]
fn late_link_softens_coupling_or_prevents_engagement() {
    timed("a late link's coupling", || {
        let begun_on = |delay: &str, until: fn(&Status) -> bool| {
            let rig = FakeRig::start(&["--fault", delay]);
            let daemon = Daemon::start_on(&rig.address(), &[]);
            let mut client = daemon.client();
            wait_for(&mut client, "what comes of the delay", until);
            let scene: SceneReply = client.request(Request::Get { scene: None }).expect("a scene");
            let engaged = client.request::<StateReply>(Request::engage());
            (scene.scene.coupling.expect("a grip"), engaged.is_ok())
        };
        // As late as what gathers samples for 16 ms.
        let (grip, is_engaged) = begun_on("delay 8", |status| status.revision > 1);
        assert!(is_engaged && (20.0..100.0).contains(&grip.stiffness), "{grip:?}");
        let is_late = |status: &Status| {
            status
                .device
                .engage_refused
                .iter()
                .any(|why| why.what.contains("late: 8"))
        };
        assert_eq!(begun_on("delay 41", is_late), (Coupling::CALM, false));
    });
}

// hazard: H30
#[test]
fn under_force_no_change_leads_to_a_chatter() {
    let daemon = Daemon::start(&LIGHT);
    let mut client = daemon.client();
    let _: ChangeReply = client.request(paper()).expect("idle");
    let _: ChangeReply = client.request(Request::undo()).expect("a change");
    let _: StateReply = client.request(Request::engage()).expect("it is calm");
    wait_for_state(&mut client, RigState::Engaged);
    let before = status(&mut client);
    let (revision, ahead) = (before.revision, before.tick + 30_000);
    for request in [
        stiff(),
        paper(),
        Request::redo(),
        with(stiff(), |options| options.ramp_ms = Some(2000.0)),
        with(stiff(), |options| options.dry_run = true),
        with(paper(), |options| options.at_tick = Some(ahead)),
    ] {
        would_chatter(&refused(&mut client, request));
    }
    let line = serde_json::json!({"id": 1, "op": "schedule", "dry_run": true, "changes": [
        {"at_tick": ahead, "params": {"mass": 0.2}}, {"at_tick": ahead + 9, "scene": "simulated-friction"},
    ]});
    let schedule = Envelope::parse(&line.to_string()).expect("a request").request;
    let error = refused(&mut client, schedule.clone());
    would_chatter(&error);
    assert!(error.message.starts_with("changes[1]: "), "{error}");
    let _: serde_json::Value = client.request(schedule.anyway()).expect("it is wanted");
    assert_eq!(status(&mut client).revision, revision, "nothing has changed");

    // A gentle change is none of that, and what is wanted anyway is made once.
    daemon.ctl_ok(&["set", "mass=0.2"]);
    daemon.ctl_ok(&["scene", "load", "simulated-friction", "--anyway"]);
    let heavier = Request::set([("mass".to_owned(), 0.6)].into_iter().collect());
    would_chatter(&refused(&mut client, heavier));
    daemon.ctl_ok(&["undo"]);
    daemon.ctl_ok(&["redo", "--anyway"]);
    daemon.ctl_ok(&["undo"]);
}

// hazard: H30
#[test]
fn a_rig_of_unknown_mass_is_judged_as_a_light_one() {
    let _one = crate::one_of_two();
    let rig = FakeRig::start(&["--mass-kg=0.08", "--friction-n=0.1", "--force-limit-n=4", "--hand=free"]);
    let daemon = Daemon::start_on(&rig.address(), &["--scene", PAPER_SCENE, "--ramp-ms=20"]);
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    let error = refused(&mut client, Request::engage());
    would_chatter(&error);
    assert!(error.message.contains("taken as 0.1 kg"), "{error}");
    daemon.ctl_ok(&["scene", "load", "light-block"]);
    let _: StateReply = client.request(Request::engage()).expect("it is calm");
}

// hazard: H30
#[test]
fn the_first_look_breaks_no_bound() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut command = std::process::Command::new(system_tests::binary("hapticd"));
    command.arg("--demo").arg("--state-dir").arg(directory.path());
    let daemon = Daemon::spawn(command, &directory.path().join("control.sock"));
    let advice: AdviceReply = daemon.client().request(Request::Advise {}).expect("advice");
    let mut findings = advice.advice.iter().map(|advice| advice.finding.as_ref());
    assert!(
        findings.all(|finding| finding.is_some_and(|finding| finding.passes)),
        "{advice:?}"
    );
    wait_for_state(&mut daemon.client(), RigState::Engaged);
}

/// A program that lowers the one that is named would be refused again.
#[test]
fn no_parameter_is_named_where_two_must_change() {
    let daemon = Daemon::start(&LIGHT);
    daemon.ctl_ok(&["scene", "load", "light-block"]);
    daemon.ctl_ok(&["engage", "--wait"]);
    let mut client = daemon.client();
    let error = refused(
        &mut client,
        Request::set([("B".to_owned(), 1000.0)].into_iter().collect()),
    );
    assert_eq!(error.code, ErrorCode::WouldChatter, "{error}");
    assert!(error.message.contains(" and damping = "), "{error}");
    assert_eq!((error.param.as_deref(), error.unit.as_deref()), (None, Some("1/s")));
}
