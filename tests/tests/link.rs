//! A rig behind a serial line: the real daemon, a real pseudo-terminal, the fake rig at its other
//! end, and all that can go wrong between them.

use haptic_ipc::{ChangeReply, Client, ErrorCode, LinkStatus, Request, RigState, StateReply, Status};
use rustix::process::Signal;
use std::time::Instant;
use system_tests::fake_rig::{FakeRig, connected, pull};
use system_tests::process::{descriptors, size_kib};
use system_tests::{journal, refused, status, stderr, timed, try_to_engage, until, wait_for};

fn link(status: &Status) -> &LinkStatus {
    status.device.link.as_ref().expect("it is behind a link")
}

/// How often it has been connected.
fn connections(status: &Status) -> u64 {
    link(status).counts.connections
}

#[test]
fn fake_rig_that_a_signal_ends_removes_its_link() {
    for signal in [Signal::HUP, Signal::INT, Signal::TERM] {
        let rig = FakeRig::start(&[]);
        let link = rig.link().to_owned();
        assert!(link.exists());
        assert!(rig.end(signal).success(), "{signal:?}");
        assert!(link.symlink_metadata().is_err(), "{signal:?}");
    }
}

/// Stops a rig that has no device; the answer says both, and what comes after is not held up.
fn stop_without_device(client: &mut Client) {
    let error = refused(client, Request::Stop {});
    assert_eq!(error.code, ErrorCode::NoDevice, "{error}");
    for part in ["the rig is stopped", "no device is connected", "cut its power"] {
        assert!(error.message.contains(part), "{error}");
    }
    assert_eq!(status(client).state, RigState::Stopped);
    let changed: ChangeReply = client
        .request(Request::set([("mass", 1.5)].into_iter().collect()))
        .expect("a scene may change");
    // The loss of the device may be reported later than it was found.
    let entries = journal(client);
    let by_clients: Vec<_> = entries.iter().filter(|entry| entry.by.is_some()).collect();
    let [.., stop, set] = by_clients[..] else {
        panic!("{entries:?}");
    };
    assert_eq!((stop.op.as_str(), set.op.as_str()), ("stop", "set"), "{entries:?}");
    assert_eq!(stop.state.map(|change| change.after), Some(RigState::Stopped));
    assert!(stop.tick.is_some() && stop.tick < changed.tick, "{entries:?}");
    let message = stop.message.as_deref().unwrap_or_default();
    assert!(message.contains("no device"), "{stop:?}");
}

#[test]
fn rig_stopped_while_unplugged_returns_stopped() {
    timed("a rig that is stopped while it is unplugged", || {
        let _one = crate::one_of_two();
        let (mut rig, _daemon, mut client) = connected(&[], &[]);
        pull(&mut rig, &mut client);
        rig.fail("hang-up 3600");
        stop_without_device(&mut client);
        rig.fail("hang-up 0");
        let back = wait_for(&mut client, "samples", |status| {
            link(status).counts.connections == 2 && link(status).counts.samples > 500
        });
        assert_eq!((back.state, back.command_force_n), (RigState::Stopped, 0.0));
        rig.force();
        assert_eq!(rig.force().largest_n, 0.0);
        let stopped: StateReply = client.request(Request::Stop {}).expect("there is somebody to hear it");
        assert_eq!(stopped.state, RigState::Stopped);
        let reset: StateReply = client.request(Request::Reset {}).expect("a reset");
        assert_eq!(reset.state, RigState::Idle);
    });
}

/// Asks to engage, with a reset where it faulted meanwhile, until this comes of it.
fn engage_until(client: &mut Client, wanted: Option<ErrorCode>) {
    until(&format!("waited in vain for {wanted:?}"), || {
        match status(client).state {
            RigState::Faulted => {
                drop(client.request::<StateReply>(Request::Reset {}));
                false
            }
            RigState::Idle => match client.request::<StateReply>(Request::engage()) {
                Ok(_) => wanted.is_none(),
                Err(haptic_ipc::ClientError::Refused(error)) => wanted == Some(error.code),
                Err(error) => panic!("{error}"),
            },
            _ => false,
        }
    });
}

// hazard: H23
#[test]
fn a_rig_that_takes_too_few_commands_or_none_is_not_engaged() {
    timed("a rig that takes too few commands", || {
        let _one = crate::one_of_two();
        // A command waits behind some twenty of 9 ms each.
        let (mut rig, daemon, mut client) = connected(&["--fault", "carry 2000"], &["--stale-ms", "100"]);
        engage_until(&mut client, Some(ErrorCode::CommandsLate));
        let message = stderr(&daemon.ctl(&["engage"]));
        assert!(
            message.contains("carries less than the loop sends") && message.contains("rate"),
            "{message}"
        );
        rig.fail("carry 1000000");
        engage_until(&mut client, None);
        wait_for(&mut client, "an end of it", |status| status.state != RigState::Engaging);
        let _: StateReply = client.request(Request::Stop {}).expect("a stop");
        let _: StateReply = client.request(Request::Reset {}).expect("confirmed");
        rig.fail("no-echo");
        engage_until(&mut client, Some(ErrorCode::CommandsIgnored));
    });
}

