//! The instructions of a tick, counted by callgrind: this program starts itself under it. Of every law under hands, and
//! of every kind of scene: a scene pays for what it has.

use haptic_lab::accuracy::LIMITS;
use haptic_lab::cost::{CountError, Probe, count, excitations, hand, limited_cases, scenes};
use haptic_lab::motion::per_tick;
use std::collections::BTreeMap;

/// Instructions a tick of each scene of the table, in the profile that the tests are built with,
/// and a tenth on top. Raise one only for something that the scene really needs.
const BUDGETS: [(&str, f64); 21] = [
    ("viscous on the device", 34.0),
    ("Salcudean-Vlaar on the device", 186.0),
    ("Karnopp on the device", 186.0),
    ("Dahl on the device", 249.0),
    ("Hayward-Armstrong on the device", 260.0),
    ("reset integrator on the device", 183.0),
    ("LuGre without Stribeck on the device", 264.0),
    ("LuGre on the device", 749.0),
    ("elasto-plastic without Stribeck on the device", 330.0),
    ("elasto-plastic on the device", 2019.0),
    ("viscous behind a block", 218.0),
    ("Karnopp behind a block", 360.0),
    ("the same with DV", 360.0),
    ("the same, asymmetric", 383.0),
    ("asymmetric with rising Fs", 392.0),
    ("Karnopp with Stribeck behind a block", 747.0),
    ("Dahl behind a block", 1660.0),
    ("LuGre behind a block", 1858.0),
    ("elasto-plastic behind a block", 2560.0),
    ("excitation along a chirp", 421.0),
    ("excitation along a sweep", 350.0),
];

/// The totals of the ticks that another test of this program runs; nothing without valgrind.
fn counted(test: &str) -> Option<Vec<u64>> {
    let directory = tempfile::tempdir().expect("a directory");
    let this = std::env::current_exe().expect("a test has a path");
    let probe = ["--ignored", "--exact", test, "--test-threads=1"];
    match count(&this, &probe, directory.path()) {
        Err(CountError::NoValgrind) => {
            test_run::skip("valgrind", "Debian: apt install valgrind libc6-dbg");
            None
        }
        totals => Some(totals.expect("counted")),
    }
}

#[test]
fn laws_are_held_to_their_instructions_under_hands() {
    if !test_run::is_long_for("the instructions of every law") {
        return;
    }
    let Some(totals) = counted("the_ticks_that_are_counted") else {
        return;
    };
    let cases = limited_cases();
    assert_eq!(totals.len(), cases.len());
    assert_eq!(cases.len(), 2 * LIMITS.len());
    let mut broken = Vec::new();
    for ((place, case), total) in cases.iter().zip(totals) {
        let limit = LIMITS.iter().find(|limit| limit.law == case.law).expect("a row");
        let (instructions, most) = (per_tick(total, &case.motion), limit.instructions[*place]);
        println!("{:32} {:8} {instructions:10.0} of {most:.0}", case.law, case.hand);
        if instructions > most {
            broken.push(format!(
                "{}, {}: {instructions:.0} instructions a tick, and {most:.0} were agreed on",
                case.law, case.hand
            ));
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
#[ignore = "the test above runs it under callgrind"]
fn the_ticks_that_are_counted() {
    Probe::Limits.run().expect("valid scenes");
}

#[test]
fn a_scene_never_pays_for_what_it_lacks() {
    if !test_run::is_long_for("the instructions of a tick by what its scene has") {
        return;
    }
    let Some(totals) = counted("the_scenes_that_are_counted") else {
        return;
    };
    let motion = hand();
    let names = scenes().into_iter().map(|(name, _)| name);
    let names = names.chain(excitations().into_iter().map(|(name, _)| name));
    let counted: BTreeMap<&str, f64> = names
        .zip(totals.into_iter().map(|total| per_tick(total, &motion)))
        .collect();
    for (scene, count) in &counted {
        println!("{scene:40} {count:8.1}");
    }
    assert_eq!(counted.len(), BUDGETS.len());
    for (scene, budget) in BUDGETS {
        let count = counted[scene];
        assert!(
            count <= budget,
            "{scene}: {count:.0} instructions a tick, and {budget:.0} were agreed on"
        );
    }
    // Each part costs where it is, and not where it is not.
    let of = |scene: &str| counted[scene];
    assert!(of("viscous on the device") * 2.0 < of("Karnopp on the device"));
    assert!(of("Karnopp on the device") < of("Dahl on the device"));
    assert!(of("Karnopp on the device") * 1.8 < of("Karnopp behind a block"));
    assert!(of("viscous behind a block") < of("Karnopp behind a block"));
    // Neither a second direction nor a rising limit is in the way of a steady tick.
    assert!(of("asymmetric with rising Fs") < 1.2 * of("Karnopp behind a block"));
    assert!(of("Karnopp behind a block") * 3.0 < of("Dahl behind a block"));
}

#[test]
#[ignore = "the test above runs it under callgrind"]
fn the_scenes_that_are_counted() {
    Probe::Scenes.run().expect("valid scenes");
    Probe::Excitations.run().expect("bounded excitations");
}
