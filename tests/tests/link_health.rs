//! What is reported of a link: how well it works, what went wrong on it, and what the adviser makes of that.

use haptic_ipc::{Client, ErrorCode, LinkStatus, Request, RigState, Status};
use system_tests::fake_rig::connected;
use system_tests::{refused, wait_for, wait_for_state};

const STALE: [&str; 2] = ["--stale-ms", "200"];

fn link(status: &Status) -> &LinkStatus {
    status.device.link.as_ref().expect("it is behind a link")
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
