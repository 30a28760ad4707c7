//! A rig behind a serial line: the real daemon, a real pseudo-terminal, the fake rig at its other
//! end, and all that can go wrong between them.

use haptic_ipc::{
    ChangeReply, Client, ClientError, ErrorCode, LinkStatus, LogReply, Request, RigState, StateReply, Status,
};
use std::fs;
use std::time::Instant;
use system_tests::fake_rig::FakeRig;
use system_tests::process::{descriptors, size_kib};
use system_tests::{Daemon, PATIENCE, pull_until, status, timed, wait_for, wait_for_state};

/// A rig with more arguments, and a daemon that has connected to it.
fn connected(arguments: &[&str]) -> (FakeRig, Daemon, Client) {
    connected_with(arguments, &[])
}

/// The same with more arguments of the daemon.
fn connected_with(of_rig: &[&str], of_daemon: &[&str]) -> (FakeRig, Daemon, Client) {
    let rig = FakeRig::start(of_rig);
    let daemon = daemon(&rig, of_daemon);
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    (rig, daemon, client)
}

fn daemon(rig: &FakeRig, arguments: &[&str]) -> Daemon {
    Daemon::start_on(&rig.address(), &[&["--ramp-ms", "20"], arguments].concat())
}

/// How old a sample may be, where a device stands still for longer.
const STALE: [&str; 2] = ["--stale-ms", "200"];

fn link(status: &Status) -> &LinkStatus {
    status.device.link.as_ref().expect("it is behind a link")
}

/// How often it has been connected.
fn connections(status: &Status) -> u64 {
    link(status).counts.connections
}

/// Waits until the motor pulls.
fn pull(rig: &mut FakeRig, client: &mut Client) {
    pull_until(client, |_| rig.force().now_n.abs() > 2.0);
}

#[test]
fn the_papers_scene_is_rendered_over_the_wire() {
    let _one = crate::one_of_two();
    // However long the machine keeps the fake rig from running.
    let (mut rig, _daemon, mut client) =
        connected_with(&["--watchdog-ms", "0"], &["--allow-no-watchdog", "--stale-ms", "1000"]);
    pull(&mut rig, &mut client);
    let from = status(&mut client);
    let watched = test_run::extent(1500, 5000);
    let to = wait_for(&mut client, "some seconds", |status| {
        status.tick >= from.tick + watched || status.state != RigState::Engaged
    });
    assert_eq!(connections(&to), connections(&from), "{:?}", to.fault);
    let (before, after) = (link(&from).counts, link(&to).counts);
    println!("{to:#?}");
    assert_eq!(to.state, RigState::Engaged);
    assert!(after.samples > before.samples + 100, "{after:?}");
    assert_eq!(
        [
            after.bad_crc - before.bad_crc,
            after.malformed - before.malformed,
            after.out_of_sequence - before.out_of_sequence,
            after.device_errors - before.device_errors,
            after.clipped - before.clipped,
        ],
        [0; 5]
    );
    let device = link(&to).device.as_ref().expect("it is connected");
    assert!(device.firmware.starts_with("fake-rig "), "{device:?}");
    assert_eq!((device.force_limit_n, device.sample_rate_hz), (20.0, 1000.0));
    assert!((device.resolution_m - 1e-5).abs() < 1e-10, "{device:?}");
    // The scene's kinetic friction is 3.5 N and its stiction 4 N. What passes late on a busy
    // machine makes it swing, up to the limit.
    let force = rig.force();
    assert!((3.0..=20.0).contains(&force.largest_n), "{force:?}");
    let _: StateReply = client.request(Request::Stop {}).expect("a stop");
    wait_for(&mut client, "no force", |_| rig.force().now_n == 0.0);
}

