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

pub(super) use find::PreparedRecord;
pub(super) use fit::{Estimate, Fit};
pub(super) use laws::PathLaw;
pub(super) use path::Path;

use super::Left;
use super::bootstrap::{Spread, World};
use super::grid::Even;
use super::karnopp;
use super::karnopp::{ALIKE, CALIBRATION_SHARE, SAMPLING_SHARE};
use super::options::{Clocks, Directions, IdentifyError, Options, Progress, Record};
use super::result::{Identified, ModelKind, Refusal};
use fastrand::Rng;
use fit::Assumptions;
use quantity::Quantity;

/// Records that are drawn for the intervals.
const DRAWN: usize = 60;
/// Records that are drawn to see how much the sensors' noise leaves.
const DRAWN_FIRST: usize = 6;
/// A fit that leaves more than this, times what the sensors' noise leaves, lacks something.
const UNEXPLAINED: f64 = 1.1;
/// A fit that leaves less than this share of the force, rms, is near its best.
const NEAR: f64 = 0.1;
/// Most steps towards the shift of the clocks.
const ROUNDS: usize = 6;
/// The force's clock is ahead where the fit then leaves less than this share.
const BETTER_ON_A_CLOCK: f64 = 0.97;
/// A law that leaves more than this share of the force, rms, says nothing of the record.
const MAX_UNEXPLAINED: f64 = 0.5;

/// Share of the time in which the law is fitted to the record itself, before records are drawn.
const FIT_SHARE: f64 = 0.3;

/// The best fit of a law to a record.
pub(super) struct Found {
    pub(super) prepared: PreparedRecord,
    fit: Fit,
    assumed: Assumptions,
    shift_s: f64,
}

