//! What must hold with a hand on the handle, whatever lies, hangs or is cut: the real daemon on a
//! real pseudo-terminal, and a rig that misbehaves on demand.

use haptic_ipc::{Client, ErrorCode, LinkStatus, Request, RigState, StateReply, Timing};
use rustix::process::Signal;
use std::time::{Duration, Instant};
use system_tests::fake_rig::{FakeRig, connected, pull};
use system_tests::{
    Daemon, HeldThread, PATIENCE, engage, pause, process, refused, status, timed, wait_for, wait_for_state,
};

/// Has the control thread of an engaged daemon hang, and sees the rig let go of.
fn hang_it() {
    // A busy machine keeps the commands back for a while as well.
    let mut rig = FakeRig::start(&["--watchdog-ms", "5000"]);
    // Its own ramp is far too long for this.
    let options = [
        "--allow-no-watchdog",
        "--ramp-ms",
        "1000",
        "--control-timeout-ms",
        "2000",
    ];
    let daemon = Daemon::start_on(&rig.address(), &options);
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    pull(&mut rig, &mut client);
    let hung = HeldThread::control(daemon.pid());
    let began = Instant::now();
    // The motor is off when the firmware says so: force alone passes through zero by itself.
    let mut zero_since = None;
    while zero_since.is_none_or(|since: Instant| since.elapsed() < Duration::from_millis(100)) {
        assert!(began.elapsed() < PATIENCE, "the force stays");
        if rig.force().now_n == 0.0 {
            zero_since.get_or_insert_with(Instant::now);
        } else {
            zero_since = None;
        }
    }
    drop(hung);
    let after = wait_for(&mut client, "an answer", |_| true);
    assert_eq!(after.state, RigState::Faulted);
    let fault = after.fault.unwrap_or_default();
    assert!(fault.starts_with("control_lost"), "{fault}");
    let error = refused(&mut client, Request::engage());
    assert_eq!(error.code, ErrorCode::Faulted);
    assert!(error.message.contains(&fault), "{error}");
    let reset: StateReply = client.request(Request::Reset {}).expect("a reset");
    assert_eq!(reset.state, RigState::Idle);
}

// hazard: H1, H2
#[test]
fn hanging_control_thread_ends_in_released_rig() {
    let _one = crate::one_of_two();
    timed("a control thread that hangs", hang_it);
}

// hazard: H12
#[test]
fn a_stop_is_confirmed_by_the_device_and_timed() {
    timed("a stop that a device confirms", || {
        let _one = crate::one_of_two();
        let (mut rig, _daemon, mut client) = connected(&[], &[]);
        pull(&mut rig, &mut client);
        let stopped: StateReply = client.request(Request::Stop {}).expect("confirmed");
        assert_eq!(
            (stopped.state, rig.force().now_n),
            (RigState::Stopped, 0.0),
            "it is off when that is reported"
        );
        // A device that receives nothing any more cannot confirm.
        let _: StateReply = client.request(Request::Reset {}).expect("a reset");
        pull(&mut rig, &mut client);
        rig.fail("no-echo");
        let asked = Instant::now();
        assert_eq!(refused(&mut client, Request::Stop {}).code, ErrorCode::NotConfirmed);
        println!("reported as not confirmed after {:?}", asked.elapsed());
        let timing: Timing = client.request(Request::Timing {}).expect("the timing");
        let stops = timing.stops;
        let counts = (stops.confirmed, stops.unconfirmed, stops.without_device);
        assert_eq!(counts, (1, 1, 0), "{stops:?}");
        let times = [stops.to_written_ns.max, stops.to_confirmed_ns.max];
        assert!(times.iter().all(|ns| *ns > 0), "{stops:?}");
    });
}

// hazard: H19
#[test]
fn the_rigs_own_buttons_stop_it() {
    timed("a rig's own buttons", || {
        let _one = crate::one_of_two();
        let (mut rig, daemon, mut client) =
            connected(&["--buttons", "2"], &["--stop-button", "1", "--enable-button", "2"]);
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
        let fault = stopped.fault.unwrap_or_default();
        assert!(fault.starts_with("stop_button"), "{fault}");
        wait_for(&mut client, "no force", |_| rig.force().now_n == 0.0);
        rig.fail("button 1 off");
        let printed = daemon.ctl_ok(&["log"]);
        assert!(printed.contains("stop_button"), "{printed}");
        assert!(printed.contains("the rig's enable button was released"), "{printed}");
        let _: StateReply = client.request(Request::Reset {}).expect("a reset");
        pull(&mut rig, &mut client);
    });
}

#[test]
fn a_devices_own_force_limit_is_named_as_the_devices() {
    let _one = crate::one_of_two();
    let (_rig, _daemon, mut client) = connected(&["--force-limit-n", "1"], &[]);
    let device = status(&mut client).device;
    assert_eq!(
        (device.force_limit_n, device.force_limit_by),
        (1.0, haptic_ipc::ForceLimitBy::Device)
    );
}

// hazard: H7
#[test]
fn daemon_suspended_under_force_resumes_without_force() {
    let daemon = Daemon::start(&["--ramp-ms", "20"]);
    let mut client = daemon.client();
    engage(&mut client);
    process::signal(daemon.pid(), Signal::STOP);
    // That it stands still for longer than a sample may be old needs that time to go by.
    let began = Instant::now();
    while began.elapsed() < Duration::from_millis(1200) {
        pause();
    }
    process::signal(daemon.pid(), Signal::CONT);
    // The thread that answers may run before the loop's first tick.
    let after = wait_for(&mut client, "a tick", |status| status.state != RigState::Engaged);
    assert_eq!((after.state, after.command_force_n), (RigState::Faulted, 0.0));
    let fault = after.fault.unwrap_or_default();
    assert!(fault.starts_with("stalled"), "{fault}");
}

// hazard: H17
#[test]
fn signals_do_not_reach_the_real_time_thread() {
    let daemon = Daemon::start(&[]);
    let thread = system_tests::real_time_thread(daemon.pid());
    let status = std::fs::read_to_string(format!("/proc/{}/task/{thread}/status", daemon.pid())).expect("it runs");
    let blocked = status
        .lines()
        .find_map(|line| line.strip_prefix("SigBlk:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .expect("a mask");
    let is_blocked = |signal: &Signal| blocked & (1 << (signal.as_raw() - 1)) != 0;
    use Signal as S;
    let sent = [S::INT, S::USR1, S::ALARM, S::TERM, S::CHILD, S::PROF];
    assert!(sent.iter().all(is_blocked), "{blocked:x}");
    // Those of its own faults must reach it.
    let own = [S::SEGV, S::BUS, S::FPE, S::ILL];
    assert!(!own.iter().any(is_blocked), "{blocked:x}");
}
