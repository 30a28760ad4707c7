//! Another scene along a recorded motion.

use super::session::{drag, eventful, metadata, metadata_with};
use crate::replay::{Alternative, Summary, Tally, WhatIf, WhatIfRow};
use crate::row::RecordedRow;
use haptic_core::planar::Plane;
use haptic_core::scene::{Coupling, FileCoupling, SceneFile};
use haptic_core::{Scene, Vector};
use haptic_ipc::RigState;
use haptic_recording::Entry;

pub(super) fn what_if_rows(entries: &[Entry], alternative: Alternative) -> (Vec<WhatIfRow>, Summary) {
    let mut what_if = WhatIf::new(&metadata_with(entries), alternative).expect("it can be rendered");
    let rows = entries
        .iter()
        .filter_map(|entry| what_if.entry(entry).expect("it is rendered"));
    let rows = rows.collect();
    (rows, what_if.summary())
}

#[test]
fn the_same_scene_is_felt_the_same_and_another_otherwise() {
    // Its rests are shorter than those from which a breakaway counts.
    let is_felt = |tally: &Tally| tally.breakaways == 0 && tally.stops >= 3 && tally.stuck_s > 0.02;
    felt_the_same_and_otherwise::<f64>(is_felt);
    felt_the_same_and_otherwise::<Plane>(|tally| tally.stops >= 3);
}

fn felt_the_same_and_otherwise<V: Vector>(is_felt: fn(&Tally) -> bool) {
    let session = eventful::<V>();
    let (rows, same) = what_if_rows(&session.entries, Alternative::default());
    assert_eq!(same.largest_difference, None, "{same:?}");
    assert_eq!(same.recorded, same.what_if);
    assert!(is_felt(&same.recorded) && same.recorded.energy_j > 0.0, "{same:?}");
    assert_eq!(rows.len() as u64, same.ticks);
    let (rows, other) = what_if_rows(
        &session.entries,
        Alternative {
            scene: Some(drag().into()),
            ..Alternative::default()
        },
    );
    assert_eq!(other.recorded, same.recorded);
    assert_eq!((other.what_if.stops, other.what_if.ticks), (0, other.recorded.ticks));
    let most = other.largest_difference.expect("they differ");
    let size = |row: &WhatIfRow| {
        let recorded: V = row.recorded.command_force();
        row.what_if
            .map_or(0.0, |other| (other.command_force::<V>() - recorded).length())
    };
    let largest = rows.iter().map(size).fold(0.0, f64::max);
    assert!((most.size_n() - largest).abs() < 1e-12, "{most:?} {largest}");
    let peak_n = rows.iter().map(|row| row.recorded.command_force::<V>().length());
    assert_eq!(other.recorded.peak_force_n, peak_n.fold(0.0, f64::max));
    // A viscous drag of 20 N s/m on the device: where it is fully let in, the force is the velocity's.
    let is_within_limits = |row: &RecordedRow| row.device_velocity::<V>().length() < 0.4;
    let steady = rows
        .iter()
        .filter_map(|row| row.what_if.filter(|row| row.sample.state == RigState::Engaged))
        .filter(is_within_limits);
    let off = steady
        .map(|row| (row.command_force::<V>() + row.device_velocity::<V>() * 20.0).length())
        .filter(|off| *off > 0.5);
    assert!(off.count() < 100);
}

#[test]
fn a_scene_that_leaves_its_grip_to_the_rig_has_the_recordings() {
    let session = eventful::<f64>();
    let mut metadata = metadata_with(&session.entries);
    let of_rig = Coupling {
        stiffness: 3000.0,
        damping: 5.0,
    };
    metadata.scene.coupling = Some(of_rig);
    let summary_of = |coupling: FileCoupling| {
        let scene = SceneFile {
            coupling: Some(coupling),
            ..Scene::paper().into()
        };
        let alternative = Alternative {
            scene: Some(scene),
            ..Alternative::default()
        };
        let mut what_if = WhatIf::new(&metadata, alternative).expect("it can be rendered");
        for entry in &session.entries {
            what_if.entry(entry).expect("it is rendered");
        }
        what_if.summary()
    };
    let of_recording = summary_of(FileCoupling::Rig);
    assert_eq!(of_recording, summary_of(FileCoupling::Own(of_rig)));
    assert_ne!(of_recording, summary_of(FileCoupling::Own(Coupling::CALM)));
}

#[test]
fn what_if_in_the_plane_refuses_what_a_plane_has_not() {
    let session = eventful::<Plane>();
    let scheme = Alternative {
        scheme: Some("literal".parse().expect("a scheme")),
        ..Alternative::default()
    };
    let dahl = Scene::paper().with_law("dahl").expect("a law");
    let law = Alternative {
        scene: Some(dahl.expect("a scene").into()),
        ..Alternative::default()
    };
    for (alternative, what) in [(scheme, "the scheme `literal`"), (law, "the law `dahl`")] {
        let mut what_if = WhatIf::new(&metadata_with(&session.entries), alternative).expect("not yet rendered");
        let error = session.entries.iter().find_map(|entry| what_if.entry(entry).err());
        let error = error.expect("refused").to_string();
        assert!(error.contains(&format!("{what} is for a rig of one axis")), "{error}");
    }
}

#[test]
fn parameter_changes_in_every_scene_or_error_names_the_scene() {
    let session = eventful::<f64>();
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
    let session = eventful::<f64>();
    let (_, whole) = what_if_rows(&session.entries, Alternative::default());
    let (rows, begun) = what_if_rows(&session.entries[420..], Alternative::default());
    assert!(begun.not_computed < 5, "{begun:?}");
    assert!(begun.recorded.ticks + 200 > whole.recorded.ticks, "{begun:?}");
    // The block began elsewhere, and has come to the same place soon.
    let off = |row: &WhatIfRow| {
        let recorded: f64 = row.recorded.command_force();
        row.what_if
            .map_or(0.0, |other| (other.command_force::<f64>() - recorded).abs())
    };
    let late = rows[300..500].iter().map(off).fold(0.0, f64::max);
    assert!(late < 0.2, "{late} N");
}