#[test]
fn unplugged_it_is_disconnected_and_plugged_in_again_it_is_idle() {
    let _one = crate::one_of_two();
    let (mut rig, _daemon, mut client) = connected(&[]);
    pull(&mut rig, &mut client);
    let before = connections(&status(&mut client));
    rig.fail("hang-up 3600");
    let gone = wait_for(&mut client, "what it waits for", |status| {
        link(status).waiting.is_some()
    });
    assert_eq!((gone.state, gone.command_force_n), (RigState::Disconnected, 0.0));
    rig.fail("hang-up 0");
    let back = wait_for_state(&mut client, RigState::Idle);
    assert!(connections(&back) > before, "{back:?}");
    // The position begins again, and nobody pulls.
    let later = wait_for(&mut client, "ticks", |status| status.tick > back.tick + 300);
    assert_eq!((later.state, later.command_force_n), (RigState::Idle, 0.0));
    rig.force();
    assert_eq!(rig.force().largest_n, 0.0);
}

// hazard: H18
#[test]
fn loss_is_journalled_even_after_reset_of_silent_device() {
    let _one = crate::one_of_two();
    let (mut rig, daemon, mut client) = connected_with(&[], &STALE);
    pull(&mut rig, &mut client);
    // Without samples there is nothing to be idle on; the line stays open meanwhile.
    rig.fail("stall 0.4");
    wait_for_state(&mut client, RigState::Faulted);
    let _: StateReply = client.request(Request::Reset {}).expect("a reset");
    wait_for_state(&mut client, RigState::Disconnected);
    let back = wait_for(&mut daemon.client(), "samples", |status| {
        // It did not say in time that its motor is off.
        if status.state == RigState::Faulted {
            let _: StateReply = client.request(Request::Reset {}).expect("a reset");
        }
        status.state == RigState::Idle
    });
    let before = connections(&back);
    rig.fail("hang-up 0");
    wait_for(&mut client, "the next connection", |status| {
        connections(status) > before && status.state == RigState::Idle
    });
    let request = Request::Log {
        after: None,
        limit: Some(2000),
    };
    let journal: LogReply = client.request(request).expect("the journal");
    let ops = journal.entries.iter().map(|entry| entry.op.as_str());
    let told: Vec<&str> = ops.filter(|op| op.ends_with("connected")).collect();
    assert_eq!(
        told,
        ["connected", "disconnected", "connected", "disconnected", "connected"]
    );
}

/// Stops a rig that has no device; the answer says both, and what comes after is not held up.
fn stop_unheard(client: &mut Client) {
    let refused = client
        .request::<StateReply>(Request::Stop {})
        .expect_err("there is nothing to take the zero force");
    let ClientError::Refused(error) = refused else {
        panic!("{refused}");
    };
    assert_eq!(error.code, ErrorCode::NoDevice, "{error}");
    for part in ["the rig is stopped", "no device is connected", "cut its power"] {
        assert!(error.message.contains(part), "{error}");
    }
    assert_eq!(status(client).state, RigState::Stopped);
    let changed: ChangeReply = client
        .request(Request::set([("mass", 1.5)].into_iter().collect()))
        .expect("a scene may change");
    let log: LogReply = client
        .request(Request::Log {
            after: None,
            limit: None,
        })
        .expect("a log");
    // That the device is gone may be told later than it was found.
    let by_clients: Vec<_> = log.entries.iter().filter(|entry| entry.by.is_some()).collect();
    let [.., stop, set] = by_clients[..] else {
        panic!("{log:?}");
    };
    assert_eq!((stop.op.as_str(), set.op.as_str()), ("stop", "set"), "{log:?}");
    assert_eq!(stop.state.map(|change| change.after), Some(RigState::Stopped));
    assert!(stop.tick.is_some() && stop.tick < changed.tick, "{log:?}");
    let message = stop.message.as_deref().unwrap_or_default();
    assert!(message.contains("no device"), "{stop:?}");
}

#[test]
fn stop_without_device_reports_truth_and_blocks_nothing() {
    let _one = crate::one_of_two();
    let directory = tempfile::tempdir().expect("a directory");
    let daemon = Daemon::start_on(&format!("serial:{}", directory.path().join("rig").display()), &[]);
    stop_unheard(&mut daemon.client());
}

