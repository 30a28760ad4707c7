//! A hand without a rig: a client points, the arm of the fake rig's hand pulls the handle there, and lets go without
//! news.

use haptic_ipc::{Client, ErrorCode, Event, HandReply, Request, Topic};
use std::process::{Command, Stdio};
use system_tests::fake_rig::FakeRig;
use system_tests::process::Killed;
use system_tests::{Daemon, be_patient, binary, engage, refused, status, subscribe, until, until_some, wait_for};

fn point(client: &mut Client, target_m: f64) -> HandReply {
    client.request(Request::Hand { target_m }).expect("it takes one")
}

#[test]
fn the_block_follows_who_points_and_is_let_go_without_news() {
    let daemon = Daemon::start(&["--hand", "mouse", "--ramp-ms", "10"]);
    let (mut hand, mut watcher) = (daemon.client(), daemon.client());
    assert!(status(&mut watcher).device.takes_hand);
    engage(&mut watcher);
    // 500 N/m by 6 mm, less the rig's own friction: the block sticks, with 4 N of stiction.
    wait_for(&mut watcher, "the block holds the handle back", |status| {
        assert_eq!(point(&mut hand, 0.006).lets_go_after_ms, 200);
        status.command_force_n < -1.6
    });
    // Nobody pulls any more but the rig's own friction, 0.8 N, and a count of its encoder, 0.25 N.
    wait_for(&mut watcher, "the arm lets go", |status| {
        status.command_force_n.abs() < 1.1
    });
    subscribe(&mut watcher, &[Topic::Samples]);
    until("the block does not follow", || {
        point(&mut hand, 0.04);
        let Ok(Event::Samples(batch)) = watcher.next_event() else {
            panic!("the daemon does not go on")
        };
        batch.rows.iter().any(|row| row.block_position_m > 0.02)
    });
}

#[test]
fn a_rig_that_a_person_may_hold_takes_no_hand() {
    let rig = FakeRig::start(&[]);
    let daemon = Daemon::start_on(&rig.address(), &[]);
    let mut client = daemon.client();
    assert!(!status(&mut client).device.takes_hand);
    let error = refused(&mut client, Request::Hand { target_m: 0.0 });
    assert_eq!(error.code, ErrorCode::NoHand);
    assert!(error.message.starts_with("serial:"), "{error}");
}

#[test]
fn a_daemon_ends_with_the_program_that_holds_its_input() {
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("run/control.sock");
    let mut command = Command::new(binary("hapticd"));
    command
        .args(["--device", "fake", "--end-with-input", "--ramp-ms", "10", "--socket"])
        .arg(&socket)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    be_patient(&mut command);
    let mut daemon = Killed(command.spawn().expect("hapticd starts"));
    until("it does not come up", || Client::connect(&socket).is_ok());
    engage(&mut Client::connect(&socket).expect("it serves"));
    // As the system does for a program that is killed.
    drop(daemon.stdin.take());
    let ended = until_some("it does not end", || daemon.try_wait().expect("it is a child"));
    assert!(ended.success(), "{ended:?}");
}
