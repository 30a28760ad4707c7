//! The figures that every law is held to under the hands, from their measurements.

use super::by_law::{ForceErrors, LawMeasurement, worst_of};
use super::hands::{is_curved, laws_under_hands, single_ticks};
use super::targets::{Target, target};
use super::{compare, reference};
use crate::simulate::simulate;
use haptic_core::{SceneError, Scheme};

/// A cost, its hand and mass (kg), and for each law the most that it may be, us.
struct CostTarget {
    what: &'static str,
    law: &'static str,
    to_be: &'static str,
    most_us: f64,
}

const fn cost(what: &'static str, law: &'static str, to_be: &'static str, most_us: f64) -> CostTarget {
    CostTarget {
        what,
        law,
        to_be,
        most_us,
    }
}

/// Median ticks of a hand at 60 Hz behind 0.5 kg.
const MEDIAN_TICKS: [CostTarget; 5] = [
    cost(
        "median tick, 60 Hz, 0.5 kg: Stribeck",
        "karnopp, Stribeck",
        "<= 0.15 us",
        0.15,
    ),
    cost("median tick, 60 Hz, 0.5 kg: Dahl, i = 1", "dahl", "<= 0.45 us", 0.45),
    cost("median tick, 60 Hz, 0.5 kg: LuGre", "lugre", "<= 0.6 us", 0.6),
    cost(
        "median tick, 60 Hz, 0.5 kg: Hayward-Armstrong",
        "hayward-armstrong",
        "<= 0.45 us",
        0.45,
    ),
    cost(
        "median tick, 60 Hz, 0.5 kg: elasto-plastic",
        "elasto-plastic",
        "<= 1.2 us",
        1.2,
    ),
];

/// Dearest ticks of a hand at 437 Hz behind 10 g.
const DEAREST_TICKS: [CostTarget; 5] = [
    cost(
        "dearest tick, 437 Hz, 10 g: Stribeck",
        "karnopp, Stribeck",
        "<= 8 us",
        8.0,
    ),
    cost("dearest tick, 437 Hz, 10 g: Dahl, i = 1", "dahl", "<= 8 us", 8.0),
    cost("dearest tick, 437 Hz, 10 g: LuGre", "lugre", "<= 10 us", 10.0),
    cost(
        "dearest tick, 437 Hz, 10 g: Hayward-Armstrong",
        "hayward-armstrong",
        "<= 22 us",
        22.0,
    ),
    cost(
        "dearest tick, 437 Hz, 10 g: elasto-plastic",
        "elasto-plastic",
        "<= 20 us",
        20.0,
    ),
];

/// Median ticks on the device itself under a hand at 60 Hz, most of which hold no turn.
const DEVICE_TICKS: [CostTarget; 2] = [
    cost(
        "median tick on the device: Hayward-Armstrong",
        "hayward-armstrong",
        "<= 25 ns",
        0.025,
    ),
    cost(
        "median tick on the device: elasto-plastic, Fs = Fd",
        "elasto-plastic, Fs = Fd",
        "<= 25 ns",
        0.025,
    ),
];

/// Random ticks of each curved law of which those at their bound are counted.
const TICKS_TO_COUNT: usize = 25_000;
/// Most of these that are held against the reference.
const AT_BOUND_JUDGED: usize = 100;

/// Every target of the laws under the hands. `karnopp_instructions` are those a tick of the scene
/// "Karnopp behind a block".
///
/// # Errors
/// Never in practice: the scenes are valid.
pub fn curve_targets(
    measurements: &[LawMeasurement],
    karnopp_instructions: Option<f64>,
) -> Result<Vec<Target>, SceneError> {
    let mut targets = error_targets(measurements);
    targets.push(lists(exact(measurements, false)));
    targets.extend(cost_targets(measurements));
    karnopp(&mut targets, exact(measurements, false), karnopp_instructions);
    at_bound(&mut targets)?;
    Ok(targets)
}

/// The measurements with the exact scheme, on the device or behind a block.
fn exact(measurements: &[LawMeasurement], on_device: bool) -> impl Iterator<Item = &LawMeasurement> + Clone {
    measurements
        .iter()
        .filter(move |one| one.scheme == Scheme::Exact && one.is_on_device() == on_device)
}

/// What the forces may be off by.
fn error_targets(measurements: &[LawMeasurement]) -> Vec<Target> {
    let curved: Vec<&str> = laws_under_hands()
        .iter()
        .filter(|(_, law)| is_curved(law))
        .map(|(name, _)| *name)
        .collect();
    let [behind, device] =
        [false, true].map(|on_device| worst_of(exact(measurements, on_device).filter(|one| curved.contains(&one.law))));
    let uncertainty_n = worst_of(measurements).uncertainty_n;
    vec![
        target(
            "the reference's own error, all laws, hands and masses",
            "<= 1e-12 N",
            uncertainty_n <= 1e-12,
            format!("{uncertainty_n:.0e} N"),
        ),
        target(
            "force error, curved laws behind a block",
            "<= 1e-9 N",
            behind.worst_n <= 1e-9,
            format!("{:.0e} N", behind.worst_n),
        ),
        target(
            "its median, the worst run's",
            "<= 1e-11 N",
            behind.median_n <= 1e-11,
            format!("{:.0e} N", behind.median_n),
        ),
        target(
            "force error, curved laws on the device",
            "<= 1e-10 N",
            device.worst_n <= 1e-10,
            format!("{:.0e} N", device.worst_n),
        ),
        target(
            "ticks at their bound under the hands, their worst error",
            "-",
            true,
            at_bound_text(&behind),
        ),
    ]
}

