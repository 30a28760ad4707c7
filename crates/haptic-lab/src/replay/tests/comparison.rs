//! What was recorded against what is computed.

use super::session::{Session, TickInput, compared, eventful, metadata, reasons};
use crate::replay::{Comparison, SkipReason, replay};
use haptic_core::Scene;
use haptic_core::passivity::RigLosses;
use haptic_core::servo::{Command, InputWord};
use haptic_ipc::RigState;
use haptic_recording::{Entry, Mark};
use std::time::{Duration, Instant};

#[test]
fn eventful_session_replays_to_the_last_bit() {
    let session = eventful();
    // Wherever in its rest it began.
    for begun in [0, 1, 50, 100, 150, 180] {
        let entries = session.without_first(begun);
        let report = compared(&entries);
        assert_eq!((report.differing, &report.first_differing), (0, &None), "{begun}");
        assert_eq!(reasons(&report), [SkipReason::Settling]);
        assert!(report.not_compared < 150 && report.with_force > 900, "{report:?}");
        assert!(report.is_exact());
    }
}

#[test]
fn every_bit_of_every_output_is_compared() {
    let session = eventful();
    let at = 450;
    let Entry::Row(row) = session.entries[at] else {
        panic!("a row")
    };
    let mut changed = [row; 8];
    let nudge = |number: &mut f64| *number = f64::from_bits(number.to_bits() ^ 1);
    nudge(&mut changed[0].device_position_m);
    nudge(&mut changed[1].device_velocity_mps);
    nudge(&mut changed[2].block_position_m);
    nudge(&mut changed[3].block_velocity_mps);
    nudge(&mut changed[4].coupling_force_n);
    nudge(&mut changed[5].command_force_n);
    changed[6].contact = -2;
    changed[7].state = RigState::Faulted;
    let mut columns = Vec::new();
    for changed in changed {
        let mut entries = session.entries.clone();
        entries[at] = Entry::Row(changed);
        let report = compared(&entries);
        assert_eq!(report.differing, 1, "{report:?}");
        let first = report.first_differing.expect("one differs");
        assert_eq!((first.tick, first.t_s), (row.tick, row.t_s));
        assert_ne!(first.recorded, first.computed);
        assert!(first.likely.contains("hapticd 0.0.9"), "{}", first.likely);
        columns.push(first.column);
    }
    let all = [
        "device_position_m",
        "device_velocity_mps",
        "block_position_m",
        "block_velocity_mps",
        "coupling_force_N",
        "command_force_N",
        "contact",
        "state",
    ];
    assert_eq!(columns, all);
}

#[test]
fn gap_suspends_comparison_until_the_rig_is_without_force() {
    let session = eventful();
    for with_mark in [true, false] {
        let mut entries = session.entries.clone();
        // Ten rows within the first stretch of force: about 410 to 420, with two scenes and a stop to come.
        entries.drain(410..420);
        if with_mark {
            entries.insert(410, Entry::Mark(Mark::Lost { rows: 10 }));
        }
        let report = compared(&entries);
        assert_eq!(report.differing, 0, "{report:?}");
        assert_eq!(reasons(&report), [SkipReason::Settling, SkipReason::RowsLost]);
        let lost = report.uncompared[1];
        let stopped = session.entries.iter().find_map(|entry| match entry {
            Entry::Row(row) if row.state == RigState::Stopped => Some(row.tick),
            _ => None,
        });
        assert_eq!(
            Some(lost.first_tick + lost.ticks),
            stopped,
            "it continues where the rig stopped: {report:?}"
        );
        // The rest begins with too short a time without force, and is compared from the next one on.
        assert!(report.with_force > 100, "{report:?}");
        assert!(report.is_exact());
    }
}

#[test]
fn recording_begun_with_force_is_compared_after_it_ends() {
    let mut session = eventful();
    let whole = compared(&session.without_first(400));
    assert_eq!(reasons(&whole)[..2], [SkipReason::Settling, SkipReason::BeganWithForce]);
    assert!(whole.is_exact(), "{whole:?}");
    session.entries.truncate(500);
    let report = compared(&session.without_first(400));
    assert_eq!((report.compared(), report.differing), (0, 0));
    assert_eq!(reasons(&report), [SkipReason::BeganWithForce]);
    assert!(!report.is_exact(), "nothing was compared");
}

#[test]
fn force_before_the_servo_settles_is_not_compared() {
    let report = compared(&eventful().without_first(280));
    assert!(reasons(&report).contains(&SkipReason::ForceTooSoon), "{report:?}");
    assert_eq!(report.differing, 0);
}

#[test]
fn ticks_of_an_unrecorded_scene_are_not_compared() {
    let session = eventful();
    let mut entries = session.entries.clone();
    let place = entries
        .iter()
        .position(|entry| matches!(entry, Entry::Mark(Mark::Scene { .. })));
    entries.remove(place.expect("a scene arrived"));
    let report = compared(&entries);
    assert_eq!(reasons(&report), [SkipReason::Settling, SkipReason::UnknownScene]);
    assert!(report.differing == 0 && report.with_force > 300, "{report:?}");
}