#[test]
fn rig_stopped_while_unplugged_returns_stopped() {
    let _one = crate::one_of_two();
    let (mut rig, _daemon, mut client) = connected(&[]);
    pull(&mut rig, &mut client);
    rig.fail("hang-up 3600");
    stop_unheard(&mut client);
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
}

#[test]
fn a_daemon_that_is_killed_leaves_the_motor_off() {
    let _one = crate::one_of_two();
    let (mut rig, daemon, mut client) = connected(&[]);
    pull(&mut rig, &mut client);
    drop(daemon);
    let killed = Instant::now();
    while rig.force().now_n != 0.0 {
        assert!(killed.elapsed() < PATIENCE, "{:?}", rig.force());
    }
    println!("no force {:?} after the kill", killed.elapsed());
    assert!(rig.force().watchdog, "the firmware's own watchdog has done that");
}

/// Asks to engage, with a reset where it faulted meanwhile, until this comes of it.
fn engage_until(client: &mut Client, what: &str, wanted: impl Fn(Option<ErrorCode>) -> bool) {
    let began = Instant::now();
    loop {
        match status(client).state {
            RigState::Faulted => drop(client.request::<StateReply>(Request::Reset {})),
            RigState::Idle => {
                let refused = match client.request::<StateReply>(Request::engage()) {
                    Ok(_) => None,
                    Err(ClientError::Refused(error)) => Some(error.code),
                    Err(error) => panic!("{error}"),
                };
                if wanted(refused) {
                    return;
                }
            }
            _ => {}
        }
        assert!(
            began.elapsed() < PATIENCE,
            "waited in vain for {what}: {:?}",
            status(client)
        );
    }
}

// hazard: H23
#[test]
fn a_rig_that_takes_too_few_commands_or_none_is_not_engaged() {
    timed("a rig that takes too few commands", || {
        let _one = crate::one_of_two();
        // A command waits behind some twenty of 9 ms each.
        let (mut rig, daemon, mut client) = connected_with(&["--fault", "carry 2000"], &["--stale-ms", "100"]);
        engage_until(&mut client, "a refusal", |refused| {
            refused == Some(ErrorCode::CommandsLate)
        });
        let told = daemon.ctl(&["engage"]);
        let told = String::from_utf8_lossy(&told.stderr).into_owned();
        assert!(
            told.contains("carries less than the loop sends") && told.contains("rate"),
            "{told}"
        );
        rig.fail("carry 1000000");
        engage_until(&mut client, "force", |refused| refused.is_none());
        wait_for(&mut client, "an end of it", |status| status.state != RigState::Engaging);
        let _: StateReply = client.request(Request::Stop {}).expect("heard");
        let _: StateReply = client.request(Request::Reset {}).expect("confirmed");
        rig.fail("no-echo");
        engage_until(&mut client, "a refusal", |refused| {
            refused == Some(ErrorCode::CommandsIgnored)
        });
    });
}

// hazard: H23
#[test]
fn a_rig_that_takes_no_command_any_more_is_let_go_of() {
    timed("a rig that takes no command any more", || {
        let _one = crate::one_of_two();
        let (mut rig, _daemon, mut client) = connected(&[]);
        pull(&mut rig, &mut client);
        rig.fail("no-echo");
        let faulted = wait_for(&mut client, "a fault", |status| status.state != RigState::Engaged);
        let fault = faulted.fault.clone().unwrap_or_default();
        // Where this machine stands still, the device hears no command for as long, and its own watchdog is the first.
        let is_let_go = fault.starts_with("commands_ignored") || fault.contains("watchdog has switched its motor off");
        assert!(is_let_go, "{fault}");
        wait_for(&mut client, "no force", |_| rig.force().now_n == 0.0);
    });
}