/// What the ticks may cost.
fn cost_targets(measurements: &[LawMeasurement]) -> Vec<Target> {
    let medians = MEDIAN_TICKS
        .iter()
        .map(|wanted| median_tick(wanted, exact(measurements, false), Some(0.5)));
    let dearest = DEAREST_TICKS.iter().map(|wanted| {
        let us = exact(measurements, false)
            .find(|one| one.law == wanted.law && one.hand == "437 Hz" && one.mass_kg == Some(0.01))
            .and_then(|one| one.cost)
            .map_or(f64::NAN, |cost| cost.dearest_ns * 1e-3);
        target(wanted.what, wanted.to_be, us <= wanted.most_us, format!("{us:.1} us"))
    });
    let device = DEVICE_TICKS.iter().map(|wanted| {
        let mut row = median_tick(wanted, exact(measurements, true), None);
        row.measured = nanoseconds(&row.measured);
        row
    });
    medians.chain(dearest).chain(device).collect()
}

fn nanoseconds(us: &str) -> String {
    let us: f64 = us.trim_end_matches(" us").parse().unwrap_or(f64::NAN);
    format!("{:.0} ns", us * 1e3)
}

fn at_bound_text(errors: &ForceErrors) -> String {
    if errors.at_bound == 0 {
        "none".to_owned()
    } else {
        format!("{}, {:.0e} N", errors.at_bound, errors.at_bound_worst_n)
    }
}

fn lists<'a>(exact: impl Iterator<Item = &'a LawMeasurement>) -> Target {
    let judged: Vec<bool> = exact.filter_map(|one| one.errors.same_changes).collect();
    let same = judged.iter().filter(|same| **same).count();
    target(
        "stops and breakaways, laws with a stuck state",
        "equal to the reference",
        same == judged.len(),
        format!("{same} of {} runs", judged.len()),
    )
}

fn median_tick<'a>(
    wanted: &CostTarget,
    mut exact: impl Iterator<Item = &'a LawMeasurement>,
    mass_kg: Option<f64>,
) -> Target {
    let us = exact
        .find(|one| one.law == wanted.law && one.hand == "60 Hz" && one.mass_kg == mass_kg)
        .and_then(|one| one.cost)
        .map_or(f64::NAN, |cost| cost.median_ns * 1e-3);
    target(wanted.what, wanted.to_be, us <= wanted.most_us, format!("{us:.3} us"))
}

/// Karnopp's law must not pay for the others.
fn karnopp<'a>(
    targets: &mut Vec<Target>,
    exact: impl Iterator<Item = &'a LawMeasurement> + Clone,
    instructions: Option<f64>,
) {
    let of_karnopp = exact.filter(|one| one.law == "karnopp");
    let worst_n = worst_of(of_karnopp.clone()).worst_n;
    targets.push(target(
        "Karnopp's force error under the hands",
        "<= 5e-11 N",
        worst_n <= 5e-11,
        format!("{worst_n:.0e} N"),
    ));
    let ns = of_karnopp
        .filter(|one| one.hand == "60 Hz" && one.mass_kg == Some(0.5))
        .find_map(|one| one.cost)
        .map_or(f64::NAN, |cost| cost.median_ns);
    targets.push(target(
        "Karnopp's median tick, 60 Hz, 0.5 kg",
        "<= 32 ns",
        ns <= 32.0,
        format!("{ns:.0} ns"),
    ));
    if let Some(count) = instructions {
        targets.push(target(
            "Karnopp's instructions a tick",
            "<= 266",
            count <= 266.5,
            format!("{count:.0}"),
        ));
    }
}

/// How many ticks of random scenes with blocks of 1 g and more come to their bound, and how wrong
/// they are.
fn at_bound(targets: &mut Vec<Target>) -> Result<(), SceneError> {
    let (mut ticks, mut exhausted, mut worst_n) = (0_u32, 0_u32, 0.0_f64);
    let mut judged = 0;
    for (_, law) in laws_under_hands().into_iter().filter(|(_, law)| is_curved(law)) {
        for tick in single_ticks(law).take(TICKS_TO_COUNT) {
            let run = simulate(&tick.scene, Scheme::Exact, &tick.motion, tick.start)?;
            ticks += 1;
            if run.exhausted_ticks > 0 {
                exhausted += 1;
                if judged < AT_BOUND_JUDGED {
                    judged += 1;
                    let truth = reference::solve(&tick.scene, &tick.motion, tick.start);
                    worst_n = worst_n.max(compare(&run, &truth, 0.0).force_n);
                }
            }
        }
    }
    let in_1e5 = f64::from(exhausted) / f64::from(ticks) * 1e5;
    targets.push(target(
        "random ticks at their bound, curved laws, 1 g and more",
        "<= 1 in 1e5, error stated",
        in_1e5 <= 1.0,
        if exhausted == 0 {
            format!("0 of {ticks}")
        } else {
            format!("{in_1e5:.1} in 1e5, {worst_n:.0e} N at worst")
        },
    ));
    Ok(())
}