#[test]
fn a_pulse_or_an_excitation_is_not_compared_and_what_follows_is() {
    let mut entries = eventful().entries;
    let mut rows = entries.iter_mut().filter_map(|entry| match entry {
        Entry::Row(row) => Some(row),
        Entry::Mark(_) => None,
    });
    // While the rig is without force, it is lent to a motion that nothing else in the recording shows.
    for row in rows.by_ref().skip(50).take(40) {
        row.input_flags = InputWord {
            flags: row.input_flags,
            detail: 0,
        }
        .with_motion()
        .flags;
        row.block_position_m += 1e-3;
        row.command_force_n = 0.7;
    }
    let report = compared(&entries);
    assert_eq!(report.differing, 0, "{report:?}");
    let motion = report
        .uncompared
        .iter()
        .find(|one| one.reason == SkipReason::UnknownScene);
    assert_eq!(motion.expect("it is reported").ticks, 40, "{report:?}");
    assert!(report.with_force > 900 && report.is_exact(), "{report:?}");
}

#[test]
fn silent_device_is_skipped_if_its_period_predates_recording() {
    let mut session = Session::new();
    session.run(350).command(Command::Engage).run(200);
    for _ in 0..6 {
        session.tick(TickInput {
            is_silent: true,
            ..TickInput::default()
        });
    }
    session
        .run(100)
        .command(Command::Release)
        .run(200)
        .command(Command::Engage)
        .run(100);
    let report = compared(&session.without_first(137));
    assert_eq!(report.differing, 0, "{report:?}");
    assert!(reasons(&report).contains(&SkipReason::DeviceSilent), "{report:?}");
    assert!(report.with_force > 250, "{report:?}");
}

#[test]
fn what_became_known_of_the_rig_counts_from_its_engagement_on() {
    let mut session = Session::new();
    let losses = RigLosses {
        damping: 0.0,
        friction: 0.0,
    };
    session
        .run(300)
        .command(Command::Engage)
        .run(300)
        .command(Command::Release);
    session.run(200).set_rig(losses, None).command(Command::Engage).run(300);
    let report = session.replayed(0);
    assert_eq!((report.differing, &report.first_differing), (0, &None));
    assert!(report.with_force > 500, "{report:?}");
    // Without the mark the second engagement is computed with what was known before.
    session
        .entries
        .retain(|entry| !matches!(entry, Entry::Mark(Mark::Servo { .. })));
    assert!(session.replayed(0).differing > 100);
}

#[test]
fn what_follows_from_no_recording_is_refused() {
    let mut thinned = metadata();
    thinned.rate_hz = 100.0;
    let error = Comparison::new(&thinned).expect_err("thinned").to_string();
    assert!(error.contains("100 of 1000 ticks a second"), "{error}");
    let mut early = metadata();
    early.servo = None;
    let error = Comparison::new(&early).expect_err("without settings").to_string();
    assert!(error.contains("hapticd 0.0.9 did not record"), "{error}");
}

#[test]
fn replay_of_a_recorder_file_needs_only_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("session.csv");
    let mut recorder = haptic_recording::create(&path, &metadata(), false).expect("begun");
    let mut session = Session::new();
    session.run(300).command(Command::Engage).run(300);
    let rows = session.entries.iter().map(|entry| match entry {
        Entry::Row(row) => *row,
        Entry::Mark(mark) => panic!("{mark:?}"),
    });
    let samples = haptic_ipc::SamplesEvent {
        seq: 0,
        dropped: 0,
        rows: rows.collect(),
    };
    recorder.event(&haptic_ipc::Event::Samples(samples)).expect("written");
    recorder.finish().expect("written");
    let reader = haptic_recording::open(&path).expect("reads");
    let metadata = reader.metadata().clone();
    let report = replay(&metadata, reader).expect("it is replayed");
    assert!(report.is_exact() && report.with_force > 200, "{report:?}");
}

/// Prints how long the steps of an hour take, with a ramp every five seconds.
#[test]
fn the_steps_of_an_hour_take_seconds() {
    let wanted = test_run::extent(20_000, 3_600_000);
    let stickier = Scene::paper()
        .with(&[("Fs".parse().expect("a key"), 8.0)])
        .expect("a scene");
    let mut session = Session::new();
    session.run(200).command(Command::Engage);
    let mut comparison = Comparison::new(&metadata()).expect("it is replayed");
    let mut took = Duration::ZERO;
    let mut scene = Scene::paper();
    while session.tick < wanted {
        scene = if scene == stickier {
            Scene::paper()
        } else {
            stickier.clone()
        };
        session.tick(TickInput {
            scene: Some((scene.clone(), 0.1)),
            ..TickInput::default()
        });
        session.run(5000);
        let entries = std::mem::take(&mut session.entries);
        let began = Instant::now();
        for entry in &entries {
            comparison.entry(entry).expect("it is rendered");
        }
        took += began.elapsed();
    }
    let report = comparison.report();
    assert!(report.is_exact(), "{report:?}");
    let hour_s = took.as_secs_f64() / report.ticks as f64 * 3.6e6;
    println!(
        "{} ticks in {took:.2?}: an hour at 1 kHz in {hour_s:.1} s",
        report.ticks
    );
}

/// A hand that moves leaves the tracker's last bits to be found, wherever the recording began.
#[test]
fn replay_finds_velocity_to_the_last_bit_under_a_moving_hand() {
    let mut session = Session::new();
    session.run(700).command(Command::Engage).run(150);
    let mut longest = 0;
    for begun in 0..550 {
        let report = compared(&session.without_first(begun));
        assert!(report.is_exact() && report.with_force > 100, "{begun}: {report:?}");
        longest = longest.max(report.not_compared);
    }
    println!("compared after {longest} ticks at most");
    assert!(longest < 150);
}
