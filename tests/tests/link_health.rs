//! What is reported of a link: how well it works, what went wrong on it, and what the adviser makes of that.

use haptic_ipc::{AdviceReply, Client, ErrorCode, LinkStatus, Request, RigState, Status};
use system_tests::fake_rig::connected;
use system_tests::{PATIENCE, journal, refused, until_some, wait_for, wait_for_state};

const STALE: [&str; 2] = ["--stale-ms", "200"];

fn link(status: &Status) -> &LinkStatus {
    status.device.link.as_ref().expect("it is behind a link")
}

/// The advice once its delay was measured; the machine may be busy for a while.
fn advice_until(client: &mut Client, wanted: impl Fn(&AdviceReply) -> bool) -> AdviceReply {
    until_some("waited in vain for advice", || {
        let reply: AdviceReply = client.request(Request::Advise {}).expect("advice");
        wanted(&reply).then_some(reply)
    })
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
fn advice_accounts_for_rig_rate_and_link_delay() {
    let _one = crate::one_of_two();
    let (mut rig, daemon, mut client) = connected(&["--sample-rate-hz", "60"], &STALE);
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

    // A link that is later by 20 ms in each direction takes away as much as it is late.
    rig.fail("delay 20");
    let late = advice_until(&mut client, |reply| {
        reply.basis.is_some_and(|basis| basis.delay_us > 35_000.0)
    });
    let bound = stiffest(&late);
    println!("{bound:.0} N/m for {:?}", late.basis);
    assert!(bound < 20.0 / 0.085, "{bound} N/m");

    let printed = daemon.ctl_ok(&["advise"]);
    assert!(
        printed.contains("a device at 60 Hz") && printed.contains("ms from a sample to its force"),
        "{printed}"
    );
}

#[test]
fn an_error_of_the_device_is_reported_with_code_and_detail() {
    let _one = crate::one_of_two();
    let (mut rig, daemon, mut client) = connected(&[], &STALE);
    // A message that the device did not understand is no fault, and is shown all the same.
    rig.fail("error 1 170");
    let reported = wait_for(&mut client, "the error", |status| link(status).last_error.is_some());
    let error = link(&reported).last_error.clone().expect("there is one");
    assert!(error.message.contains("code 1, detail 170 = 0xaa"), "{error:?}");
    assert!((0.0..PATIENCE.as_secs_f64()).contains(&error.age_s), "{error:?}");
    assert_ne!(reported.state, RigState::Faulted);

    rig.fail("error 3 4711");
    let reported = wait_for_state(&mut client, RigState::Faulted);
    let words = "device: the device reports: its motor or amplifier fails (code 3, detail 4711 = 0x1267)";
    assert_eq!(reported.fault.as_deref(), Some(words));
    let error = link(&reported).last_error.clone().expect("there is one");
    assert!(error.message.contains("code 3, detail 4711"), "{error:?}");
    let entries = journal(&mut client);
    assert!(
        entries.iter().any(|entry| entry.message.as_deref() == Some(words)),
        "{entries:?}"
    );
    for arguments in [&["status"][..], &["log"]] {
        let printed = daemon.ctl_ok(arguments);
        assert!(printed.contains("detail 4711"), "{arguments:?}: {printed}");
    }
}

// hazard: H3
#[test]
fn a_clock_that_lies_is_reported_while_idle_and_refused() {
    let _one = crate::one_of_two();
    for lie in [
        "clock-half",
        "clock-double",
        "clock-stop",
        "clock-wrap16",
        "clock-backwards",
    ] {
        let (mut rig, _daemon, mut client) = connected(&[], &STALE);
        rig.fail(lie);
        let reported = wait_for(&mut client, "the clock", |status| {
            let refused = &status.device.engage_refused;
            refused
                .iter()
                .any(|problem| problem.what.contains("time cannot be right"))
        });
        assert_eq!(reported.state, RigState::Idle, "{lie}");
        let error = refused(&mut client, Request::engage());
        assert_eq!(error.code, ErrorCode::DeviceClock, "{lie}: {error}");
    }
}

#[test]
fn silent_rig_is_distinguished_from_missing_one() {
    let _one = crate::one_of_two();
    let (mut rig, _daemon, mut client) = connected(&[], &STALE);
    let says = |client: &mut Client, what: &str| {
        wait_for(client, what, |status| {
            link(status).waiting.as_deref().is_some_and(|why| why.contains(what))
        })
    };
    rig.fail("hang-up 3600");
    rig.fail("stall 3600");
    let gone = says(&mut client, "is not there");
    // And why it went is still to be seen.
    let error = link(&gone).last_error.clone().expect("a bus error");
    println!("{:?}, {error:?}", link(&gone).waiting);
    assert!(
        error.message.contains("os error") || error.message.contains("hung up"),
        "{error:?}"
    );
    says(&mut client, &format!("before that, {}", error.message));
    // Its firmware does not come up at once.
    rig.fail("hang-up 0");
    says(&mut client, "is there, but has not answered the hello yet");
    rig.fail("stall 0");
    wait_for_state(&mut client, RigState::Idle);
}