/// Why there is none, and what to record instead.
type NoFit = (String, &'static str);

/// Identifies Dahl's law or LuGre's.
///
/// # Errors
/// The caller cancels.
pub(super) fn identify(
    even: &Even,
    options: &Options,
    progress: &mut Progress<'_>,
) -> Result<(Identified, Left), IdentifyError> {
    let law = if options.model == ModelKind::Lugre {
        PathLaw::Lugre
    } else {
        PathLaw::Dahl
    };
    match find(even, law, options) {
        Ok(best) => {
            let found = report(&best, options, &mut progress.part(FIT_SHARE, 1.0))?;
            let rows = &best.prepared.rows;
            let residual = best.fit.residual.iter().enumerate();
            let left = Left {
                residual: residual.map(|(row, left)| (rows.middle(row), *left)).collect(),
                path: Some(best.prepared.path),
            };
            Ok((found, left))
        }
        Err((reason, instead)) => {
            let assumed = Assumptions::of(options, true);
            let mut found = Identified::empty(options.model);
            for quantity in Quantity::of(law, &assumed) {
                found.refuse(Refusal::new(quantity.parameter(), &reason, instead));
            }
            Ok((found, Left::default()))
        }
    }
}

/// The best fit of a law, on whichever clock it is better: the common one, or the one on which the slides agree best.
pub(super) fn find(even: &Even, law: PathLaw, options: &Options) -> Result<Found, NoFit> {
    if let Clocks::Shifted(shift_s) = options.clocks {
        return find_on(even, shift_s, law, options);
    }
    let common = find_on(even, 0.0, law, options);
    let Some(shift_s) = shift_s(even, common.as_ref().ok(), options) else {
        return common;
    };
    match (common, find_on(even, shift_s, law, options)) {
        (Ok(common), Ok(shifted)) if shifted.fit.rms_n < BETTER_ON_A_CLOCK * common.fit.rms_n => Ok(shifted),
        (Err(_), Ok(shifted)) => Ok(shifted),
        (common, _) => common,
    }
}

/// How much the force's clock is ahead of the position's, s; `None` where that is less than a sample. A fit on one
/// clock that leaves little is near enough to begin from; else the slides say where to begin, which take the distance
/// by which a surface gives for a part of the shift.
fn shift_s(even: &Even, common: Option<&Found>, options: &Options) -> Option<f64> {
    let longest_s = options.clocks.longest_shift_s();
    if longest_s <= 0.0 {
        return None;
    }
    let near = common.filter(|found| found.fit.rms_n < NEAR * found.prepared.rows.force_rms());
    let mut estimate = near.map(|found| found.fit.estimate.clone());
    let mut shift_s = 0.0;
    if near.is_none() {
        shift_s = karnopp::rough_shift(even, options)?;
    }
    for _ in 0..ROUNDS {
        let prepared = PreparedRecord::new(even, shift_s, options)?;
        let further = prepared.further_shift(estimate.as_ref(), options)?;
        let further_s = further.shift_s;
        shift_s = (shift_s + further_s).clamp(-longest_s, longest_s);
        if shift_s.abs() < prepared.path.period_s && near.is_some() {
            return None;
        }
        if further_s.abs() < 0.05 * prepared.path.period_s {
            break;
        }
        estimate = Some(Estimate {
            shift_s: 0.0,
            ..further
        });
    }
    Some(shift_s)
}

/// The best fit of a law where the force's clock is ahead.
fn find_on(even: &Even, shift_s: f64, law: PathLaw, options: &Options) -> Result<Found, NoFit> {
    let mut prepared = PreparedRecord::new(even, shift_s, options).ok_or_else(|| {
        let reason = String::from("the position hardly changes");
        (reason, "record strokes of 10 mm and more, for at least ten seconds")
    })?;
    let rough = prepared.find(law, &prepared.all(), options, None).map(|(fit, _)| fit);
    if let Some(fit) = &rough {
        prepared.weigh(fit);
    }
    let weighed = rough.and_then(|rough| prepared.find(law, &prepared.all(), options, Some(&rough)));
    let (fit, assumed) = weighed.ok_or_else(|| {
        let reason = String::from("no values of the law come near the record");
        (reason, "check that force and position belong together")
    })?;
    let share = fit.rms_n / prepared.rows.force_rms();
    // One way, the force hardly changes, and there is nothing to explain.
    if share > MAX_UNEXPLAINED && !refusal::goes_one_way(&prepared) {
        return Err((
            format!("the law leaves {:.0} % of the force unexplained", 100.0 * share),
            "a surface that deflects before it slides, or identify karnopp; and check that force and position belong \
             together, and that nothing else pushes the mass",
        ));
    }
    // One way, there is no turn that could show it.
    let hidden = refusal::hidden(refusal::MIN_STEPS, &prepared, &fit.estimate);
    if let Some(reason) = hidden.filter(|_| !refusal::goes_one_way(&prepared)) {
        return Err((
            reason,
            "identify karnopp, or record with an encoder whose step is a tenth of that or finer",
        ));
    }
    Ok(Found {
        prepared,
        fit,
        assumed,
        shift_s,
    })
}

/// Intervals, what is refused, and what remains.
fn report(best: &Found, options: &Options, progress: &mut Progress<'_>) -> Result<Identified, IdentifyError> {
    let Found {
        prepared, fit, assumed, ..
    } = best;
    let estimate = &fit.estimate;
    let mut found = without_values(best, options);
    for refusal in refusal::by_physics(prepared, estimate, assumed) {
        found.refuse(refusal);
    }
    let quantities = Quantity::of(estimate.law, assumed);
    let truth: Vec<f64> = quantities.iter().map(|quantity| quantity.value(estimate)).collect();
    let (world, noise_rms) = world(prepared, fit, assumed, options.seed);
    let mut random = Rng::with_seed(options.seed);
    let mut estimates: Vec<Vec<f64>> = Vec::with_capacity(DRAWN);
    for drawn in 0..DRAWN {
        progress.at(drawn as f64 / DRAWN as f64)?;
        let fit = prepared.refit(&world.draw(&mut random), assumed, estimate);
        estimates.extend(fit.map(|fit| {
            quantities
                .iter()
                .map(|quantity| quantity.value(&fit.estimate))
                .collect()
        }));
    }
    let Some(spread) = Spread::of(&truth, &estimates) else {
        let reason = format!(
            "of {DRAWN} records drawn from the fit, {} could be fitted",
            estimates.len()
        );
        let instead = "record strokes of 10 mm and more in both directions, slow and fast";
        for quantity in quantities {
            found.refuse(Refusal::new(quantity.parameter(), &reason, instead));
        }
        return Ok(found);
    };
    if fit.weighted_rms > UNEXPLAINED * noise_rms {
        found.notes.push(format!(
            "the fit leaves {:.2} times what white noise and the encoder explain: the law lacks something, or the \
             noise is slow",
            fit.weighted_rms / noise_rms
        ));
    }
    for (at, quantity) in quantities.iter().enumerate() {
        store_or_refuse(&mut found, best, *quantity, truth[at], (&spread, at));
    }
    // Static friction is the upper end of Stribeck's fall, and is undetermined if the fall was not recorded.
    let fall = found
        .refused
        .iter()
        .find(|refusal| refusal.parameter == Quantity::Stribeck.parameter());
    if let Some(Refusal { reason, instead, .. }) = fall.cloned() {
        found.refuse(Refusal::new(Quantity::Static(0).parameter(), &reason, &instead));
    }
    Ok(found)
}

/// What is reported of a fit besides its values.
fn without_values(best: &Found, options: &Options) -> Identified {
    let mut found = Identified::empty(options.model);
    found.notes.clone_from(&best.prepared.path.notes);
    found.shift_s = best.shift_s;
    if best.shift_s != 0.0 {
        found.notes.push(format!(
            "the force's clock is {:.2} ms ahead of the position's: aligned",
            best.shift_s * 1e3
        ));
    }
    found.offset_n = options.offset_n;
    found.residual_rms_n = best.fit.rms_n;
    found.residual_window_s = Some(best.prepared.rows.window_s());
    found.mass_kg = options.mass_kg;
    if best.assumed.alike && options.directions == Directions::Auto && options.offset_n.is_none() {
        found.notes.push(ALIKE.to_owned());
    }
    found
}

/// Stores a quantity with its interval in the result, or refuses it: the value of the fit, and its place in the spread
/// of those of drawn records.
fn store_or_refuse(
    found: &mut Identified,
    best: &Found,
    quantity: Quantity,
    truth: f64,
    (spread, at): (&Spread, usize),
) {
    let (value, [low, high]) = spread.interval(at, truth);
    let share = if quantity == Quantity::Mass {
        SAMPLING_SHARE
    } else {
        CALIBRATION_SHARE
    };
    // Drawn records know nothing of what sampling and calibration do to real ones.
    let [low, high] = [low, high].map(|end| quantity.itself(end));
    let interval = [low - share * low.abs(), high + share * high.abs()];
    if let Some(refusal) = refusal::by_interval(quantity, interval, &best.prepared, &best.fit.estimate) {
        found.refuse(refusal);
    }
    if spread.bias[at].abs() > spread.deviation[at] {
        found.notes.push(format!(
            "{}: a bias of {:+.2} % was seen in drawn records and taken out",
            quantity.interval(),
            100.0 * (quantity.itself(truth) / quantity.itself(value) - 1.0)
        ));
    }
    let is_refused = |refusal: &Refusal| refusal.parameter == quantity.parameter();
    if !found.refused.iter().any(is_refused) {
        quantity.store(quantity.itself(value), found);
        found.intervals.insert(quantity.interval(), interval);
    }
}

/// What the fit says happened, with what it leaves, and how much the sensors' noise alone leaves, N rms.
fn world(prepared: &PreparedRecord, fit: &Fit, assumed: &Assumptions, seed: u64) -> (World, f64) {
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

#[cfg(test)]
mod tests;