const UNPLUGS: u32 = 1000;

#[test]
fn repeated_unplugging_leaks_nothing_and_never_pulls() {
    timed("a rig that is unplugged a thousand times", || {
        let _one = crate::one_of_two();
        let (mut rig, daemon, mut client) = connected(&["--sample-rate-hz", "1000"], &[]);
        let began = Instant::now();
        let held = || {
            let resident_kib = size_kib(daemon.pid(), "VmRSS").expect("it runs");
            (descriptors(daemon.pid()), resident_kib)
        };
        // Held up, the machine may let the rig fault before it engages: one more state to be unplugged in.
        let mut engaged = 0;
        let mut tries_to_engage =
            |client: &mut Client| engaged += u32::from(try_to_engage(client).state == RigState::Engaged);
        let mut first = None;
        let mut random = 12345_u32;
        for cycle in 0..UNPLUGS {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            // In every state that it can be in, and at any moment in it.
            match random >> 30 {
                0 => {}
                1 => {
                    drop(client.request::<StateReply>(Request::engage().anyway()));
                }
                2 => tries_to_engage(&mut client),
                _ => {
                    tries_to_engage(&mut client);
                    drop(client.request::<StateReply>(Request::Release {}));
                }
            }
            let until = status(&mut client).tick + u64::from(random >> 16) % 8;
            let before = connections(&wait_for(&mut client, "a moment", |status| status.tick >= until));
            rig.fail("hang-up 0");
            let back = wait_for(&mut client, "the next connection", |status| {
                connections(status) > before && matches!(status.state, RigState::Idle | RigState::Faulted)
            });
            if back.state == RigState::Faulted {
                // It had faulted before it was unplugged.
                let _: StateReply = client.request(Request::Reset {}).expect("a reset");
            }
            assert_eq!(back.command_force_n, 0.0);
            // What the motor has done since it was plugged in again: the fake rig answers in order.
            rig.force();
            assert_eq!(rig.force().largest_n, 0.0, "in cycle {cycle}");
            // By then it has touched what it will ever touch: its rings, its histograms of ten seconds.
            if cycle == UNPLUGS * 2 / 5 {
                first = Some(held());
            }
        }
        assert!(engaged > UNPLUGS / 4, "{engaged} of {UNPLUGS}");
        let (descriptors_before, resident_before) = first.expect("at least one cycle");
        let (descriptors_after, resident_after) = held();
        println!(
            "{UNPLUGS} cycles in {:?}: descriptors {descriptors_before} -> {descriptors_after}, resident {resident_before} -> {resident_after} KiB",
            began.elapsed()
        );
        assert_eq!(descriptors_after, descriptors_before);
        // 600 cycles that each lost a connection would lose megabytes; the journal, which fills up
        // meanwhile, takes a few hundred KiB.
        assert!(
            resident_after < resident_before + 1024,
            "{resident_before} -> {resident_after} KiB"
        );
    });
}

#[test]
fn devices_are_listed_and_asked_who_they_are() {
    let _one = crate::one_of_two();
    let (rig, daemon, _client) = connected(&[], &[]);
    daemon.ctl_ok(&["devices"]);
    // The daemon's own is asked nothing that would disturb it.
    daemon.ctl_refused(&["devices", "--probe", &rig.address()], 1, "in use by this daemon");
    // Another rig answers, one of another version is named, and a missing one is distinguished
    // from both.
    let other = FakeRig::start(&["--force-limit-n", "7"]);
    let answer = daemon.ctl_ok(&["devices", "--probe", &other.address()]);
    assert!(answer.contains("fake-rig") && answer.contains("up to 7 N"), "{answer}");
    let strange = FakeRig::start(&["--fault", "version 9"]);
    for (address, why) in [
        (strange.address(), "version 9"),
        ("serial:/nowhere/rig".to_owned(), "is not there"),
        ("fake".to_owned(), "it is simulated inside the daemon"),
    ] {
        // A script may go by the exit code.
        daemon.ctl_refused(&["devices", "--probe", &address], 1, why);
        daemon.ctl_refused(&["--json", "devices", "--probe", &address], 1, "no_device");
    }
    daemon.ctl_refused(&["devices", "--probe", "usb:1"], 1, "");
}
