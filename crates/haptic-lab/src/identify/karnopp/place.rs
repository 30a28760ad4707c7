//! A force that depends on the place, as of a spring, of cogging or of an uneven surface: looked for in what the fit
//! leaves, and fitted with it where it is there.
//!
//! It is a sum of hats, each a straight rise to its place and a straight fall from there.
//!
//! Backlash between the encoder and the mass is looked for where the force between them changes its sign, which is
//! where the mass crosses the gap. The fit is made once more without the windows in which the force that it predicts
//! comes near to zero. The measured force would choose by its noise.

use super::problem::{CALIBRATION_SHARE, Problem, Slides};
use super::regression::{Fit, OVERLAPPING, Rows, Shape, Unknown};
use crate::identify::result::Identified;
use crate::robust_fit;
use crate::robust_fit::Uncertainty;
use crate::smoothing::{weighted, whole};
use haptic_motion::median::{at_share, extent};
use nalgebra::DMatrix;

/// Times its noise that a fit must leave before a force of the place is looked for: records without one leave 1.03 to
/// 1.07 times.
const EXCESS: f64 = 1.15;

/// Distance of two hats, m, and how many there may be.
const HAT_M: f64 = 1.25e-3;
const MIN_HATS: f64 = 8.0;
const MAX_HATS: f64 = 33.0;

/// A force of the place is there where the fit with it leaves less than this share, its unknowns counted.
const MAX_LEFT: f64 = 0.93;

/// A window that averages over several periods of cogging does not show it: one shorter by this is tried as well.
const SHORTER: f64 = 2.9;

/// Steps of the encoder in a slide between steps of the force, below which intervals become too narrow: records with
/// 200 to 400 held in 84 to 97 of 100, those with 1200 and more in 94 to 98.
const MIN_SLIDE_STEPS: f64 = 600.0;

/// Least share of the acceleration's variance that the place may leave for the mass to be distinguished from a spring.
pub(super) const MIN_MASS_SHARE: f64 = 0.03;

/// The slides with a force of the place in the fit, where it is certain, or where what is left shows one.
pub(super) fn explained(problem: &Problem<'_>, slides: Slides, found: &mut Identified) -> Slides {
    let with_spring = with_hats(problem, &slides.rows, slides.fit.shape, 1).filter(|sprung| {
        let height = sprung.value(Unknown::Place(0)).unwrap_or(0.0);
        let of = sprung.uncertainty_of(Unknown::Place(0));
        let level = sprung.value(Unknown::Level(0)).unwrap_or(0.0);
        // Under one frequency whatever the law lacks would look like one. In a record without noise less than a
        // calibration's share is certain, too.
        share_of_mass(&slides.rows, sprung) >= MIN_MASS_SHARE
            && of.is_some_and(|of| height.abs() > of.reach_certain().max(CALIBRATION_SHARE * level.abs()))
    });
    let is_sprung = with_spring.is_some();
    let slides = match with_spring {
        Some(fit) => Slides::of(problem, slides.rows, fit),
        None => slides,
    };
    let (slides, is_uneven) = match uneven(problem, &slides) {
        Some((rows, fit)) => (Slides::of(problem, rows, fit), true),
        None => (slides, false),
    };
    if is_sprung || is_uneven {
        let heights = (0..slides.fit.shape.hats).filter_map(|hat| slides.fit.value(Unknown::Place(hat)));
        // The lowest one is 0.
        let (least, greatest) = extent(heights.chain([0.0]));
        let like = if is_uneven {
            "of a spring, of cogging or of an uneven surface"
        } else {
            "of a spring"
        };
        // Of the same rows: shorter windows average less noise.
        let plain = with_hats(problem, &slides.rows, slides.fit.shape, 0);
        let without = plain.map_or_else(String::new, |plain| format!(", {:.3} N without", plain.rms_n()));
        found.notes.push(format!(
            "the force depends on the place, by {:.2} N over the travel, as that {like}: it is fitted and left out \
             ({:.3} N are left with it{without})",
            greatest - least,
            slides.fit.rms_n()
        ));
    }
    slides
}

/// Share of the acceleration's variance that the place, and all else, leaves to the mass; 1 where that is known.
pub(super) fn share_of_mass(rows: &Rows, fit: &Fit) -> f64 {
    let own = fit.own_variance(Unknown::Mass);
    own.map_or(1.0, |own| own / rows.acceleration_rms().powi(2))
}