#[test]
fn a_daemon_that_ends_lets_the_force_down_itself() {
    let _one = crate::one_of_two();
    let (mut rig, daemon, mut client) = connected(&[]);
    pull(&mut rig, &mut client);
    drop(client);
    let (ended, said) = daemon.end(rustix::process::Signal::TERM);
    assert!(ended.success(), "{said}");
    // The last word may still be on its way.
    let began = Instant::now();
    let force = loop {
        let force = rig.force();
        if force.now_n == 0.0 {
            break force;
        }
        assert!(began.elapsed() < PATIENCE, "{force:?}");
    };
    assert!(!force.watchdog, "{force:?}");
}

#[test]
fn a_device_that_stalls_faults_and_is_well_after_a_reset() {
    timed("a device that stalls behind a line", || {
        let _one = crate::one_of_two();
        let (mut rig, _daemon, mut client) = connected_with(&[], &STALE);
        pull(&mut rig, &mut client);
        // Longer than a sample may be old, and shorter than a device may be silent.
        rig.fail("stall 0.35");
        let faulted = wait_for(&mut client, "a fault", |status| status.state != RigState::Engaged);
        let fault = faulted.fault.clone().unwrap_or_default();
        assert!(fault.contains("no new sample"), "{fault}");
        assert_eq!((faulted.state, faulted.command_force_n), (RigState::Faulted, 0.0));
        wait_for(&mut client, "samples", |status| {
            link(status).counts.samples > link(&faulted).counts.samples + 100
        });
        assert_eq!(rig.force().now_n, 0.0);
        pull(&mut rig, &mut client);
    });
}

#[test]
fn the_devices_clock_may_wrap_around_and_run_away_from_ours() {
    let _one = crate::one_of_two();
    let (mut rig, _daemon, mut client) = connected(&["--clock-ppm", "200"]);
    pull(&mut rig, &mut client);
    rig.fail("wrap 0.2");
    // Whether the setting of its clock has faulted the rig or not: the drift is known after some
    // seconds of samples.
    let known = wait_for(&mut client, "the drift", |status| {
        link(status)
            .clock_drift_ppm
            .is_some_and(|ppm| (150.0..250.0).contains(&ppm))
    });
    // Setting the clock is a jump of it, which counts as time that went by; the wrap itself is
    // none.
    println!("{:?} {:?}", known.state, link(&known));
}

#[test]
fn another_version_is_named() {
    let _one = crate::one_of_two();
    let rig = FakeRig::start(&["--fault", "version 2"]);
    let daemon = daemon(&rig, &[]);
    let mut client = daemon.client();
    let told = wait_for(&mut client, "a reason", |status| {
        link(status)
            .waiting
            .as_deref()
            .is_some_and(|why| why.contains("version 2"))
    });
    assert_eq!(told.state, RigState::Disconnected);
    let refused = client
        .request::<StateReply>(Request::engage())
        .expect_err("nothing is there");
    println!("{refused}");
}

#[test]
fn what_is_not_there_or_is_no_line_is_told() {
    let _one = crate::one_of_two();
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("line");
    let daemon = Daemon::start_on(&format!("serial:{}", path.display()), &[]);
    let mut client = daemon.client();
    let says = |client: &mut Client, what: &str| {
        wait_for(client, what, |status| {
            link(status).waiting.as_deref().is_some_and(|why| why.contains(what))
        });
    };
    says(&mut client, "is not there");
    fs::write(&path, "no line").expect("written");
    says(&mut client, "is it a serial line");
    assert_eq!(status(&mut client).state, RigState::Disconnected);
    fs::remove_file(&path).expect("it is there");
    says(&mut client, "is not there");
}

/// A bad line is ridden out, and whatever happens the force stays what the scene can give.
#[test]
fn a_line_that_loses_doubles_damages_and_delays_is_ridden_out() {
    let _one = crate::one_of_two();
    for faults in [
        &["loss 0.05", "double 0.05", "reorder 0.05"][..],
        &["corrupt 0.2"],
        &["delay 3", "jitter 4"],
    ] {
        let (mut rig, _daemon, mut client) = connected(&[]);
        pull(&mut rig, &mut client);
        rig.force();
        for fault in faults {
            rig.fail(fault);
        }
        let from = status(&mut client);
        let to = wait_for(&mut client, "two seconds", |status| status.tick >= from.tick + 2000);
        println!("{faults:?}: {} {:?} {:?}", to.state, to.fault, link(&to));
        let force = rig.force();
        // A delayed loop may swing on the coupling; it stays within the limit all the same.
        assert!(force.largest_n <= 20.0, "{faults:?}: {force:?}");
        let samples = link(&to).counts.samples - link(&from).counts.samples;
        assert!(samples > 500, "{to:?}");
    }
}

