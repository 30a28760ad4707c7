//! What must hold with a hand on the handle, whatever lies, hangs or is cut: the real daemon on a
//! real pseudo-terminal, and a rig that misbehaves on demand.

use haptic_ipc::{Client, ClientError, ErrorCode, LinkStatus, Request, RigState, StateReply, Timing};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use system_tests::blocked::Blocked;
use system_tests::fake_rig::FakeRig;
#[cfg(target_arch = "x86_64")]
use system_tests::hung::{Hang, HungThread};
use system_tests::{
    Daemon, HeldThread, PATIENCE, binary, engage, pause, pull_until, status, timed, wait_for, wait_for_state,
};

/// A rig with more arguments, and a daemon with more arguments that has connected to it.
fn connected(rig: &[&str], daemon: &[&str]) -> (FakeRig, Daemon, Client) {
    let rig = FakeRig::start(rig);
    let daemon = Daemon::start_on(&rig.address(), &[&["--ramp-ms", "20"], daemon].concat());
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    (rig, daemon, client)
}

/// Waits until the motor pulls.
fn pull(rig: &mut FakeRig, client: &mut Client) {
    pull_until(client, |_| rig.force().now_n.abs() > 2.0);
}

fn refused(client: &mut Client, request: Request) -> haptic_ipc::WireError {
    match client.request::<StateReply>(request) {
        Err(ClientError::Refused(error)) => error,
        other => panic!("{other:?}"),
    }
}

/// Has the control thread of an engaged daemon hang in some way, and sees the rig let go of.
fn hang_it<T>(what: &str, stdout: Option<&Blocked>, hang: impl Fn(u32) -> T) {
    timed(what, || hang_it_now(what, stdout, &hang));
}

fn hang_it_now<T>(what: &str, stdout: Option<&Blocked>, hang: &impl Fn(u32) -> T) {
    // A busy machine keeps the commands back for a while as well.
    let mut rig = FakeRig::start(&["--watchdog-ms", "5000"]);
    let directory = tempfile::tempdir().expect("a directory");
    let mut command = Command::new(binary("hapticd"));
    // Its own ramp is far too long for this.
    command.args(["--device", &rig.address()]);
    command.args(["--uncommissioned", "--allow-no-watchdog", "--stale-ms", "1000"]);
    command.args(["--ramp-ms", "1000", "--control-timeout-ms", "2000"]);
    let stdout = stdout.map_or_else(Stdio::null, Blocked::stdio);
    let daemon = Daemon::spawn_writing_to(command, &directory.path().join("control.sock"), stdout);
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    pull(&mut rig, &mut client);
    let hung = hang(daemon.pid());
    let began = Instant::now();
    // The motor is off when the firmware says so: force alone passes through zero by itself.
    let mut zero_since = None;
    while zero_since.is_none_or(|since: Instant| since.elapsed() < Duration::from_millis(100)) {
        assert!(began.elapsed() < PATIENCE, "{what}: the force stays");
        if rig.force().now_n == 0.0 {
            zero_since.get_or_insert_with(Instant::now);
        } else {
            zero_since = None;
        }
    }
    let took = zero_since.expect("it is zero").duration_since(began);
    drop(hung);
    let after = wait_for(&mut client, "an answer", |_| true);
    println!(
        "{what}: zero force {took:?} after the control thread hung, then {:?}",
        after.fault
    );
    assert_eq!(after.state, RigState::Faulted, "{what}");
    let fault = after.fault.unwrap_or_default();
    assert!(fault.starts_with("control_lost"), "{what}: {fault}");
    assert_eq!(refused(&mut client, Request::engage()).code, ErrorCode::Faulted);
    let reset: StateReply = client.request(Request::Reset {}).expect("a reset");
    assert_eq!(reset.state, RigState::Idle);
}

// hazard: H2
#[test]
fn control_thread_held_by_debugger_ends_in_released_rig() {
    let _one = crate::one_of_two();
    hang_it("stopped by a debugger", None, HeldThread::control);
}

