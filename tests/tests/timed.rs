//! What must hold with a hand on the handle, once through the whole system and on time: a rig behind a pseudo-terminal
//! that misbehaves on demand. Each of these is proved without a clock in the tests of the servo and of the tick.

use haptic_ipc::{Client, RigState};
use std::time::{Duration, Instant};
use system_tests::fake_rig::{FakeRig, connected, pull};
use system_tests::{Daemon, status, timed, wait_for, wait_for_state};

/// A rig, and a daemon that pulls on it.
fn pulling() -> (FakeRig, Daemon, Client) {
    let (mut rig, daemon, mut client) = connected(&[], &["--stale-ms", "100"]);
    pull(&mut rig, &mut client);
    (rig, daemon, client)
}

// hazard: H6
#[test]
fn a_lone_wrong_sample_is_not_felt() {
    let _alone = crate::alone();
    timed("a lone wrong sample behind a line", || {
        let (mut rig, _daemon, mut client) = pulling();
        let from = status(&mut client);
        rig.force();
        let before = wait_for(&mut client, "an honest second", |status| {
            status.tick > from.tick + 1000 || status.state != RigState::Engaged
        });
        assert_eq!(before.state, RigState::Engaged, "{:?}", before.fault);
        let honest_n = rig.force().largest_n;
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
fn plugged_in_again_a_rig_is_idle_within_two_seconds() {
    let _alone = crate::alone();
    timed("how soon a rig is idle that was plugged in", || {
        let (mut rig, _daemon, mut client) = pulling();
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