/// The fit with hats over the travel; one of them is a spring.
fn with_hats(problem: &Problem<'_>, rows: &Rows, shape: Shape, hats: usize) -> Option<Fit> {
    problem.fit(rows, Shape { hats, ..shape }).ok()
}

/// The fit with a force of the place of any form, where what is left without it is more than noise, and less with it.
fn uneven(problem: &Problem<'_>, slides: &Slides) -> Option<(Rows, Fit)> {
    let shape = slides.fit.shape;
    let shorter = problem.rows(slides.rows.half_s / SHORTER);
    let shorter = problem.fit(&shorter, shape).ok().map(|fit| (shorter, fit));
    let all = || std::iter::once((&slides.rows, &slides.fit)).chain(shorter.iter().map(|(rows, fit)| (rows, fit)));
    if all().all(|(rows, fit)| problem.excess(rows, fit) <= EXCESS) {
        return None;
    }
    let (low, high) = extent(problem.grid.position_m.iter().copied());
    let hats = ((high - low) / HAT_M).round().clamp(MIN_HATS, MAX_HATS);
    all().find_map(|(plain_rows, plain)| {
        let rows = plain_rows.rows.len() as f64 / OVERLAPPING;
        let placed = (rows > 2.0 * hats)
            .then(|| with_hats(problem, plain_rows, shape, whole(hats)))
            .flatten()?;
        let left = placed.rms_n() / (1.0 - hats / rows).max(0.1).sqrt();
        (left < MAX_LEFT * plain.rms_n()).then(|| (plain_rows.clone(), placed))
    })
}

/// Says what is assumed where the motion hardly shows it.
pub(super) fn note_assumptions(problem: &Problem<'_>, slides: &Slides, found: &mut Identified) {
    if found.mass_kg.is_none() || slides.fit.value(Unknown::Mass).is_none() || slides.fit.shape.hats > 0 {
        return;
    }
    // Under one frequency a spring and a mass give the same force.
    if let Some(stiffness_to_mass) = one_frequency(problem, &slides.rows) {
        found.notes.push(format!(
            "the motion has one frequency, {:.2} Hz, where a spring looks like less mass: each 10 N/m along the way \
             would take {:.3} kg away. It is taken that there is none; two frequencies, or a chirp, tell them apart",
            stiffness_to_mass.sqrt() / std::f64::consts::TAU,
            10.0 / stiffness_to_mass
        ));
    } else if problem.share_of_steps().is_some() {
        found.notes.push(
            "cogging, or another force that depends on the place, hardly shows in slides between steps of the force: it is \
             taken that there is none; a chirp shows it"
                .to_owned(),
        );
        let slide_m = problem.motion.slide_m(problem.grid.period_s);
        let steps = slide_m / problem.motion.step_m;
        if steps < MIN_SLIDE_STEPS {
            found.notes.push(format!(
                "a slide between steps of the force is {:.1} mm long, {steps:.0} steps of the encoder; below \
                 {MIN_SLIDE_STEPS:.0} its rounding does not average out, and the intervals may be too narrow. Longer strokes, \
                 or a chirp, help",
                1e3 * slide_m
            ));
        }
    }
}

/// The square of the motion's frequency, 1/s^2, where it has one alone: then acceleration follows from place and
/// velocity.
pub(super) fn one_frequency(problem: &Problem<'_>, rows: &Rows) -> Option<f64> {
    let x = &problem.grid.position_m;
    let design = DMatrix::from_fn(rows.rows.len(), 4, |i, j| {
        let row = &rows.rows[i];
        match j {
            0 => x[row.at] + weighted(&rows.window.mean, x, row.at, x[row.at]),
            1 => row.velocity,
            2 => row.sense,
            _ => 1.0,
        }
    });
    let accelerations: Vec<f64> = rows.rows.iter().map(|row| row.acceleration).collect();
    let parts = robust_fit::equal_parts(accelerations.len());
    let fit = robust_fit::fit(design, &accelerations, &[0.0; 4], &parts).ok()?;
    let variance = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    let stiffness_to_mass = -fit.values[0];
    (stiffness_to_mass > 0.0 && variance(&fit.residuals) < MIN_MASS_SHARE * variance(&accelerations))
        .then_some(stiffness_to_mass)
}

/// The predicted force has a sign beyond so many times what the fit leaves, and this share of the greater forces.
const LEFT: f64 = 4.0;
const SHARE: f64 = 0.1;