// hazard: H2
#[cfg(target_arch = "x86_64")]
#[test]
fn spinning_control_thread_ends_in_released_rig() {
    let _one = crate::one_of_two();
    hang_it("a busy loop", None, |daemon| {
        HungThread::control(daemon, Hang::Spinning)
    });
}

// hazard: H1, H2
#[cfg(target_arch = "x86_64")]
#[test]
fn control_thread_stuck_in_write_ends_in_released_rig() {
    let _one = crate::one_of_two();
    let full = Blocked::pipe();
    hang_it("a write to a full pipe", Some(&full), |daemon| {
        HungThread::control(daemon, Hang::Writing(1))
    });
}

// hazard: H9
#[test]
fn a_device_that_stays_enabled_after_a_stop_is_an_alarm() {
    let _one = crate::one_of_two();
    let (mut rig, daemon, mut client) = connected(&[], &[]);
    pull(&mut rig, &mut client);
    rig.fail("stay-enabled");
    assert_eq!(refused(&mut client, Request::Stop {}).code, ErrorCode::NotConfirmed);
    let alarmed = wait_for_state(&mut client, RigState::Faulted);
    let fault = alarmed.fault.unwrap_or_default();
    assert!(
        fault.starts_with("still_enabled") && fault.contains("cut its power"),
        "{fault}"
    );
    let told = daemon.ctl_ok(&["log"]);
    assert!(told.contains("still_enabled"), "{told}");
    // A reset does not make it well.
    let _: StateReply = client.request(Request::Reset {}).expect("a reset");
    wait_for_state(&mut client, RigState::Faulted);
    rig.fail("honest");
    let _: StateReply = client.request(Request::Reset {}).expect("a reset");
    let idle = wait_for_state(&mut client, RigState::Idle);
    let later = wait_for(&mut client, "ticks", |status| status.tick > idle.tick + 300);
    assert_eq!(later.state, RigState::Idle, "{later:?}");
}

// hazard: H12
#[test]
fn a_stop_is_confirmed_by_the_device_and_timed() {
    let _one = crate::one_of_two();
    let (mut rig, _daemon, mut client) = connected(&[], &[]);
    pull(&mut rig, &mut client);
    let stopped: StateReply = client.request(Request::Stop {}).expect("confirmed");
    assert_eq!(
        (stopped.state, rig.force().now_n),
        (RigState::Stopped, 0.0),
        "it is off when that is said"
    );
    // A device that hears nothing any more cannot confirm.
    let _: StateReply = client.request(Request::Reset {}).expect("a reset");
    pull(&mut rig, &mut client);
    rig.fail("no-echo");
    let asked = Instant::now();
    assert_eq!(refused(&mut client, Request::Stop {}).code, ErrorCode::NotConfirmed);
    println!("said not to be confirmed after {:?}", asked.elapsed());
    let timing: Timing = client.request(Request::Timing {}).expect("the timing");
    let stops = timing.stops;
    assert_eq!(
        (stops.confirmed, stops.unconfirmed, stops.without_device),
        (1, 1, 0),
        "{stops:?}"
    );
    assert!(
        stops.to_written_ns.max > 0 && stops.to_confirmed_ns.max > 0,
        "{stops:?}"
    );
}

// hazard: H19
#[test]
fn the_rigs_own_buttons_stop_it() {
    let _one = crate::one_of_two();
    let (mut rig, daemon, mut client) = connected(&["--buttons", "2"], &["--stop-button", "1", "--enable-button", "2"]);
    let error = refused(&mut client, Request::engage());
    assert_eq!(error.code, ErrorCode::WrongState, "nobody holds the switch");
    assert!(error.message.contains("enable button is not held down"), "{error}");
    let held = |client: &mut Client| {
        let is_held = |link: &LinkStatus| link.buttons & 0b10 != 0;
        wait_for(client, "the switch", |status| {
            status.device.link.as_ref().is_some_and(is_held)
        });
    };
    rig.fail("button 2 on");
    held(&mut client);
    pull(&mut rig, &mut client);
    rig.fail("button 2 off");
    wait_for_state(&mut client, RigState::Idle);
    wait_for(&mut client, "no force", |_| rig.force().now_n == 0.0);
    rig.fail("button 2 on");
    held(&mut client);
    pull(&mut rig, &mut client);
    rig.fail("button 1 on");
    let stopped = wait_for_state(&mut client, RigState::Stopped);
    assert!(
        stopped
            .fault
            .as_deref()
            .is_some_and(|why| why.starts_with("stop_button")),
        "{stopped:?}"
    );
    wait_for(&mut client, "no force", |_| rig.force().now_n == 0.0);
    rig.fail("button 1 off");
    let told = daemon.ctl_ok(&["log"]);
    assert!(told.contains("stop_button"), "{told}");
    assert!(told.contains("the rig's enable button was released"), "{told}");
    let _: StateReply = client.request(Request::Reset {}).expect("a reset");
    pull(&mut rig, &mut client);
}

