//! A real machine's motion: the fake rig's hand follows its whole 1 kHz record while the scene
//! changes under it.

use haptic_ipc::{ChangeReply, Event, Request, RigState, StateReply, Timing, Topic};
use std::sync::mpsc;
use system_tests::fake_rig::FakeRig;
use system_tests::{Daemon, machine_record, subscribe, wait_for_state};

/// The times and half the positions of a record.
fn halved(record: &str) -> String {
    let rows = record.lines().skip(1).map(|line| {
        let (t_s, rest) = line.split_once(',').expect("two columns");
        let position_m: f64 = rest
            .split(',')
            .next()
            .and_then(|cell| cell.parse().ok())
            .expect("a number");
        format!("{t_s},{}\n", 0.5 * position_m)
    });
    format!("t_s,position_m\n{}", rows.collect::<String>())
}

#[test]
fn every_tick_of_real_motion_reaches_subscriber() {
    let Some(path) = machine_record() else {
        test_run::skip("emps-pulses.csv", "the real machine's record, in ../shared/data");
        return;
    };
    let directory = tempfile::tempdir().expect("a directory");
    let hand = directory.path().join("hand.csv");
    std::fs::write(&hand, halved(&std::fs::read_to_string(path).expect("text"))).expect("written");
    let rig = FakeRig::start(&["--hand", hand.to_str().expect("a plain path")]);
    let daemon = Daemon::start_on(&rig.address(), &[]);
    let mut subscriber = daemon.client();
    subscribe(&mut subscriber, &[Topic::Samples]);
    // What waits for a reader is dropped after a while, and a change may take longer on a busy machine.
    let (queue, events) = mpsc::channel();
    std::thread::spawn(move || while queue.send(subscriber.next_event().expect("the daemon goes on")).is_ok() {});
    let mut tuner = daemon.client();
    let _: StateReply = tuner.request(Request::engage()).expect("it is idle");
    wait_for_state(&mut tuner, RigState::Engaged);

    let scenes = [
        ("Fs", 5.0),
        ("Fd", 2.0),
        ("mass", 1.5),
        ("Fs", 4.0),
        ("Fd", 3.5),
        ("mass", 0.5),
    ];
    let (mut last, mut next_change, mut changes) = (None, 1000, 0);
    let (mut slides, mut sticks, mut farthest) = (0_u64, 0_u64, 0.0_f64);
    let mut revisions = Vec::new();
    let mut end_s = 0.0;
    // Of 24.85 s.
    let whole_s = test_run::extent(6_u32, 24);
    while end_s < f64::from(whole_s) + 0.84 {
        let Event::Samples(batch) = events.recv().expect("the daemon goes on") else {
            panic!("only samples were asked for");
        };
        assert_eq!(batch.dropped, 0);
        for row in &batch.rows {
            assert!(
                last.is_none_or(|last| row.tick == last + 1),
                "{} after {last:?}",
                row.tick
            );
            last = Some(row.tick);
            end_s = row.t_s;
            assert!(
                row.command_force_n.is_finite() && row.command_force_n.abs() <= 20.0,
                "{row:?}"
            );
            farthest = farthest.max(row.device_position_m);
            match row.contact {
                0 => sticks += 1,
                _ => slides += 1,
            }
            if revisions.last() != Some(&row.revision) {
                revisions.push(row.revision);
            }
        }
        if last > Some(next_change) {
            next_change += 1000;
            let (name, value) = scenes[changes % scenes.len()];
            let changed = daemon.ctl_ok(&["set", &format!("{name}={value}"), "--json"]);
            let reply: ChangeReply = serde_json::from_str(&changed).expect("a set reply");
            changes += 1;
            assert_eq!(reply.revision, 1 + changes as u64);
        }
    }
    let timing: Timing = tuner.request(Request::Timing {}).expect("a timing");
    let all = timing.since_start;
    println!(
        "{} ticks, {} overruns, {} missed periods, {} samples dropped, tick p50 {} ns, p99 {} ns; {changes} changes; {slides} ticks sliding, {sticks} stuck",
        all.ticks, all.overruns, all.missed_periods, all.telemetry_dropped, all.tick_ns.p50, all.tick_ns.p99
    );
    assert_eq!(all.telemetry_dropped, 0);
    assert!(changes as u64 + 2 > u64::from(whole_s), "{changes}");
    assert!(revisions.windows(2).all(|pair| pair[1] > pair[0]), "{revisions:?}");
    assert!(
        (farthest - 0.5 * 0.2465).abs() < 1e-3,
        "the whole stroke was followed, to {farthest} m"
    );
    assert!(
        slides > 1000 && sticks > 100,
        "the block slid and stuck: {slides}, {sticks}"
    );
}
