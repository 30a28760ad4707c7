//! The instructions of a tick, counted by callgrind: this program starts itself under it. Of every law under hands, behind
//! blocks and on the device: a scene pays for what it has.

use haptic_lab::accuracy::LIMITS;
use haptic_lab::cost::{CountError, Probe, count, excitations, hand, limited_cases};
use haptic_lab::motion::per_tick;

/// Instructions a tick of the excitations, in the profile that the tests are built with, and a tenth on top.
const EXCITATIONS: [(&str, f64); 2] = [("excitation along a chirp", 421.0), ("excitation along a sweep", 350.0)];

/// The totals of the ticks that the other test of this program runs; nothing without valgrind.
fn counted() -> Option<Vec<u64>> {
    let directory = tempfile::tempdir().expect("a directory");
    let this = std::env::current_exe().expect("a test has a path");
    let probe = ["--ignored", "--exact", "the_ticks_that_are_counted", "--test-threads=1"];
    match count(&this, &probe, directory.path()) {
        Err(CountError::NoValgrind) => {
            test_run::skip("valgrind", "Debian: apt install valgrind libc6-dbg");
            None
        }
        totals => Some(totals.expect("counted")),
    }
}

#[test]
fn a_scene_never_pays_for_what_it_lacks() {
    if !test_run::is_long_for("the instructions of every law") {
        return;
    }
    let Some(totals) = counted() else {
        return;
    };
    let (cases, hand) = (limited_cases(), hand());
    let laws = cases.iter().map(|(place, case)| {
        let limit = LIMITS.iter().find(|limit| limit.law == case.law).expect("a row");
        let name = (case.law, case.hand, case.mass_kg);
        (name, &case.motion, limit.instructions[*place])
    });
    let excitations = excitations().into_iter().zip(EXCITATIONS);
    let excitations = excitations.map(|((name, _), (limited, most))| {
        assert_eq!(name, limited);
        ((name, "2 Hz", None), &hand, most)
    });
    let limited: Vec<_> = laws.chain(excitations).collect();
    assert_eq!(totals.len(), limited.len());
    let mut broken = Vec::new();
    let mut counted = Vec::new();
    for ((name, motion, most), total) in limited.into_iter().zip(totals) {
        let instructions = per_tick(total, motion);
        println!("{name:?} {instructions:10.0} of {most:.0}");
        if instructions > most {
            broken.push(format!(
                "{name:?}: {instructions:.0} instructions a tick, and {most:.0} were agreed on"
            ));
        }
        counted.push((name, instructions));
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
    // Each part costs where it is, and not where it is not.
    let of = |law: &str, mass_kg: Option<f64>| {
        let wanted = (law, "60 Hz", mass_kg);
        counted.iter().find(|(name, _)| *name == wanted).expect("a row").1
    };
    let (device, block) = (None, Some(0.5));
    assert!(of("viscous", device) * 2.0 < of("karnopp", device));
    assert!(of("karnopp", device) < of("dahl", device));
    assert!(of("karnopp", device) * 1.8 < of("karnopp", block));
    assert!(of("viscous", block) < of("karnopp", block));
    // A rising limit is not in the way of a steady tick.
    assert!(of("karnopp, rising Fs", block) < 1.2 * of("karnopp", block));
    assert!(of("karnopp", block) * 3.0 < of("dahl", block));
}

#[test]
#[ignore = "the test above runs it under callgrind"]
fn the_ticks_that_are_counted() {
    Probe::Limits.run().expect("valid scenes");
}
