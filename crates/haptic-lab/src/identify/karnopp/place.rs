//! A force that depends on the place, as of a spring, of cogging or of an uneven surface: looked for in what the fit
//! leaves, and fitted with it where it is there.
//!
//! It is a sum of hats, each a straight rise to its place and a straight fall from there.

use super::problem::Problem;
use super::regression::{Rows, Shape, Unknown};
use super::slides::Slides;
use crate::identify::result::Identified;
use crate::median::extent;
use crate::robust_fit;
use crate::smoothing::{weighted, whole};
use nalgebra::DMatrix;

/// Times its noise that a fit must leave before a force of the place is looked for: records without one leave 1.03 to
/// 1.07 times.
const EXCESS: f64 = 1.15;

/// Distance of two hats, m, and how many there may be.
const HAT_M: f64 = 1.25e-3;
const FEWEST_HATS: f64 = 8.0;
const MOST_HATS: f64 = 33.0;

/// A force of the place is there where the fit with it leaves less than this share, its unknowns counted.
const LARGEST_LEFT: f64 = 0.93;

/// A window that averages over several periods of cogging does not show it: one shorter by this is tried as well.
const SHORTER: f64 = 2.9;

/// Rows that overlap, for each one that does not.
const OVERLAPPING: f64 = 3.0;

/// Share of the acceleration's variance that the place may leave, at least, for the mass to be told from a spring.
pub(super) const LEAST_MASS_SHARE: f64 = 0.03;

/// The slides with a force of the place in the fit, where what is left shows one.
pub(super) fn explained(problem: &Problem<'_>, slides: Slides, found: &mut Identified) -> Slides {
    let shape = slides.fit.shape;
    let shorter = Rows::new(problem.grid, problem.motion, slides.rows.half_s / SHORTER);
    let shorter = problem.fit(&shorter, shape).ok().map(|fit| (shorter, fit));
    let all = || std::iter::once((&slides.rows, &slides.fit)).chain(shorter.iter().map(|(rows, fit)| (rows, fit)));
    if all().all(|(rows, fit)| problem.excess(rows, fit) <= EXCESS) {
        return slides;
    }
    let (low, high) = extent(problem.grid.position_m.iter().copied());
    let hats = ((high - low) / HAT_M).round().clamp(FEWEST_HATS, MOST_HATS);
    let shape = Shape {
        hats: whole(hats),
        ..shape
    };
    for (plain_rows, plain) in all() {
        let rows = plain_rows.rows.len() as f64 / OVERLAPPING;
        if rows <= 2.0 * hats {
            continue;
        }
        let Ok(placed) = Slides::new(problem, plain_rows.clone(), shape) else {
            continue;
        };
        let left = placed.fit.rms_n() / (1.0 - hats / rows).max(0.1).sqrt();
        if left < LARGEST_LEFT * plain.rms_n() {
            let heights = (0..shape.hats).filter_map(|hat| placed.fit.value(Unknown::Place(hat)));
            // The lowest one is 0.
            let (least, greatest) = extent(heights.chain([0.0]));
            found.notes.push(format!(
                "the force depends on the place, by {:.2} N over the way, as that of a spring, of cogging or of an \
                 uneven surface: it is fitted and left out ({:.3} N are left with it, {:.3} N without)",
                greatest - least,
                placed.fit.rms_n(),
                plain.rms_n()
            ));
            return placed;
        }
    }
    slides
}

/// Says what is assumed of a motion of one frequency: a spring and a mass give the same force there.
pub(super) fn note_one_frequency(problem: &Problem<'_>, slides: &Slides, found: &mut Identified) {
    if found.mass_kg.is_none() || slides.fit.value(Unknown::Mass).is_none() || slides.fit.shape.hats > 0 {
        return;
    }
    let rows = &slides.rows;
    let x = &problem.grid.position_m;
    let design = DMatrix::from_fn(rows.rows.len(), 4, |i, j| {
        let row = &rows.rows[i];
        match j {
            0 => x[row.at] + weighted(&rows.window.mean, x, row.at, x[row.at]),
            1 => row.velocity[0] + row.velocity[1],
            2 => 2.0 * row.positive_share - 1.0,
            _ => 1.0,
        }
    });
    let accelerations: Vec<f64> = rows.rows.iter().map(|row| row.acceleration).collect();
    let Ok(fit) = robust_fit::fit(design, &accelerations) else {
        return;
    };
    let variance = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    let stiffness_to_mass = -fit.values[0];
    if stiffness_to_mass > 0.0 && variance(&fit.residuals) < LEAST_MASS_SHARE * variance(&accelerations) {
        found.notes.push(format!(
            "the motion has one frequency, {:.2} Hz, where a spring looks like less mass: each 10 N/m along the way \
             would take {:.3} kg away. It is taken that there is none; two frequencies, or a chirp, tell them apart",
            stiffness_to_mass.sqrt() / std::f64::consts::TAU,
            10.0 / stiffness_to_mass
        ));
    }
}
