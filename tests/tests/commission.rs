//! A rig is commissioned by small pulses before it is engaged: the real programs, a fake rig with a
//! firmware of somebody's own behind a pseudo-terminal.

use haptic_ipc::{
    Client, ClientError, CommissionReply, ErrorCode, Event, LeaseReply, LogReply, PulseEnd, Request, RigState, Sample,
    SceneRef, SceneReply, StateReply, SubscribeReply, Topic, WireError,
};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};
use system_tests::fake_rig::FakeRig;
use system_tests::terminal::Terminal;
use system_tests::{Daemon, PATIENCE, binary, ctl, engage, status, wait_for, wait_for_state};

/// A firmware that nobody has commissioned, and a handle that nobody holds.
const OWN: [&str; 4] = ["--firmware-name", "mine 1.0", "--hand", "free"];

/// A ramp that does not take long.
const SHORT_RAMP: [&str; 2] = ["--ramp-ms", "20"];

/// A pulse of the fake rig's 1.4 kg against its 0.8 N, N.
const PUSH_N: f64 = 2.0;

fn daemon(rig: &FakeRig, arguments: &[&str]) -> (Daemon, Client) {
    daemon_with(rig, &[&SHORT_RAMP, arguments].concat())
}

fn daemon_with(rig: &FakeRig, arguments: &[&str]) -> (Daemon, Client) {
    let daemon = Daemon::start_on(&rig.address(), arguments);
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    (daemon, client)
}

/// A daemon whose state outlives it.
fn daemon_at(rig: &FakeRig, directory: &Path, arguments: &[&str]) -> (Daemon, Client) {
    let mut command = Command::new(binary("hapticd"));
    command
        .args(["--device", &rig.address()])
        .args(SHORT_RAMP)
        .arg("--state-dir")
        .arg(directory.join("state"))
        .args(arguments);
    let daemon = Daemon::spawn(command, &directory.join("run/control.sock"));
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    (daemon, client)
}

/// The code of the refusal of a request.
fn refused(client: &mut Client, request: Request) -> WireError {
    let asked = format!("{request:?}");
    match client.request::<Value>(request) {
        Err(ClientError::Refused(error)) => error,
        other => panic!("{asked}: {other:?}"),
    }
}

