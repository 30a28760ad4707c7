//! The instructions of every law under hands, counted by callgrind: this program starts itself under
//! it.

use haptic_lab::accuracy::LIMITS;
use haptic_lab::cost::{CountError, Probe, count, limited_cases};
use haptic_lab::motion::per_tick;

#[test]
fn laws_are_held_to_their_instructions_under_hands() {
    if !test_run::is_long_for("the instructions of every law") {
        return;
    }
    let directory = tempfile::tempdir().expect("a directory");
    let this = std::env::current_exe().expect("a test has a path");
    let probe = ["--ignored", "--exact", "the_ticks_that_are_counted", "--test-threads=1"];
    let totals = match count(&this, &probe, directory.path()) {
        Err(CountError::NoValgrind) => {
            test_run::skip("valgrind", "Debian: apt install valgrind libc6-dbg");
            return;
        }
        totals => totals.expect("counted"),
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
