//! Every law with the exact scheme under the hands that people have, held to the table of limits in
//! `haptic_lab::accuracy::LIMITS`.

use haptic_core::friction::LAWS;
use haptic_lab::accuracy::{
    LIMITS, LawLimit, LawMeasurement, hands, law_cases, measure_law, measure_single_ticks, worst_of,
};

/// Samples of each motion, and single ticks of each law: beginnings of what the report takes.
fn extents() -> (usize, usize) {
    test_run::extent((10, 10), (150, 300))
}

fn exact(all: Vec<LawMeasurement>) -> LawMeasurement {
    all.into_iter().next().expect("the exact scheme comes first")
}

fn measured(law: &'static str) -> Vec<LawMeasurement> {
    let (samples, single_ticks) = extents();
    let mut all: Vec<LawMeasurement> = law_cases(samples)
        .iter()
        .filter(|case| case.law == law)
        .map(|case| exact(measure_law(case, false, None).expect("a valid scene")))
        .collect();
    let (name, friction) = hands::laws_under_hands()
        .into_iter()
        .find(|(name, _)| *name == law)
        .expect("a law of the table");
    all.push(exact(
        measure_single_ticks(name, friction, single_ticks).expect("valid scenes"),
    ));
    all
}

/// The limits that a law's measurements break.
fn broken(limit: &LawLimit, all: &[LawMeasurement]) -> Vec<String> {
    let (device, behind): (Vec<&LawMeasurement>, Vec<&LawMeasurement>) = all.iter().partition(|one| one.is_on_device());
    let other_lists = behind
        .iter()
        .filter(|one| one.errors.same_changes == Some(false))
        .count();
    let (behind, device) = (worst_of(behind), worst_of(device));
    println!(
        "{:32} behind a block {behind:?}\n{:32} on the device {device:?}",
        limit.law, ""
    );
    let mut broken = Vec::new();
    let mut hold = |what: &str, value: f64, most: f64| {
        if value > most || value.is_nan() {
            broken.push(format!(
                "{}: {what} is {value:e}, and {most:e} was agreed on",
                limit.law
            ));
        }
    };
    hold("the reference's own error, N", worst_of(all).uncertainty_n, 1e-12);
    hold(
        "the force error behind a block, N",
        behind.worst_n,
        limit.behind_block_n,
    );
    hold("its median, N", behind.median_n, limit.median_n);
    hold("the force error on the device, N", device.worst_n, limit.on_device_n);
    hold("the ticks at their bound", behind.at_bound as f64, limit.at_bound);
    hold(
        "the runs with other stops or breakaways",
        other_lists as f64,
        limit.other_lists,
    );
    for one in all {
        println!("    {:14} {:?} kg: {:.1e} N", one.hand, one.mass_kg, one.errors.worst_n);
    }
    broken
}

#[test]
fn laws_are_held_to_their_limits_under_every_hand() {
    // Every fourth law side by side.
    let hold = |first| {
        LIMITS
            .iter()
            .skip(first)
            .step_by(4)
            .flat_map(|limit| broken(limit, &measured(limit.law)))
    };
    let broken: Vec<String> = std::thread::scope(|scope| {
        let parts: Vec<_> = (0..4)
            .map(|first| scope.spawn(move || hold(first).collect::<Vec<_>>()))
            .collect();
        parts
            .into_iter()
            .flat_map(|part| part.join().expect("valid scenes"))
            .collect()
    });
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn a_law_that_is_off_breaks_its_limits() {
    let law = "viscous";
    let all = measured(law);
    let limit = LIMITS.iter().find(|limit| limit.law == law).expect("a row");
    assert_eq!(broken(limit, &all), [""; 0]);
    let on_device = all.iter().position(LawMeasurement::is_on_device).expect("one");
    for (place, error_n) in [(0, 1e-3), (0, f64::NAN), (on_device, f64::INFINITY)] {
        let mut off = all.clone();
        (off[place].errors.worst_n, off[place].errors.median_n) = (error_n, error_n);
        assert!(!broken(limit, &off).is_empty(), "{error_n} N");
    }
}

#[test]
fn every_law_has_limits() {
    let judged = hands::laws_under_hands();
    for law in LAWS {
        assert!(
            judged.iter().any(|(_, friction)| friction.law() == law),
            "{law} is not judged"
        );
    }
    let laws: Vec<&str> = judged.into_iter().map(|(name, _)| name).collect();
    let limited: Vec<&str> = LIMITS.iter().map(|limit| limit.law).collect();
    assert_eq!(laws, limited);
}
