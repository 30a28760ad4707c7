//! Another scene along a recorded motion.

use super::session::{drag, eventful, metadata};
use crate::replay::{Alternative, Summary, WhatIf, WhatIfRow};
use haptic_ipc::RigState;
use haptic_recording::Entry;

pub(super) fn what_if_rows(entries: &[Entry], alternative: Alternative) -> (Vec<WhatIfRow>, Summary) {
    let mut what_if = WhatIf::new(&metadata(), alternative).expect("it can be rendered");
    let rows = entries
        .iter()
        .filter_map(|entry| what_if.entry(entry).expect("it is rendered"));
    let rows = rows.collect();
    (rows, what_if.summary())
}

#[test]
fn the_same_scene_is_felt_the_same_and_another_otherwise() {
    let session = eventful();
    let (rows, same) = what_if_rows(&session.entries, Alternative::default());
    assert_eq!(same.largest_difference, None, "{same:?}");
    assert_eq!(same.recorded, same.what_if);
    assert!(same.recorded.breakaways >= 3 && same.recorded.stops >= 3, "{same:?}");
    assert!(same.recorded.energy_j > 0.0 && same.recorded.stuck_s > 0.02, "{same:?}");
    assert_eq!(rows.len() as u64, same.ticks);
    let (rows, other) = what_if_rows(
        &session.entries,
        Alternative {
            scene: Some(drag()),
            ..Alternative::default()
        },
    );
    assert_eq!(other.recorded, same.recorded);
    assert_eq!((other.what_if.stops, other.what_if.ticks), (0, other.recorded.ticks));
    let most = other.largest_difference.expect("they differ");
    let size = |row: &WhatIfRow| {
        row.what_if.map_or(0.0, |other| {
            (other.command_force_n - row.recorded.command_force_n).abs()
        })
    };
    let largest = rows.iter().map(size).fold(0.0, f64::max);
    assert_eq!((most.what_if_n - most.recorded_n).abs(), largest);
    // A viscous drag of 20 N s/m on the device: where it is fully let in, the force is the velocity's.
    let steady = rows
        .iter()
        .filter_map(|row| row.what_if.filter(|row| row.state == RigState::Engaged));
    let off = steady
        .map(|row| row.command_force_n + 20.0 * row.device_velocity_mps)
        .filter(|off| off.abs() > 0.5);
    assert!(off.count() < 100);
}

#[test]
fn parameter_changes_in_every_scene_or_error_names_the_scene() {
    let session = eventful();
    let alternative = Alternative {
        changes: vec![("Fs".parse().expect("a key"), 9.0)],
        ..Alternative::default()
    };
    // The fourth scene is viscous.
    let mut what_if = WhatIf::new(&metadata(), alternative.clone()).expect("the first scene has it");
    let error = session.entries.iter().find_map(|entry| what_if.entry(entry).err());
    assert!(error.expect("refused").to_string().starts_with("revision 4: "));
    let (_, stickier) = what_if_rows(&session.entries[..700], alternative);
    assert!(stickier.what_if.stuck_s > stickier.recorded.stuck_s, "{stickier:?}");
}

#[test]
fn what_if_follows_a_recording_that_begins_with_force() {
    let session = eventful();
    let (_, whole) = what_if_rows(&session.entries, Alternative::default());
    let (rows, begun) = what_if_rows(&session.entries[420..], Alternative::default());
    assert!(begun.not_computed < 5, "{begun:?}");
    assert!(begun.recorded.ticks + 200 > whole.recorded.ticks, "{begun:?}");
    // The block began elsewhere, and has come to the same place soon.
    let off = |row: &WhatIfRow| {
        row.what_if.map_or(0.0, |other| {
            (other.command_force_n - row.recorded.command_force_n).abs()
        })
    };
    let late = rows[300..500].iter().map(off).fold(0.0, f64::max);
    assert!(late < 0.2, "{late} N");
}
