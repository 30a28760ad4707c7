//! What was recorded against what is computed.

use super::session::{ReplayedSession, compared, eventful, metadata, metadata_with, reasons};
use crate::replay::{Comparison, SkipReason, from};
use haptic_core::passivity::RigLosses;
use haptic_core::planar::Plane;
use haptic_core::servo::{Command, InputWord};
use haptic_ipc::{RigState, Sample, SampleY};
use haptic_recording::{Entry, Mark};

#[test]
fn eventful_session_replays_to_the_last_bit() {
    for session in [eventful::<f64>().entries, eventful::<Plane>().entries] {
        let report = compared(&session);
        assert_eq!((report.differing, &report.first_differing), (0, &None));
        assert_eq!(reasons(&report), [SkipReason::Settling]);
        assert!(report.not_compared < 50 && report.with_force > 900, "{report:?}");
        assert!(report.is_exact());
    }
}

#[test]
fn every_bit_of_every_output_is_compared() {
    type Change<'a> = (&'a str, &'a dyn Fn(&mut Sample, &mut SampleY));
    let nudge = |number: &mut f64| *number = f64::from_bits(number.to_bits() ^ 1);
    let first: [Change<'_>; 8] = [
        ("device_position_m", &|row, _| nudge(&mut row.device_position_m)),
        ("device_velocity_mps", &|row, _| nudge(&mut row.device_velocity_mps)),
        ("block_position_m", &|row, _| nudge(&mut row.block_position_m)),
        ("block_velocity_mps", &|row, _| nudge(&mut row.block_velocity_mps)),
        ("coupling_force_N", &|row, _| nudge(&mut row.coupling_force_n)),
        ("command_force_N", &|row, _| nudge(&mut row.command_force_n)),
        ("contact", &|row, _| row.contact = -2),
        ("state", &|row, _| row.state = RigState::Faulted),
    ];
    let second: [Change<'_>; 6] = [
        ("device_position_y_m", &|_, y| nudge(&mut y.device_position_m)),
        ("device_velocity_y_mps", &|_, y| nudge(&mut y.device_velocity_mps)),
        ("block_position_y_m", &|_, y| nudge(&mut y.block_position_m)),
        ("block_velocity_y_mps", &|_, y| nudge(&mut y.block_velocity_mps)),
        ("coupling_force_y_N", &|_, y| nudge(&mut y.coupling_force_n)),
        ("command_force_y_N", &|_, y| nudge(&mut y.command_force_n)),
    ];
    let line = eventful::<f64>().with_snapshots(0, usize::MAX);
    let plane = eventful::<Plane>().with_snapshots(0, usize::MAX);
    let of_plane = first.iter().chain(&second).map(|change| (&plane, change));
    for (recorded, (column, change)) in first.iter().map(|change| (&line, change)).chain(of_plane) {
        let mut entries = recorded.clone();
        let Entry::Row(row, y) = &mut entries[450] else {
            panic!("a row")
        };
        change(row, y.as_mut().unwrap_or(&mut SampleY::default()));
        let row = *row;
        let report = compared(&entries);
        assert_eq!(report.differing, 1, "{report:?}");
        let first = report.first_differing.expect("one differs");
        assert_eq!((first.tick, first.t_s, first.column), (row.tick, row.t_s, *column));
        assert_ne!(first.recorded, first.computed);
        assert!(first.likely.contains("hapticd 0.0.9"), "{}", first.likely);
    }
}

#[test]
fn force_is_not_compared_without_a_snapshot_or_a_rest_before_it() {
    let entries = eventful::<f64>().entries;
    let report = compared(&entries[400..500]);
    assert_eq!((report.compared(), report.differing), (0, 0));
    assert_eq!(reasons(&report), [SkipReason::BeganWithForce]);
    assert!(!report.is_exact(), "nothing was compared");
    let report = compared(&entries[280..]);
    assert!(reasons(&report).contains(&SkipReason::ForceTooSoon), "{report:?}");
    assert_eq!(report.differing, 0);
}

#[test]
fn ticks_of_an_unrecorded_scene_are_not_compared() {
    let mut entries = eventful::<f64>().with_snapshots(0, 1);
    let place = entries
        .iter()
        .position(|entry| matches!(entry, Entry::Mark(Mark::Scene { .. })));
    entries.remove(place.expect("a scene arrived"));
    let report = compared(&entries);
    // Until the next snapshot, which holds it.
    assert_eq!(reasons(&report), [SkipReason::UnknownScene]);
    assert!(report.differing == 0 && report.not_compared < 97, "{report:?}");
}

#[test]
fn a_pulse_or_an_excitation_is_not_compared_and_what_follows_is() {
    let mut entries = eventful::<f64>().with_snapshots(0, 1);
    let mut rows = entries.iter_mut().filter_map(|entry| match entry {
        Entry::Row(row, _) => Some(row),
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
    // From then to the next snapshot.
    assert!((40..97).contains(&motion.expect("it is reported").ticks), "{report:?}");
    assert!(report.with_force > 900 && report.is_exact(), "{report:?}");
}

#[test]
fn what_became_known_of_the_rig_counts_from_its_engagement_on() {
    let mut session = ReplayedSession::<f64>::new();
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
fn after_lost_rows_it_goes_on_at_the_next_snapshot() {
    for mut entries in [
        eventful::<f64>().with_snapshots(0, 1),
        eventful::<Plane>().with_snapshots(0, 1),
    ] {
        // Ten rows of the first stretch of force.
        entries.drain(410..420);
        let mut later = entries[410..].iter();
        let missing = later.position(|entry| matches!(entry, Entry::Mark(Mark::Snapshot { .. })));
        let report = compared(&entries);
        assert_eq!(reasons(&report), [SkipReason::RowsLost], "{report:?}");
        let missing = missing.expect("a later one") as u64;
        assert_eq!((report.differing, report.not_compared), (0, missing));
    }
}

#[test]
fn seeking_begins_at_the_last_snapshot_before_the_time() {
    let entries = eventful::<Plane>().with_snapshots(0, 3);
    for from_s in [0.0, 0.4, 0.75, 1.2] {
        let found: Vec<Entry> = from(entries.iter().cloned().map(Ok), from_s)
            .map(Result::unwrap)
            .collect();
        let report = compared(&found);
        assert!(report.is_exact() && report.not_compared == 0, "{from_s}: {report:?}");
        let rows = found.iter().filter_map(|entry| match entry {
            Entry::Row(row, _) => Some(row.t_s),
            Entry::Mark(_) => None,
        });
        let first_s = rows.clone().next().expect("a row");
        // Every third of one in 97 ticks.
        assert!(
            (from_s - 0.292..=from_s + 0.001).contains(&first_s),
            "{first_s} for {from_s}"
        );
        assert_eq!(rows.count() as u64, report.ticks);
    }
}

#[test]
fn parts_are_compared_as_the_whole_is() {
    let session = eventful::<Plane>();
    let mut entries = session.with_snapshots(0, 2);
    // The first part is read without a snapshot before it.
    assert!(matches!(entries.remove(0), Entry::Mark(Mark::Snapshot { .. })));
    let row = entries.iter_mut().filter_map(|entry| match entry {
        Entry::Row(row, _) => Some(row),
        Entry::Mark(_) => None,
    });
    for row in row.skip(150).step_by(200) {
        row.command_force_n += 1.0;
    }
    let mut whole = Comparison::new(&metadata_with(&entries)).expect("it is replayed");
    for entry in &entries {
        whole.entry(entry).expect("it is rendered");
    }
    assert_eq!(compared(&entries), whole.report());
}
