//! Records whose motion and force were taken by two clocks.

use super::*;
use crate::motion::{between, places};

fn found_on(clocks: Clocks, record: &Record) -> Identified {
    found_with(record, |options| options.clocks = clocks)
}

#[test]
fn clocks_that_differ_are_aligned_and_the_shift_reported() {
    let truth = record(alike(), 4);
    for samples in [4_usize, 25] {
        let mut late = truth.clone();
        // The force is stamped this number of samples later than it was.
        late.force_n.rotate_right(samples);
        let found = found_on(Clocks::Delayed, &late);
        let shift_s = samples as f64 * 1e-3;
        assert!(
            (found.shift_s - shift_s).abs() < 5e-4,
            "{} for {shift_s}",
            found.shift_s
        );
        let [low, high] = found.intervals["shift_s"];
        assert!(low <= shift_s && shift_s <= high, "{low} to {high}");
        held(&found, 0.0, 2.0);
    }
    assert!(found(&truth).shift_s.abs() < 2e-4);
}

/// The record with forces by another recorder: so much later, and by a clock that runs faster, in parts in a million.
fn by_another_clock(truth: &Record, shift_s: f64, drift_ppm: f64) -> Record {
    let (t, last) = (&truth.t_s, truth.t_s.len() - 1);
    let middle_s = f64::midpoint(t[0], t[last]);
    // What was stamped t by the force's clock was there at this time.
    let there = t
        .iter()
        .map(|t_s| middle_s + (t_s - shift_s - middle_s) / (1.0 + 1e-6 * drift_ppm));
    Record {
        force_n: places(t, there).map(|place| between(&truth.force_n, place)).collect(),
        ..truth.clone()
    }
}

#[test]
fn a_clock_that_drifts_is_reported_with_its_shift_and_removed() {
    let truth = record(alike(), 4);
    for (shift_s, drift_ppm) in [(0.012, 400.0), (-0.2, -500.0)] {
        let found = found_on(Clocks::Two, &by_another_clock(&truth, shift_s, drift_ppm));
        let reported = found.clock_drift_ppm.expect("it drifts");
        assert!(
            (reported - drift_ppm).abs() < 60.0,
            "{reported} ppm for {drift_ppm}: {found:#?}"
        );
        let [low, high] = found.intervals["clock_drift_ppm"];
        assert!(low <= drift_ppm && drift_ppm <= high, "{low} to {high}");
        assert!(
            (found.shift_s - shift_s).abs() < 5e-4,
            "{} for {shift_s}",
            found.shift_s
        );
        held(&found, 0.0, 2.0);
    }
    assert_eq!(
        found_on(Clocks::Two, &truth).clock_drift_ppm,
        None,
        "clocks that run alike"
    );
    // What is known is not looked for.
    let late = by_another_clock(&truth, 0.1, 0.0);
    let given = found_on(Clocks::Shifted(0.1), &late);
    assert_eq!((given.shift_s, given.clock_drift_ppm), (0.1, None));
    held(&given, 0.0, 2.0);
}

#[test]
fn a_steady_motion_says_nothing_of_two_clocks() {
    let mut steady = record(alike(), 4);
    let mut random = fastrand::Rng::with_seed(7);
    let mut noise = || (0..12).map(|_| random.f64() - 0.5).sum::<f64>();
    for (k, (x, force)) in steady.position_m.iter_mut().zip(&mut steady.force_n).enumerate() {
        *x = (5e-5 * k as f64 / 1e-5).round() * 1e-5;
        *force = 3.5 + 0.1 * noise();
    }
    for clocks in [Clocks::Delayed, Clocks::Two] {
        let found = found_on(clocks, &steady);
        assert_eq!((found.shift_s, found.clock_drift_ppm), (0.0, None), "{found:#?}");
        let refusal = found.refused.iter().find(|refusal| refusal.parameter == "shift_s");
        let reason = &refusal.expect("the shift is refused").reason;
        assert!(reason.contains("does not separate inertia"), "{reason}");
        assert_eq!(
            found.intervals.len(),
            0,
            "what hangs on the shift is refused with it: {found:#?}"
        );
    }
}

#[test]
fn single_file_is_not_shifted_but_a_better_shift_is_noted() {
    let mut late = record(alike(), 1);
    late.force_n.rotate_right(4);
    let as_it_is = found(&late);
    assert_eq!((as_it_is.shift_s, as_it_is.intervals.get("shift_s")), (0.0, None));
    assert!(
        says(&as_it_is, "--shift-ms auto") && says(&as_it_is, "One of 4."),
        "{:?}",
        as_it_is.notes
    );
    let delayed = found_on(Clocks::Delayed, &late);
    assert!((delayed.shift_s - 4e-3).abs() < 5e-4);
    // Between two samples nothing is known.
    let [low_s, high_s] = delayed.intervals["shift_s"];
    assert!(high_s - low_s >= 0.3e-3, "{low_s} to {high_s}");
    assert!(!says(&found(&record(alike(), 1)), "--shift-ms"));
}

#[test]
fn one_frequency_does_not_determine_the_shift_of_recorders() {
    let conditions = Conditions {
        shift_s: 4e-3,
        ..Conditions::FAIR
    };
    // These would be answered: a shift, inertia and viscous friction together leave little.
    for (kind, seed) in [(Kind::Sine, 6), (Kind::Sine, 36), (Kind::Growing, 4)] {
        let found = found_on(Clocks::Two, &kinds::record(kind, &conditions, seed).0);
        assert!(refused(&found).contains(&"shift_s"), "{kind:?} {seed}: {found:#?}");
        assert!(found.intervals.is_empty(), "{:?}", found.intervals);
    }
}
