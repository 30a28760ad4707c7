//! The checker for writers of firmware sees what a firmware does wrong: the fake rig does each of
//! it on purpose.

use system_tests::fake_rig::FakeRig;
use system_tests::simulated_rig::{Encoder, SimulatedRig, checked, tried};

const TMP: &str = env!("CARGO_TARGET_TMPDIR");

const ENABLES: &str = "enables_and_disables";

/// Each fault is seen by a check, in these words.
fn sees(faults: &[(&str, &str, &str)]) {
    if !test_run::is_long_for("what the checker of firmware sees") {
        return;
    }
    for &(fault, check, words) in faults {
        tried(|| {
            let mut rig = FakeRig::start(&["--hand", "free"]);
            rig.fail(fault);
            let (passed, printed) = checked(rig.link(), &["--only", check])?;
            Some((!passed && printed.contains(words), printed))
        });
    }
}

// hazard: H9
#[test]
fn a_motor_that_stays_on_is_seen() {
    sees(&[
        ("ignore-off", ENABLES, "an enable(off) leaves the motor enabled"),
        (
            "ignore-command-off",
            ENABLES,
            "a command without 'enabled' leaves the motor on",
        ),
        ("stay-enabled", ENABLES, "an enable(off) leaves the motor enabled"),
        ("stay-enabled", "has_a_watchdog", "no sample with the motor off"),
        ("keep-mark", "has_a_watchdog", "no sample without the mark"),
        ("watchdog-ms 0", "says_who_it_is", "a watchdog of 0 ms"),
        ("watchdog-ms 500", "says_who_it_is", "a watchdog of 500 ms"),
        ("force-limit 0", "says_who_it_is", "a motor without a force"),
        ("no-echo", "says_what_it_has_heard", "no echo of the command"),
    ]);
}

// hazard: H3
#[test]
fn a_clock_that_lies_is_seen() {
    sees(&[
        ("clock-backwards", "counts_its_samples", "the clock runs backwards"),
        ("clock-stop", "counts_its_samples", "the clock stands still"),
        ("clock-wrap16", "counts_its_samples", "the clock runs backwards"),
        ("clock-torn", "counts_its_samples", "the clock runs backwards"),
        ("clock-speed 1.02", "counts_its_samples", "where 1000 Hz were promised"),
        ("clock-half", "keeps_time", "times the speed of this computer's"),
        ("clock-double", "keeps_time", "times the speed of this computer's"),
        ("clock-speed 1.08", "keeps_time", "times the speed of this computer's"),
    ]);
}

#[test]
fn only_a_clear_move_shows_the_direction() {
    if !test_run::is_long_for("what the checker of firmware sees") {
        return;
    }
    let push = |options: &[&str]| {
        let rig = FakeRig::start(&[&["--hand", "free", "--mass-kg", "0.2"], options].concat());
        checked(rig.link(), &["--only", "says_who_it_is", "--push", "2"])
    };
    for (options, passes, words) in [
        (&[][..], true, "+2 N: +"),
        (&["--reversed"], false, "swap the motor's or the encoder's wires"),
        (&["--friction-n", "4"], false, "show no direction"),
        (&["--reversed", "--resolution-mm", "100"], false, "show no direction"),
    ] {
        let Some((passed, printed)) = push(options) else { return };
        assert!(passed == passes && printed.contains(words), "{options:?}: {printed}");
    }
}

#[test]
fn a_handle_too_fast_for_its_encoder_is_reported() {
    let light = ["--amplitude", "0", "--arm-stiffness", "0", "--arm-damping", "0"];
    let light = [&light[..], &["--mass", "0.05", "--coulomb", "0.15", "--viscous", "0"]].concat();
    let Some(rig) = SimulatedRig::start(Encoder::Quadrature, TMP, &light) else {
        return;
    };
    let reported = "the device reports an error: code 2 (the position sensor fails, or the handle moved \
                    faster than it can follow), detail 0";
    tried(|| {
        let push = ["--slow", "2", "--only", "says_who_it_is", "--push", "4"];
        let (passed, printed) = checked(rig.line(), &push)?;
        assert!(!passed, "{printed}");
        let says = printed.contains(reported) && printed.contains("m/s, push less");
        Some((says && !printed.contains("stood still"), printed))
    });
}
