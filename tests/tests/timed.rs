//! What must hold with a hand on the handle, once through the whole system and on time: a rig behind a pseudo-terminal
//! that misbehaves on demand. Each of these is proved without a clock in the tests of the servo and of the tick.

use haptic_ipc::{Client, RigState, Status};
use std::time::{Duration, Instant};
use system_tests::fake_rig::FakeRig;
use system_tests::{Daemon, pull_until, status, timed, wait_for, wait_for_state};

/// A rig, and a daemon that pulls on it and takes samples of such an age at most.
fn pulling(stale_ms: &str) -> (FakeRig, Daemon, Client) {
    let mut rig = FakeRig::start(&[]);
    let daemon = Daemon::start_on(&rig.address(), &["--ramp-ms", "20", "--stale-ms", stale_ms]);
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    pull_until(&mut client, |_| rig.force().now_n.abs() > 2.0);
    (rig, daemon, client)
}

/// The largest force of a second in which nothing is wrong, N, and the rig after it.
fn honest_second(rig: &mut FakeRig, client: &mut Client) -> (f64, Status) {
    let from = status(client);
    rig.force();
    let after = wait_for(client, "an honest second", |status| {
        status.tick > from.tick + 1000 || status.state != RigState::Engaged
    });
    assert_eq!(after.state, RigState::Engaged, "{:?}", after.fault);
    (rig.force().largest_n, after)
}

// hazard: H3
#[test]
fn no_lying_clock_of_a_device_is_rendered() {
    let _alone = crate::alone();
    timed("a lying clock behind a line", || {
        let (mut rig, _daemon, mut client) = pulling("40");
        let (honest_n, _) = honest_second(&mut rig, &mut client);
        rig.fail("clock-half");
        let after = wait_for(&mut client, "a fault", |status| status.state != RigState::Engaged);
        let lying_n = rig.force().largest_n;
        let fault = after.fault.unwrap_or_default();
        println!("{honest_n:.2} N honest, {lying_n:.2} N lying, then: {fault}");
        assert!(fault.starts_with("device_clock"), "{fault}");
        assert!(lying_n <= 1.5 * honest_n, "{lying_n} N, {honest_n} N honest");
    });
}

// hazard: H6
#[test]
fn a_lone_wrong_sample_is_not_felt() {
    let _alone = crate::alone();
    timed("a lone wrong sample behind a line", || {
        let (mut rig, _daemon, mut client) = pulling("100");
        let (honest_n, before) = honest_second(&mut rig, &mut client);
        rig.fail("position-spike 1");
        let after = wait_for(&mut client, "200 ticks", |status| status.tick > before.tick + 200);
        let wrong_n = rig.force().largest_n;
        println!("{honest_n:.2} N without, {wrong_n:.2} N with");
        assert_eq!(after.state, RigState::Engaged, "{:?}", after.fault);
        assert_eq!(after.device.samples_forgotten - before.device.samples_forgotten, 1);
        assert!(wrong_n < 1.3 * honest_n, "{wrong_n} N, {honest_n} N without");
    });
}

#[test]
fn an_encoder_that_jumps_faults_without_a_jump_of_force() {
    let _alone = crate::alone();
    timed("an encoder that jumps behind a line", || {
        let (mut rig, _daemon, mut client) = pulling("100");
        rig.force();
        // 30 m: no hand goes so far, not even between two samples that are nearly too far apart.
        rig.fail("jump 3000000");
        let faulted = wait_for(&mut client, "a fault", |status| status.state != RigState::Engaged);
        let fault = faulted.fault.unwrap_or_default();
        assert!(fault.contains("jumped"), "{fault}");
        // Any part of it on 25000 N/m would be all the force that there is, 20 N.
        let mut largest_n = 0.0_f64;
        wait_for(&mut client, "no force", |_| {
            let force = rig.force();
            largest_n = largest_n.max(force.largest_n);
            force.now_n == 0.0
        });
        assert!(largest_n < 10.0, "{largest_n} N");
    });
}

#[test]
fn plugged_in_again_a_rig_is_idle_within_two_seconds() {
    let _alone = crate::alone();
    timed("how soon a rig is idle that was plugged in", || {
        let (mut rig, _daemon, mut client) = pulling("100");
        rig.fail("hang-up 0.3");
        wait_for_state(&mut client, RigState::Disconnected);
        wait_for(&mut client, "the terminal", |_| rig.link().exists());
        let plugged_in = Instant::now();
        wait_for_state(&mut client, RigState::Idle);
        let took = plugged_in.elapsed();
        println!("idle {took:?} after it was plugged in");
        assert!(took < Duration::from_secs(2), "{took:?}");
    });
}