/// Runs the whole of it; again where a busy machine faulted the rig on the way. What it printed.
fn commission(socket: &Path, client: &mut Client, arguments: &[&str]) -> Value {
    let began = Instant::now();
    loop {
        let output = ctl(socket, &[&["--json", "commission", "--yes"], arguments].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.success() {
            return serde_json::from_slice(&output.stdout).expect("findings");
        }
        let busy = ["faulted", "disconnected", "loses records"]
            .iter()
            .any(|why| said.contains(why));
        assert!(busy && began.elapsed() < 4 * PATIENCE, "{said}");
        println!("once more, the machine is busy: {said}");
        let_go(client);
    }
}

/// A client with a lease that has begun.
fn begun(daemon: &Daemon) -> Client {
    let mut client = daemon.client();
    let _: LeaseReply = client.request(Request::Lease { timeout_ms: 2000 }).expect("a lease");
    let _: CommissionReply = client.request(Request::CommissionBegin {}).expect("the rig is idle");
    client
}

fn pulse(force_n: f64, duration_ms: f64) -> Request {
    Request::CommissionPulse {
        force_n,
        duration_ms: Some(duration_ms),
    }
}

/// Asks until a pulse has ended.
fn after_the_pulse(client: &mut Client) -> CommissionReply {
    let began = Instant::now();
    loop {
        let reply: CommissionReply = client.request(Request::CommissionStatus {}).expect("it is ours");
        if !reply.pulsing {
            return reply;
        }
        assert!(began.elapsed() < PATIENCE, "the pulse does not end: {reply:?}");
    }
}

/// Every tick from now on, until it is dropped.
struct Ticks {
    rows: mpsc::Receiver<Sample>,
}

impl Ticks {
    fn of(daemon: &Daemon) -> Self {
        let mut client = daemon.client();
        let _: SubscribeReply = client
            .request(Request::Subscribe {
                topics: vec![Topic::Samples],
                rate_hz: None,
                batch_ms: Some(1),
            })
            .expect("it is served");
        let (heard, rows) = mpsc::channel();
        std::thread::spawn(move || {
            while let Ok(event) = client.next_event() {
                if let Event::Samples(samples) = event {
                    for row in samples.rows {
                        if heard.send(row).is_err() {
                            return;
                        }
                    }
                }
            }
        });
        Self { rows }
    }

    /// Those up to the first that is as wanted, which is the last of them.
    fn until(&self, what: &str, wanted: impl Fn(&Sample) -> bool) -> Vec<Sample> {
        let began = Instant::now();
        let mut rows = Vec::new();
        while began.elapsed() < PATIENCE {
            if let Ok(row) = self.rows.recv_timeout(Duration::from_millis(100)) {
                rows.push(row);
                if wanted(&row) {
                    return rows;
                }
            }
        }
        panic!("waited in vain for {what}: {:?}", rows.last());
    }

    fn come_so_far(&self) -> Vec<Sample> {
        self.rows.try_iter().collect()
    }
}

/// Until the rig is idle, whatever a busy machine does to it on the way.
fn let_go(client: &mut Client) {
    let began = Instant::now();
    loop {
        let next = match status(client).state {
            RigState::Idle => return,
            RigState::Engaging | RigState::Engaged => Request::Release {},
            RigState::Stopped | RigState::Faulted => Request::Reset {},
            RigState::Releasing | RigState::Disconnected => Request::Status {},
        };
        // Its state may have changed since.
        drop(client.request::<Value>(next));
        assert!(
            began.elapsed() < PATIENCE,
            "waited in vain for idle: {:?}",
            status(client)
        );
    }
}

/// Engaged, a block at rest is stuck in the paper's scene; where a pulse was left in its place,
/// nothing would hold it.
fn renders_the_scene(daemon: &Daemon, client: &mut Client) {
    let scene: SceneReply = client.request(Request::get()).expect("a scene");
    assert_eq!(scene.revision, 1, "it is the one of before");
    let ticks = Ticks::of(daemon);
    engage(client);
    let rows = ticks.until("an engaged tick", |row| row.state == RigState::Engaged);
    assert_eq!(rows.last().map(|row| row.contact), Some(0), "the scene is not back");
    let_go(client);
}

// hazard: H13
#[test]
fn a_rig_of_ones_own_engages_only_once_it_is_commissioned_and_as_long_as_it_is_the_same() {
    let _alone = crate::alone();
    let directory = tempfile::tempdir().expect("a directory");
    let link = directory.path().join("rig");
    let mut rig = FakeRig::start_at(&link, &[&OWN[..], &["--stops-mm", "15"]].concat());
    let (daemon, mut client) = daemon_at(&rig, directory.path(), &[]);

    let output = daemon.ctl(&["engage"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    for part in [
        "mine 1.0",
        "never commissioned",
        "haptic-ctl commission",
        "--uncommissioned",
    ] {
        assert!(said.contains(part), "{said} lacks {part}");
    }
    assert_eq!(
        refused(&mut client, Request::Engage {}).code,
        ErrorCode::NotCommissioned
    );
    let problems = status(&mut client).device.engage_refused;
    assert!(
        problems
            .iter()
            .any(|problem| problem.remedy.contains("haptic-ctl commission")),
        "{problems:?}"
    );
    let doctor = daemon.ctl(&["doctor"]);
    let checked = String::from_utf8_lossy(&doctor.stdout).into_owned();
    assert!(checked.contains("fail  engage: "), "{checked}");

    let found = commission(daemon.socket(), &mut client, &[]);
    println!("{found}");
    let number = |pointer: &str| found.pointer(pointer).and_then(Value::as_f64).expect(pointer);
    assert_eq!(found["sign"], 1);
    for direction in ["positive", "negative"] {
        let friction_n = number(&format!("/friction_N/{direction}"));
        assert!((friction_n - 0.8).abs() <= 0.2 * 0.8, "{friction_n} N");
        let breakaway_n = number(&format!("/breakaway_N/{direction}"));
        assert!((0.8..=0.8 * 1.5).contains(&breakaway_n), "{breakaway_n} N");
    }
    assert!((number("/range_m") - 0.03).abs() <= 0.05 * 0.03, "{found}");
    assert!((number("/step_m") - 1e-5).abs() < 1e-9, "{found}");
    let path = found["path"].as_str().expect("a path");
    let kept = std::fs::read_to_string(path).expect("it is kept");
    for part in ["mine 1.0", "resolution_m", "friction_N"] {
        assert!(kept.contains(part), "{kept} lacks {part}");
    }

    // At once, and after a restart.
    renders_the_scene(&daemon, &mut client);
    assert_eq!(status(&mut client).device.engage_refused, []);
    drop((daemon, client));
    let (daemon, mut client) = daemon_at(&rig, directory.path(), &[]);
    renders_the_scene(&daemon, &mut client);

    // Another rig behind the same path.
    for (other, why) in [
        (["--firmware-name", "mine 1.0", "--resolution-mm", "0.005"], "5.0000 um"),
        (["--firmware-name", "theirs 2", "--resolution-mm", "0.01"], "theirs 2"),
    ] {
        let before = status(&mut client)
            .device
            .link
            .map_or(0, |link| link.counts.connections);
        drop(rig);
        rig = FakeRig::start_at(&link, &other);
        wait_for(&mut client, "another connection", |status| {
            let link = status.device.link.as_ref().expect("a link");
            link.counts.connections > before && link.device.is_some() && status.state == RigState::Idle
        });
        let error = refused(&mut client, Request::Engage {});
        assert_eq!(error.code, ErrorCode::NotCommissioned, "{error}");
        assert!(error.message.contains(why), "{error} lacks {why}");
    }
    drop(rig);
}

// hazard: H13
#[test]
fn with_uncommissioned_in_the_configuration_any_rig_engages() {
    let _alone = crate::alone();
    let rig = FakeRig::start(&OWN);
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("hapticd.toml");
    std::fs::write(&path, "uncommissioned = true\n").expect("written");
    let (_daemon, mut client) = daemon(&rig, &["--config", path.to_str().expect("a plain path")]);
    assert_eq!(status(&mut client).device.engage_refused, []);
    engage(&mut client);
}

// hazard: H13
#[test]
fn a_motor_that_is_wired_the_other_way_ends_in_zero_force_and_is_not_kept() {
    let _alone = crate::alone();
    let rig = FakeRig::start(&[&OWN[..], &["--reversed"]].concat());
    let (daemon, mut client) = daemon(&rig, &[]);
    let began = Instant::now();
    let (rows, said) = loop {
        let ticks = Ticks::of(&daemon);
        let output = daemon.ctl(&["commission", "--yes"]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{said}");
        if said.contains("wired the other way") {
            break (ticks.come_so_far(), said);
        }
        assert!(began.elapsed() < 4 * PATIENCE, "{said}");
        println!("once more, the machine is busy: {said}");
        let_go(&mut client);
    };
    assert!(said.contains("the wrong way"), "{said}");
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
    println!(
        "zero force {} ticks after the handle first moved",
        rows[last].tick - rows[moved].tick + 1
    );
    assert!(
        rows[last].tick < rows[moved].tick + 50,
        "{:?} {:?}",
        rows[moved],
        rows[last]
    );
    let farthest = rows.iter().map(|row| row.device_position_m.abs()).fold(0.0, f64::max);
    assert!(farthest < 5e-3, "{farthest} m");
    wait_for_state(&mut client, RigState::Idle);
    assert_eq!(
        refused(&mut client, Request::Engage {}).code,
        ErrorCode::NotCommissioned
    );
    let kept = daemon.scene_dir().with_file_name("state").join("commissioned");
    assert!(!kept.exists(), "nothing is kept");
}

// hazard: H13
#[test]
fn a_stop_in_a_pulse_acts_at_once_and_ends_the_commissioning_and_the_scene_comes_back() {
    let _alone = crate::alone();
    let mut rig = FakeRig::start(&["--hand", "free"]);
    let (daemon, mut client) = daemon(&rig, &[]);
    let began = Instant::now();
    loop {
        let mut commissioner = begun(&daemon);
        let _: CommissionReply = commissioner.request(pulse(PUSH_N, 300.0)).expect("it is bounded");
        let pulls = loop {
            if rig.force().now_n > 0.5 {
                break true;
            }
            let reply: CommissionReply = commissioner.request(Request::CommissionStatus {}).expect("it is ours");
            if !reply.pulsing {
                break false;
            }
        };
        let _: StateReply = client.request(Request::Stop {}).expect("a stop");
        wait_for(&mut client, "zero force", |_| rig.force().now_n == 0.0);
        let reply = after_the_pulse(&mut commissioner);
        if reply.ended.as_deref() != Some("the rig was stopped") {
            println!("once more, the machine is busy: {reply:?}");
            let_go(&mut client);
            assert!(began.elapsed() < PATIENCE, "{reply:?}");
            continue;
        }
        let error = refused(&mut commissioner, pulse(PUSH_N, 100.0));
        assert_eq!(error.code, ErrorCode::Stopped, "{error}");
        let error = refused(
            &mut commissioner,
            Request::CommissionStore {
                range_m: None,
                friction_n: None,
            },
        );
        assert_eq!(error.code, ErrorCode::Stopped, "{error}");
        assert_eq!(status(&mut client).commissioning, None);
        let _: StateReply = client.request(Request::Reset {}).expect("it is stopped");
        if pulls {
            assert_eq!(reply.last.expect("a pulse").end, PulseEnd::Interrupted);
            break;
        }
        assert!(began.elapsed() < PATIENCE, "no pulse was seen");
    }
    renders_the_scene(&daemon, &mut client);
}

// hazard: H13
#[test]
fn what_cannot_be_kept_is_told_and_the_rig_stays_uncommissioned() {
    let _alone = crate::alone();
    let directory = tempfile::tempdir().expect("a directory");
    // A file stands where the directory should be: not even root can write there.
    let state = directory.path().join("state");
    std::fs::write(&state, "").expect("a file");
    let state = state.to_str().expect("a plain path");
    let arguments = ["--hand", "free", "--ramp-ms", "20", "--state-dir", state];
    let daemon = Daemon::start_at(&directory.path().join("control.sock"), &arguments);
    let mut client = begun(&daemon);
    for force_n in [PUSH_N, -PUSH_N] {
        let _: CommissionReply = client.request(pulse(force_n, 100.0)).expect("it is at rest");
        after_the_pulse(&mut client);
    }
    let error = refused(
        &mut client,
        Request::CommissionStore {
            range_m: None,
            friction_n: None,
        },
    );
    assert_eq!(error.code, ErrorCode::StateFile, "{error}");
    assert!(
        error.message.contains(state) && error.message.contains("--state-dir"),
        "{error}"
    );
}

// hazard: H13
#[test]
fn a_client_that_dies_in_a_pulse_takes_its_force_with_it() {
    let _alone = crate::alone();
    let rig = FakeRig::start(&["--hand", "free"]);
    // A ramp that is longer than the pulse: along it the force would go on.
    let (daemon, mut client) = daemon_with(&rig, &["--ramp-ms", "600"]);
    let began = Instant::now();
    loop {
        let ticks = Ticks::of(&daemon);
        let mut commissioner = begun(&daemon);
        let _: CommissionReply = commissioner.request(pulse(PUSH_N, 300.0)).expect("it is bounded");
        let is_over = |row: &Sample| !row.state.is_live() && row.state != RigState::Idle;
        let rows = ticks.until("a force", |row| row.command_force_n > 0.5 || is_over(row));
        drop(commissioner);
        let mut ended = rows.last().is_some_and(is_over);
        let rows = ticks.until("the end", |row| row.state == RigState::Idle || is_over(row));
        ended |= rows.last().is_some_and(is_over);
        if ended {
            println!("once more, the machine is busy");
            wait_for(&mut client, "the end of it", |status| status.commissioning.is_none());
            let_go(&mut client);
            assert!(began.elapsed() < PATIENCE, "no pulse was seen");
            continue;
        }
        let live = rows.iter().filter(|row| row.command_force_n != 0.0).count();
        let releasing = rows
            .iter()
            .filter(|row| row.state == RigState::Releasing && row.command_force_n != 0.0)
            .count();
        assert_eq!(releasing, 0, "force on the way out");
        wait_for(&mut client, "the end of it", |status| status.commissioning.is_none());
        // On a busy machine the pulse may have been over before this was heard.
        if live < 200 {
            println!("{live} ticks with force after it was seen, of some 270");
            break;
        }
        assert!(began.elapsed() < PATIENCE, "no pulse was cut");
    }
    let log: LogReply = client
        .request(Request::Log {
            after: None,
            limit: None,
        })
        .expect("a log");
    assert!(log.entries.iter().any(|entry| entry.op == "lease_lapsed"), "{log:?}");
    renders_the_scene(&daemon, &mut client);
}

// hazard: H13
#[test]
fn haptic_ctl_killed_in_a_pulse_leaves_no_force_and_nothing_kept() {
    let _alone = crate::alone();
    let mut rig = FakeRig::start(&OWN);
    let (daemon, mut client) = daemon(&rig, &[]);
    let start = || {
        Command::new(binary("haptic-ctl"))
            .args(["commission", "--yes", "--socket"])
            .arg(daemon.socket())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("haptic-ctl starts")
    };
    let mut child = start();
    let began = Instant::now();
    while rig.force().now_n.abs() <= 0.1 {
        assert!(began.elapsed() < PATIENCE, "no pulse was seen");
        if child.try_wait().expect("it is ours").is_some() {
            println!("once more, the machine is busy");
            let_go(&mut client);
            child = start();
        }
    }
    child.kill().expect("it runs");
    child.wait().expect("it ends");
    wait_for(&mut client, "the end of it", |status| {
        status.commissioning.is_none() && !status.state.is_live()
    });
    wait_for(&mut client, "zero force", |_| rig.force().now_n == 0.0);
    let_go(&mut client);
    assert_eq!(
        refused(&mut client, Request::Engage {}).code,
        ErrorCode::NotCommissioned
    );
}

// hazard: H13
#[test]
fn nobody_else_moves_the_rig_or_its_scene_meanwhile_and_is_told_by_whom() {
    let _alone = crate::alone();
    let rig = FakeRig::start(&["--hand", "free"]);
    let (daemon, mut other) = daemon(&rig, &[]);
    let error = refused(&mut other, Request::CommissionBegin {});
    assert_eq!(error.code, ErrorCode::WrongState);
    assert!(error.message.contains("lease"), "{error}");
    let _: LeaseReply = other.request(Request::Lease { timeout_ms: 5000 }).expect("a lease");
    assert!(
        refused(&mut other, Request::CommissionBegin {})
            .message
            .contains("2000 ms"),
        "too long"
    );
    let _: LeaseReply = other.request(Request::Lease { timeout_ms: 0 }).expect("no lease");

    let mut commissioner = begun(&daemon);
    let by = status(&mut other).commissioning.expect("somebody").to_string();
    let set = Request::set([("mass".to_owned(), 1.5)].into_iter().collect());
    for request in [
        Request::Engage {},
        set.clone(),
        Request::load(SceneRef::Name("viscous-drag".to_owned())),
        Request::CommissionBegin {},
    ] {
        let error = refused(&mut other, request);
        assert_eq!(error.code, ErrorCode::Commissioning);
        assert!(error.message.contains(&by), "{error} lacks {by}");
    }
    assert_eq!(
        refused(&mut commissioner, Request::Engage {}).code,
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
        (pulse(10.1, 100.0), "force_N"),
        (pulse(-10.1, 100.0), "force_N"),
        (pulse(0.0, 100.0), "force_N"),
        (pulse(1.0, 301.0), "duration_ms"),
        (pulse(1.0, 1.0), "duration_ms"),
    ] {
        let error = refused(&mut commissioner, request);
        assert_eq!(
            (error.code, error.param.as_deref()),
            (ErrorCode::OutOfRange, Some(field)),
            "{error}"
        );
    }
    // Who only looks may, and a release ends a pulse as a stop does.
    let _: Value = other.request(Request::Status {}).expect("a status");
    let error = refused(
        &mut commissioner,
        Request::CommissionStore {
            range_m: None,
            friction_n: None,
        },
    );
    assert!(error.message.contains("no positive pulse"), "{error}");
    let ended: CommissionReply = commissioner.request(Request::CommissionEnd {}).expect("it is ours");
    assert_eq!(ended.ended.as_deref(), Some("its client has ended it"));
    let _: Value = other.request(set).expect("the rig is everybody's again");
}

// hazard: H8
#[test]
fn a_device_that_gives_no_force_is_not_engaged_whatever_is_allowed() {
    let _alone = crate::alone();
    let rig = FakeRig::start(&["--force-limit-n", "0"]);
    let (daemon, mut client) = daemon(&rig, &["--uncommissioned", "--allow-no-watchdog"]);
    let error = refused(&mut client, Request::Engage {});
    assert_eq!((error.code, error.value), (ErrorCode::NoForce, Some(0.0)), "{error}");
    for part in ["force_limit = 0 N", "force_limit_mn"] {
        assert!(error.message.contains(part), "{error} lacks {part}");
    }
    let shown = daemon.ctl_ok(&["status"]);
    assert!(shown.contains("will not engage  force_limit = 0 N"), "{shown}");
    assert_eq!(status(&mut client).state, RigState::Idle);
}

// hazard: H9
#[test]
fn a_device_without_a_watchdog_or_with_a_long_one_engages_only_where_that_is_allowed() {
    let _alone = crate::alone();
    for (watchdog_ms, told) in [("0", "watchdog_ms = 0 ms"), ("1000", "watchdog_ms = 1000 ms")] {
        let rig = FakeRig::start(&["--watchdog-ms", watchdog_ms]);
        let (_strict, mut client) = daemon(&rig, &[]);
        let error = refused(&mut client, Request::Engage {});
        assert_eq!((error.code, error.max), (ErrorCode::NoWatchdog, Some(200.0)), "{error}");
        for part in [told, "from 1 to 200 ms", "--allow-no-watchdog"] {
            assert!(error.message.contains(part), "{error} lacks {part}");
        }
        drop((_strict, client));
        let (_lenient, mut client) = daemon(&rig, &["--allow-no-watchdog"]);
        engage(&mut client);
    }
    let rig = FakeRig::start(&["--watchdog-ms", "200"]);
    let (_daemon, mut client) = daemon(&rig, &[]);
    engage(&mut client);
}

fn on_a_terminal(daemon: &Daemon, arguments: &[&str]) -> Terminal {
    let mut command = Command::new(binary("haptic-ctl"));
    command
        .args(["commission", "--socket"])
        .arg(daemon.socket())
        .args(arguments);
    Terminal::start(command)
}

#[test]
fn on_a_terminal_it_asks_before_each_step_and_nothing_is_kept_without_a_yes() {
    let _alone = crate::alone();
    let rig = FakeRig::start(&[&OWN[..], &["--stops-mm", "5"]].concat());
    let (daemon, mut client) = daemon(&rig, &[]);
    let output = daemon.ctl(&["commission"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("--yes"), "{said}");

    let mut terminal = on_a_terminal(&daemon, &[]);
    terminal.wait_for("the first question", |shown| shown.contains("1. Direction"));
    assert_eq!(status(&mut client).state, RigState::Idle, "nothing moves before a yes");
    assert!(status(&mut client).commissioning.is_some());
    terminal.type_in("\n");
    assert_eq!(terminal.end().code(), Some(130), "no is what is meant without a word");
    assert!(terminal.written().contains("Nothing is kept"), "{}", terminal.written());
    wait_for(&mut client, "the end of it", |status| status.commissioning.is_none());

    let began = Instant::now();
    loop {
        let mut terminal = on_a_terminal(&daemon, &["--range", "by-hand"]);
        let mut ended = false;
        for question in [
            "1. Direction",
            "2. Friction",
            "3. Range: the motor is off",
            "Keep this?",
        ] {
            let shown = terminal.wait_for(question, |shown| {
                shown.contains(question) || shown.contains("has ended")
            });
            ended = !shown.contains(question);
            if ended {
                break;
            }
            terminal.type_in("y\n");
        }
        let written = terminal.written();
        let code = terminal.end().code();
        if !ended && code == Some(0) {
            let written = terminal.written();
            for part in ["is commissioned", "friction", "range", "encoder step", "kept in"] {
                assert!(written.contains(part), "{written} lacks {part}");
            }
            break;
        }
        assert!(began.elapsed() < 4 * PATIENCE, "{written}");
        println!("once more, the machine is busy: {written}");
        let_go(&mut client);
    }
    engage(&mut client);
}
