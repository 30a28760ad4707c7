//! Laws that give way before they slide, Dahl's and LuGre: least squares of the force along the path.
//!
//! ```text
//! record -> path (even clock, steps smoothed) -> rows (test functions) -> fit -> refused by physics
//!                                                                          -> drawn records -> intervals
//! ```

mod adaptive;
mod errors;
mod find;
mod fit;
mod laws;
mod path;
mod quantity;
mod refusal;
mod weak;

pub(super) use find::Prepared;
pub(super) use fit::Fit;
pub(super) use laws::PathLaw;

use super::bootstrap::{Spread, World};
use super::{Identified, ModelKind, Options, Record, Refusal};
use fastrand::Rng;
use fit::Assumed;
use quantity::Quantity;

/// Records that are drawn for the intervals.
const DRAWN: usize = 100;
/// Records that are drawn to see how much the sensors' noise leaves.
const DRAWN_FIRST: usize = 6;
/// A fit that leaves more than this, times what the sensors' noise leaves, lacks something.
const UNEXPLAINED: f64 = 1.1;
/// A law that leaves more than this share of the force, rms, says nothing of the record.
const MOST_UNEXPLAINED: f64 = 0.5;

/// Identifies Dahl's law or LuGre's from a record that was checked.
pub(super) fn identify(record: &Record, options: &Options) -> Identified {
    let law = if options.model == ModelKind::Lugre {
        PathLaw::Lugre
    } else {
        PathLaw::Dahl
    };
    let nothing = |reason: &str, instead: &str| {
        let assumed = Assumed {
            mass_kg: options.mass_kg,
            offset_n: options.offset_n,
            alike: true,
        };
        let mut found = Identified::empty(options.model);
        for quantity in Quantity::of(law, &assumed) {
            refuse(
                &mut found,
                Refusal {
                    parameter: quantity.parameter().to_owned(),
                    reason: reason.to_owned(),
                    instead: instead.to_owned(),
                },
            );
        }
        found
    };
    let Some(mut prepared) = Prepared::new(record, options) else {
        return nothing(
            "the position hardly changes",
            "record strokes of 10 mm and more, for at least ten seconds",
        );
    };
    let first = prepared.find(law, &prepared.all(), options);
    if let Some((fit, _)) = &first {
        prepared.weigh(fit);
    }
    let Some((fit, assumed)) = first.and_then(|_| prepared.find(law, &prepared.all(), options)) else {
        return nothing(
            "no values of the law come near the record",
            "check that force and position belong together",
        );
    };
    let share = fit.rms_n / prepared.rows.force_rms();
    if share > MOST_UNEXPLAINED {
        return nothing(
            &format!("the law leaves {:.0} % of the force unexplained", 100.0 * share),
            "check that force and position belong together, and that nothing else pushes the mass",
        );
    }
    report(&prepared, &fit, &assumed, options)
}

/// Intervals, what is refused, and what remains.
fn report(prepared: &Prepared, fit: &Fit, assumed: &Assumed, options: &Options) -> Identified {
    let estimate = &fit.estimate;
    let mut found = Identified::empty(options.model);
    found.residual_rms_n = fit.rms_n;
    found.mass_kg = assumed.mass_kg;
    for refusal in refusal::by_physics(prepared, estimate, assumed) {
        refuse(&mut found, refusal);
    }
    let quantities = Quantity::of(estimate.law, assumed);
    let truth: Vec<f64> = quantities.iter().map(|quantity| quantity.value(estimate)).collect();
    let (world, noise_rms) = world(prepared, fit, assumed, options.seed);
    let mut random = Rng::with_seed(options.seed);
    let estimates: Vec<Vec<f64>> = (0..DRAWN)
        .filter_map(|_| prepared.refit(&world.draw(&mut random), assumed, estimate))
        .map(|fit| {
            quantities
                .iter()
                .map(|quantity| quantity.value(&fit.estimate))
                .collect()
        })
        .collect();
    let Some(spread) = Spread::of(&truth, &estimates) else {
        for quantity in quantities {
            refuse(
                &mut found,
                Refusal {
                    parameter: quantity.parameter().to_owned(),
                    reason: format!(
                        "of {DRAWN} records drawn from the fit, {} could be fitted",
                        estimates.len()
                    ),
                    instead: String::from("record strokes of 10 mm and more in both directions, slow and fast"),
                },
            );
        }
        return found;
    };
    let explained = fit.weighted_rms <= UNEXPLAINED * noise_rms;
    if !explained {
        found.notes.push(format!(
            "the fit leaves {:.2} times what white noise and the encoder explain: the law lacks something, or the noise is slow",
            fit.weighted_rms / noise_rms
        ));
    }
    for (at, quantity) in quantities.iter().enumerate() {
        let (value, [low, high]) = spread.interval(at, truth[at]);
        let interval = [low, high].map(|end| quantity.itself(end));
        if let Some(refusal) = refusal::by_interval(*quantity, interval, prepared, estimate) {
            refuse(&mut found, refusal);
        }
        if spread.bias[at].abs() > spread.deviation[at] {
            found.notes.push(format!(
                "{}: a bias of {:+.2} % was seen in drawn records and taken out",
                quantity.interval(),
                100.0 * (quantity.itself(truth[at]) / quantity.itself(value) - 1.0)
            ));
        }
        if found
            .refused
            .iter()
            .all(|refusal| refusal.parameter != quantity.parameter())
        {
            quantity.put(quantity.itself(value), &mut found);
            found.intervals.insert(quantity.interval(), interval);
        }
    }
    found
}

/// Refuses a parameter, once, and takes out what was found of it in the other direction.
fn refuse(found: &mut Identified, refusal: Refusal) {
    if found.refused.iter().any(|other| other.parameter == refusal.parameter) {
        return;
    }
    match refusal.parameter.as_str() {
        "dynamic_force_N" => found.dynamic_force_n = None,
        "viscous_Ns_per_m" => found.viscous_ns_per_m = None,
        "static_force_N" => found.static_force_n = None,
        _ => (),
    }
    found
        .intervals
        .retain(|name, _| name.split('.').next() != Some(&refusal.parameter));
    found.refused.push(refusal);
}

/// What the fit says happened, with what it leaves, and how much the sensors' noise alone leaves, N rms.
fn world(prepared: &Prepared, fit: &Fit, assumed: &Assumed, seed: u64) -> (World, f64) {
    let path = &prepared.path;
    let motion = Record {
        t_s: (0..path.smooth_m.len())
            .map(|sample| sample as f64 * path.period_s)
            .collect(),
        position_m: path.smooth_m.clone(),
        force_n: fit.estimate.force(path, &path.accelerations()),
        ..Record::default()
    };
    let mut world = World {
        motion,
        resolution_m: path.resolution_m,
        white_rms_n: prepared.white_rms_n,
        residual_n: prepared.rows.at_samples(&fit.residual, path.smooth_m.len()),
        share: 0.0,
    };
    let mut random = Rng::with_seed(seed ^ 0x5eed);
    let left: Vec<f64> = (0..DRAWN_FIRST)
        .filter_map(|_| prepared.refit(&world.draw(&mut random), assumed, &fit.estimate))
        .map(|drawn| drawn.weighted_rms * drawn.weighted_rms)
        .collect();
    let noise_square = left.iter().sum::<f64>() / left.len().max(1) as f64;
    world.share = (1.0 - noise_square / (fit.weighted_rms * fit.weighted_rms))
        .max(0.0)
        .sqrt();
    (world, noise_square.sqrt())
}