/// A second fit whose intervals are wider by this shows little, and nothing where they are wider by that.
const HARDLY_SHOWS: f64 = 1.5;
const MAX_LOSS: f64 = 3.0;

/// Standard errors of a difference between the two fits from which on it is reported.
const REPORTED_ERRORS: f64 = 4.0;

/// The slides with what backlash may have moved in their intervals, as far as the record can tell.
pub(super) fn look_for_backlash(problem: &Problem<'_>, mut slides: Slides, found: &mut Identified) -> Slides {
    let is_kept = keeps_its_sign(problem, &slides);
    if is_kept.iter().filter(|is_kept| !**is_kept).count() <= 3 {
        return slides;
    }
    let rows = slides.rows.kept(&is_kept);
    let second = problem.fit(&rows, slides.fit.shape).ok();
    let reach = |of: &Fit, unknown| of.uncertainty_of(unknown).map_or(f64::INFINITY, Uncertainty::reach_95);
    let loss = second.as_ref().map_or(f64::INFINITY, |second| {
        let losses = slides
            .unknowns()
            .map(|unknown| reach(second, unknown) / reach(&slides.fit, unknown));
        losses.fold(0.0, f64::max)
    });
    if loss > HARDLY_SHOWS {
        found.notes.push(
            "backlash between the encoder and the mass would hardly show in this motion, and it is taken that there is \
             none"
                .to_owned(),
        );
    }
    let Some(second) = second.filter(|_| loss <= MAX_LOSS) else {
        return slides;
    };
    let mut most = 0.0_f64;
    let mut by = Vec::new();
    for unknown in slides.unknowns() {
        let values = second.value(unknown).zip(slides.fit.value(unknown));
        let Some(((second_value, value), factors)) = values.zip(slides.fit.factors(&[(unknown, 1.0)])) else {
            continue;
        };
        let error = slides.fit.found.error_of_difference(&second.found, &factors);
        let difference = (second_value - value).abs();
        most = most.max(difference / error.max(f64::MIN_POSITIVE));
        by.push((unknown, difference));
    }
    slides.widen(by);
    if most > REPORTED_ERRORS {
        found.notes.push(format!(
            "where the force on the mass changes its sign the record differs, as with backlash between the encoder and \
             the mass: without {:.0} % of the windows the values differ by {most:.0} standard errors, which is in their \
             intervals",
            100.0 * (1.0 - rows.rows.len() as f64 / slides.rows.rows.len() as f64)
        ));
    }
    slides
}

/// Whether the predicted force has one sign throughout the window of each row.
fn keeps_its_sign(problem: &Problem<'_>, slides: &Slides) -> Vec<bool> {
    let (rows, motion) = (&slides.rows, problem.motion);
    let Rows { window, step, .. } = rows;
    let x = &problem.grid.position_m;
    let value = |unknown| slides.fit.value(unknown).unwrap_or(0.0);
    let mass = slides.fit.value(Unknown::Mass).unwrap_or(problem.known_mass);
    let is_separate = slides.fit.shape.is_separate;
    let predicted: Vec<f64> = (window.reach..problem.grid.len() - window.reach)
        .step_by(*step)
        .map(|at| {
            let side = usize::from(motion.sense[at] < 0);
            let level = match (is_separate, motion.sense[at]) {
                (true, _) => value(Unknown::Level(side)),
                (false, sense) => f64::from(sense) * value(Unknown::Level(0)) + value(Unknown::Level(1)),
            };
            let viscous = value(Unknown::Viscous(if is_separate { side } else { 0 }));
            mass * weighted(&window.curvature, x, at, x[at]) + viscous * weighted(&window.slope, x, at, x[at]) + level
        })
        .collect();
    let mut sizes: Vec<f64> = predicted.iter().map(|force| force.abs()).collect();
    let least = LEFT * slides.fit.rms_n() + SHARE * at_share(&mut sizes, 9, 10).unwrap_or(0.0);
    let sign = |force: f64| i8::from(force > least) - i8::from(force < -least);
    let around = window.reach.div_ceil(*step);
    rows.rows
        .iter()
        .map(|row| {
            let middle = (row.at - window.reach) / step;
            let window = &predicted[middle.saturating_sub(around)..(middle + around + 1).min(predicted.len())];
            sign(window[0]) != 0 && window.iter().all(|force| sign(*force) == sign(window[0]))
        })
        .collect()
}
