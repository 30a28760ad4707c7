//! What is told of a link: how well it works, what went wrong on it, and what the adviser makes of that.

use haptic_ipc::{AdviceReply, Client, Request, RigState};
use std::time::Instant;
use system_tests::fake_rig::FakeRig;
use system_tests::{Daemon, PATIENCE, wait_for_state};

/// A rig with more arguments, and a daemon that has connected to it.
fn connected(arguments: &[&str], stale_ms: &str) -> (FakeRig, Daemon, Client) {
    let rig = FakeRig::start(arguments);
    let daemon = Daemon::start_on(&rig.address(), &["--stale-ms", stale_ms]);
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    (rig, daemon, client)
}

/// The advice once its delay was measured; the machine may be busy for a while.
fn advice_until(client: &mut Client, wanted: impl Fn(&AdviceReply) -> bool) -> AdviceReply {
    let began = Instant::now();
    loop {
        let reply: AdviceReply = client.request(Request::Advise {}).expect("advice");
        if wanted(&reply) {
            return reply;
        }
        assert!(began.elapsed() < PATIENCE, "waited in vain: {reply:?}");
    }
}

/// The stiffest stable coupling, N/m.
fn stiffest(reply: &AdviceReply) -> f64 {
    let finding = reply
        .advice
        .iter()
        .filter_map(|advice| advice.finding.as_ref())
        .find(|finding| finding.check == "linear_stability");
    finding.and_then(|finding| finding.bound).expect("it is checked")
}

// hazard: H10
#[test]
fn advice_reckons_with_the_rate_of_the_rig_and_the_delay_of_the_link() {
    let (mut rig, daemon, mut client) = connected(&["--sample-rate-hz", "60"], "200");
    let measured = advice_until(&mut client, |reply| {
        reply.basis.is_some_and(|basis| basis.delay_measured)
    });
    let basis = measured.basis.expect("it says what it reckons with");
    let sample_us = basis.sample_period_us.expect("the device's own rate");
    assert!((sample_us - 16_666.7).abs() < 1.0, "{basis:?}");
    // The paper's coupling damps with 10 N s/m: 2 B / (T + 2 tau), at a period of the device's at least.
    let bound = stiffest(&measured);
    println!("{bound:.0} N/m for {basis:?}");
    assert!(bound <= 20.0 * 60.0, "{bound} N/m for a rig at 60 Hz");
    let expected = 20.0 / ((sample_us + 2.0 * basis.delay_us) * 1e-6);
    assert!((bound / expected - 1.0).abs() < 1e-9, "{bound} for {basis:?}");

    // A link that is later by 20 ms each way takes away as much as it is late.
    rig.fail("delay 20");
    let late = advice_until(&mut client, |reply| {
        reply.basis.is_some_and(|basis| basis.delay_us > 35_000.0)
    });
    let bound = stiffest(&late);
    println!("{bound:.0} N/m for {:?}", late.basis);
    assert!(bound < 20.0 / 0.085, "{bound} N/m");

    let said = daemon.ctl_ok(&["advise"]);
    assert!(
        said.contains("a device at 60 Hz") && said.contains("ms from a sample to its force"),
        "{said}"
    );
}