// hazard: H19
#[test]
fn a_rig_without_the_button_that_is_to_stop_it_is_not_engaged() {
    let _one = crate::one_of_two();
    let (_rig, _daemon, mut client) = connected(&["--buttons", "1"], &["--stop-button", "5"]);
    let error = refused(&mut client, Request::engage());
    assert_eq!((error.code, error.value), (ErrorCode::NoButton, Some(5.0)), "{error}");
}

// hazard: H8
#[test]
fn the_devices_own_force_limit_is_the_limit_and_is_said() {
    let _one = crate::one_of_two();
    let (mut rig, _daemon, mut client) = connected(&["--force-limit-n", "1"], &[]);
    pull_until(&mut client, |_| rig.force().now_n.abs() > 0.9);
    let device = status(&mut client).device;
    assert_eq!(
        (device.force_limit_n, device.force_limit_by),
        (1.0, haptic_ipc::ForceLimitBy::Device)
    );
    let seen = wait_for(&mut client, "a force at its limit", |status| {
        status.command_force_n.abs() > 0.99
    });
    assert!(
        seen.command_force_n.abs() <= 1.0,
        "what status says is what the rig gives: {seen:?}"
    );
    assert!(rig.force().largest_n <= 1.0);
}

// hazard: H7
#[test]
fn daemon_suspended_under_force_resumes_without_force() {
    let _one = crate::one_of_two();
    let daemon = Daemon::start(&["--ramp-ms", "20", "--stale-ms", "100"]);
    let mut client = daemon.client();
    engage(&mut client);
    let pid = rustix::process::Pid::from_raw(i32::try_from(daemon.pid()).expect("a process")).expect("a process");
    rustix::process::kill_process(pid, rustix::process::Signal::STOP).expect("it runs");
    // That it stands still for longer than a sample may be old needs that time to go by.
    let began = Instant::now();
    while began.elapsed() < Duration::from_millis(300) {
        pause();
    }
    rustix::process::kill_process(pid, rustix::process::Signal::CONT).expect("it is there");
    let after = wait_for(&mut client, "an answer", |_| true);
    assert_eq!((after.state, after.command_force_n), (RigState::Faulted, 0.0));
    assert!(
        after.fault.as_deref().is_some_and(|fault| fault.starts_with("stalled")),
        "{after:?}"
    );
}

// hazard: H17
#[test]
fn signals_do_not_reach_the_real_time_thread() {
    let _one = crate::one_of_two();
    let daemon = Daemon::start(&[]);
    let thread = system_tests::real_time_thread(daemon.pid());
    let status = std::fs::read_to_string(format!("/proc/{}/task/{thread}/status", daemon.pid())).expect("it runs");
    let blocked = status
        .lines()
        .find_map(|line| line.strip_prefix("SigBlk:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .expect("a mask");
    for (name, signal) in [
        ("INT", 2),
        ("USR1", 10),
        ("ALRM", 14),
        ("TERM", 15),
        ("CHLD", 17),
        ("PROF", 27),
    ] {
        assert!(blocked & (1 << (signal - 1)) != 0, "{name} reaches it");
    }
    for (name, signal) in [("SEGV", 11), ("BUS", 7), ("FPE", 8), ("ILL", 4)] {
        assert!(blocked & (1 << (signal - 1)) == 0, "{name} must reach it");
    }
}