#[test]
fn repeated_unplugging_leaks_nothing_and_never_pulls() {
    let _one = crate::one_of_two();
    let (mut rig, daemon, mut client) = connected(&["--sample-rate-hz", "1000"]);
    let began = Instant::now();
    let unplugs = test_run::extent(40, 1000);
    let held = || {
        let resident_kib = size_kib(daemon.pid(), "VmRSS").expect("it runs");
        (descriptors(daemon.pid()), resident_kib)
    };
    // A machine that is held up may let the rig fault on its way, which is one more state to be unplugged in.
    let mut engaged = 0;
    let mut tries_to_engage = |client: &mut Client| {
        drop(client.request::<StateReply>(Request::engage()));
        let reached = wait_for(client, "an engagement or a fault", |status| {
            matches!(status.state, RigState::Engaged | RigState::Faulted)
        });
        engaged += u32::from(reached.state == RigState::Engaged);
    };
    let mut first = None;
    let mut random = 12345_u32;
    for cycle in 0..unplugs {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // In every state that it can be in, and at any moment in it.
        match random >> 30 {
            0 => {}
            1 => {
                drop(client.request::<StateReply>(Request::engage()));
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
        if cycle == unplugs * 2 / 5 {
            first = Some(held());
        }
    }
    assert!(engaged > unplugs / 4, "{engaged} of {unplugs}");
    let (descriptors_before, resident_before) = first.expect("at least one cycle");
    let (descriptors_after, resident_after) = held();
    println!(
        "{} cycles in {:?}: descriptors {descriptors_before} -> {descriptors_after}, resident {resident_before} -> {resident_after} KiB",
        unplugs,
        began.elapsed()
    );
    assert_eq!(descriptors_after, descriptors_before);
    // A short run says little of memory: the histograms of ten seconds still grow.
    if !test_run::is_long_for("memory after a thousand reconnections") {
        return;
    }
    // 600 cycles that each lost a connection would lose megabytes; the journal, which fills up
    // meanwhile, takes a few hundred KiB.
    assert!(
        resident_after < resident_before + 1024,
        "{resident_before} -> {resident_after} KiB"
    );
}

#[test]
fn devices_are_listed_and_asked_who_they_are() {
    let _one = crate::one_of_two();
    let (rig, daemon, _client) = connected(&[]);
    let listed = daemon.ctl_ok(&["devices"]);
    println!("{listed}");
    // The daemon's own is asked nothing that would disturb it.
    let own = daemon.ctl(&["devices", "--probe", &rig.address()]);
    let told = String::from_utf8_lossy(&own.stderr).into_owned();
    assert!(
        own.status.code() == Some(1) && told.contains("in use by this daemon"),
        "{told}"
    );
    // Another rig answers, one of another version is named, and what is not there is told apart
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
        let asked = daemon.ctl(&["devices", "--probe", &address]);
        // A script may go by the exit code.
        assert_eq!(asked.status.code(), Some(1), "{asked:?}");
        for text in [&asked.stdout, &asked.stderr] {
            assert!(String::from_utf8_lossy(text).contains(why), "{asked:?}");
        }
        let json = daemon.ctl(&["--json", "devices", "--probe", &address]);
        assert_eq!(json.status.code(), Some(1), "{json:?}");
        assert!(String::from_utf8_lossy(&json.stderr).contains("no_device"), "{json:?}");
    }
    let wrong = daemon.ctl(&["devices", "--probe", "usb:1"]);
    assert_eq!(wrong.status.code(), Some(1), "{wrong:?}");
}
