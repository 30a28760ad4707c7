//! Backlash between the encoder and the mass: looked for where the force between them changes its sign, which is where
//! the mass crosses the gap.
//!
//! The fit is made once more without the windows in which the force that it predicts comes near to zero. The measured
//! force would choose by its noise.

use super::problem::Problem;
use super::regression::{Fit, Rows, Unknown};
use super::slides::Slides;
use crate::identify::result::Identified;
use crate::robust_fit::Uncertainty;
use crate::smoothing::weighted;

/// The predicted force has a sign beyond so many times what the fit leaves, and this share of the greater forces.
const LEFT: f64 = 4.0;
const SHARE: f64 = 0.1;

/// A second fit whose intervals are wider by this shows little, and nothing where they are wider by that.
const HARDLY_SHOWS: f64 = 1.5;
const MAX_LOSS: f64 = 3.0;

/// Standard errors of a difference between the two fits from which on it is said.
const IS_SAID: f64 = 4.0;

/// The slides with what backlash may have moved in their intervals, as far as the record can tell.
pub(super) fn looked_for(problem: &Problem<'_>, mut slides: Slides, found: &mut Identified) -> Slides {
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
             none; a chirp of 0.5 to 3 Hz shows it"
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
    if most > IS_SAID {
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
    sizes.sort_unstable_by(f64::total_cmp);
    let least = LEFT * slides.fit.rms_n() + SHARE * sizes[sizes.len() * 9 / 10];
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
