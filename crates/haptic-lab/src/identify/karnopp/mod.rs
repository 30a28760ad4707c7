//! Mass, dynamic and viscous friction, offset and static friction (Karnopp 1985).
//!
//! ```text
//! M a + s Fd(s) + b(s) v + offset = F        sliding, s = +-1
//! -Fs- <= F - offset <= Fs+                  at rest
//! ```
//!
//! Slides give all but `Fs`: a linear fit in the weak form (see [`smoothing`](crate::smoothing)), with
//! Huber's weights, under the longest window that costs no information. Its errors are those of leaving
//! out parts of the record, so that they hold where neighbouring residuals are alike; intervals are
//! widened by what the windows around it differ. `Fs` is read off breakaways under a slow load.

mod clocks;
mod motion;
mod place;
mod problem;
mod refusal;
mod regression;
mod statics;

pub(super) use motion::MotionEstimate;
pub(super) use problem::{CALIBRATION_SHARE, SAMPLING_SHARE};

use super::Left;
use super::grid::Even;
use super::options::{Clocks, Directions, Options};
use super::result::{Identified, Interval, ModelKind};
use crate::robust_fit::Unfit;
use crate::two_clocks::Drift;
use haptic_core::Directional;
use problem::{Problem, Slides};
use regression::{Rows, Shape, Unknown};

/// What a fit with friction alike must leave, in multiples of what the separate one leaves, before friction is
/// taken to differ by direction, where the separate one leaves more than noise. A better fit of a law that
/// misses something says little about the unknowns that it gained.
const MIN_GAIN: f64 = 3.0;

/// What a fit leaves is noise up to this correlation between windows that do not touch, up to this multiple of what the
/// noise of the force itself leaves, and where windows of 2.25 times the length leave less by this factor: white noise
/// falls by 1.5.
const NOISE_STRUCTURE: f64 = 0.2;
const NOISE_EXCESS: f64 = 1.4;
const NOISE_FALL: f64 = 1.3;

/// Of the time between two samples, what is not known of a shift whatever the fit says: the force between them is taken
/// as a straight line.
const BETWEEN_SAMPLES: f64 = 0.15;

/// The note where friction is taken as alike.
pub(super) const ALIKE: &str = "friction is taken as alike in both directions; a constant force and a difference of Fd \
                                look the same. Where the sensor's zero is known, give the offset";

/// Identifies a record.
pub(super) fn identify(even: &Even, options: &Options) -> (Identified, Left) {
    let grid = &even.grid;
    let mut found = Identified::empty(ModelKind::Karnopp);
    found.notes.clone_from(&grid.notes);
    found.mass_kg = options.mass_kg;
    let mut problem = Problem::new(grid, even.motion(), options);
    let shape = match refusal::shape(&problem, options) {
        Ok(shape) => shape,
        Err(reason) => {
            refusal::refuse_all(&mut found, options, &reason);
            return (found, Left::default());
        }
    };
    match put_on_one_clock(&mut problem, options, shape) {
        Ok(shift_s) => found.shift_s = shift_s,
        Err(reason) => {
            refusal::refuse_shift(&mut found, &reason);
            refusal::refuse_all(&mut found, options, &reason);
            return (found, Left::default());
        }
    }
    let slides = problem::choose_window(&problem, shape)
        .and_then(|rows| choose_directions(&problem, rows, shape, options, &mut found));
    let slides = match slides {
        Ok(slides) => slides,
        Err(unfit) => {
            refusal::refuse_all(&mut found, options, &refusal::reason(&unfit, &problem));
            return (found, Left::default());
        }
    };
    let slides = place::explained(&problem, slides, &mut found);
    let slides = place::look_for_backlash(&problem, slides, &mut found);
    found.residual_rms_n = slides.fit.rms_n();
    found.residual_window_s = Some(2.0 * slides.rows.half_s);
    note_drift(&mut found, &slides);
    found.notes.push(format!(
        "{} windows of {:.0} ms slide; the residual is that of the force smoothed by them",
        slides.rows.rows.len(),
        2e3 * slides.rows.half_s
    ));
    report_shift(&mut found, &slides, grid.period_s);
    report(&mut found, &problem, &slides, options);
    statics::report(&mut found, &problem, &slides, options);
    refusal::refuse_poor(&mut found, &problem, &slides, options);
    refusal::refuse_beside_offset(&mut found, &slides, options);
    refusal::floor_forces(&mut found);
    place::note_assumptions(&problem, &slides, &mut found);
    let middles = slides.rows.rows.iter().map(|row| row.at);
    let residual = middles.zip(slides.fit.found.residuals.iter().copied()).collect();
    (found, Left { path: None, residual })
}

/// The shift that a delay of one of the columns would have, s, its interval, and the mass with it, kg; `None` where the
/// record determines none.
pub(super) fn best_shift(even: &Even, options: &Options) -> Option<(f64, Interval, Option<f64>)> {
    let options = &Options {
        clocks: Clocks::Delayed,
        ..options.clone()
    };
    let mut problem = Problem::new(&even.grid, even.motion(), options);
    let shape = refusal::shape(&problem, options).ok()?;
    let shift_s = put_on_one_clock(&mut problem, options, shape).ok()?;
    let rows = problem::choose_window(&problem, shape).ok()?;
    let slides = Slides::new(&problem, rows, shape).ok()?;
    let (shift_s, interval) = shift_of(&slides, shift_s, even.grid.period_s)?;
    let mass = slides.value(&[(Unknown::Mass, 1.0)]);
    Some((shift_s, interval, mass.map(|(mass_kg, _)| mass_kg)))
}

fn note_drift(found: &mut Identified, slides: &Slides) {
    let certain = slides
        .value(&[(Unknown::Drift, 1.0)])
        .filter(|(drift, reach)| drift.abs() > (2.0 * reach).max(slides.least_force_n()));
    if let Some((drift, reach)) = certain {
        found.notes.push(format!(
            "the force's zero drifts by {drift:.3} +- {reach:.3} N over the record, which is fitted and left out"
        ));
    }
}

/// Puts the force on the positions' clock, where it is known or looked for; returns the shift, s.
fn put_on_one_clock(problem: &mut Problem<'_>, options: &Options, shape: Shape) -> Result<f64, String> {
    if let Clocks::Shifted(shift_s) = options.clocks {
        problem.force = problem.grid.force_shifted(shift_s, 0.0);
        return Ok(shift_s);
    }
    let longest_s = options.clocks.longest_shift_s();
    if longest_s <= 0.0 {
        return Ok(0.0);
    }
    let unfit = |unfit, problem: &Problem<'_>| refusal::reason(&unfit, problem);
    let unknown = |why| refusal::no_shift(why, longest_s);
    // The best window for clocks that differ is not the best one for those that agree.
    let unshifted = Shape {
        has_shift: false,
        ..shape
    };
    let rows = problem::choose_window(problem, unshifted).map_err(|why| unfit(why, problem))?;
    let rough = clocks::rough(problem, &rows, shape, longest_s).map_err(unknown)?;
    problem.force = problem.grid.force_shifted(rough.value_s, 0.0);
    let rows = problem::choose_window(problem, shape).map_err(|why| unfit(why, problem))?;
    let shift_s = clocks::find(problem, &rows, shape, longest_s).map_err(unknown)?;
    problem.force = problem.grid.force_shifted(shift_s, 0.0);
    Ok(shift_s)
}

/// How much the force's clock is ahead of the position's, s, however little determines it; `None` where no shift fits
/// best.
pub(super) fn rough_shift(even: &Even, options: &Options) -> Option<f64> {
    of_two_clocks(even, options, |problem, shape, longest_s| {
        let rows = problem::choose_window(problem, shape).ok()?;
        let shift = clocks::rough(problem, &rows, shape, longest_s).ok()?;
        Some(shift.value_s)
    })
}

/// What is found of a record that is not on one clock.
fn of_two_clocks<T>(
    even: &Even,
    options: &Options,
    find: impl FnOnce(&Problem<'_>, Shape, f64) -> Option<T>,
) -> Option<T> {
    let problem = Problem::new(&even.grid, even.motion(), options);
    let shape = refusal::shape(&problem, options).ok()?;
    find(&problem, shape, options.clocks.longest_shift_s())
}

/// How much faster the force's clock runs than the position's; `None` where that is not certain.
pub(super) fn clock_drift(even: &Even, options: &Options) -> Option<Drift> {
    of_two_clocks(even, options, drift_of)
}

fn drift_of(problem: &Problem<'_>, shape: Shape, longest_s: f64) -> Option<Drift> {
    let grid = problem.grid;
    let of = |problem: &Problem<'_>| {
        let rows = problem::choose_window(problem, shape).ok()?;
        clocks::growing(problem, &rows, shape, longest_s)
    };
    // As with a shift alone.
    let (shift, growth) = of(problem)?;
    let (_, growth) = of(&problem.with_force(grid.force_shifted(shift.value_s, growth.value_s)))?;
    Drift::of(&growth, grid.period_s * (grid.len() - 1) as f64)
}

/// Fits with friction alike or by direction, as asked or as the record shows.
fn choose_directions(
    problem: &Problem<'_>,
    rows: Rows,
    shape: Shape,
    options: &Options,
    found: &mut Identified,
) -> Result<Slides, Unfit> {
    let separate = Shape {
        is_separate: true,
        ..shape
    };
    let alike = Shape {
        is_separate: false,
        ..shape
    };
    if options.offset_n.is_some() || options.directions == Directions::Separate || shape.sides != [true; 2] {
        return Slides::new(problem, rows, separate);
    }
    let apart = Slides::new(problem, rows.clone(), separate);
    let together = Slides::new(problem, rows, alike)?;
    let Ok(apart) = apart else { return Ok(together) };
    if options.directions == Directions::Auto && differs(problem, &apart, &together, found) {
        return Ok(apart);
    }
    found.notes.push(ALIKE.to_owned());
    Ok(together)
}

/// Whether the record shows friction that differs by direction, beyond what an offset explains.
fn differs(problem: &Problem<'_>, apart: &Slides, together: &Slides, found: &mut Identified) -> bool {
    let statics_differ = statics::differ(problem, together);
    let difference = [(Unknown::Viscous(0), 1.0), (Unknown::Viscous(1), -1.0)];
    let viscous_differs = apart
        .value(&difference)
        .zip(apart.fit.uncertainty(&difference))
        .is_some_and(|((value, reach), of)| value.abs() > reach * of.reach_certain() / of.reach_95());
    if !viscous_differs && !statics_differ {
        return false;
    }
    let gain = together.fit.rms_n() / apart.fit.rms_n().max(f64::MIN_POSITIVE);
    let structure = apart.fit.structure(&apart.rows);
    let rms_under = |factor: f64| {
        let rows = problem.rows(factor * apart.rows.half_s);
        problem.fit(&rows, apart.fit.shape).ok().map(|fit| fit.rms_n())
    };
    let falls = rms_under(1.0 / 1.5)
        .zip(rms_under(1.5))
        .is_none_or(|(short, long)| short >= NOISE_FALL * long);
    let is_noise =
        structure < NOISE_STRUCTURE && falls && apart.fit.rms_n() <= NOISE_EXCESS * problem.force_noise(&apart.rows);
    if statics_differ || gain >= MIN_GAIN || is_noise {
        found.notes.push(format!(
            "friction differs by direction: alike it leaves {:.3} N, by direction {:.3} N. A constant force \
             would look the same",
            together.fit.rms_n(),
            apart.fit.rms_n()
        ));
        return true;
    }
    let viscous = |side| apart.fit.value(Unknown::Viscous(side)).unwrap_or(0.0);
    found.notes.push(format!(
        "by direction the viscous friction would be {:.4} and {:.4} N s/m, leaving {:.3} N instead of {:.3} N; what is \
         left is not noise (correlation {structure:.2}), so that this is not certain",
        viscous(0),
        viscous(1),
        apart.fit.rms_n(),
        together.fit.rms_n()
    ));
    false
}

/// Stores the clocks' shift in the result, where it was looked for.
fn report_shift(found: &mut Identified, slides: &Slides, period_s: f64) {
    let Some((shift_s, [low_s, high_s])) = shift_of(slides, found.shift_s, period_s) else {
        return;
    };
    found.shift_s = shift_s;
    found.intervals.insert("shift_s".to_owned(), [low_s, high_s]);
    found.notes.push(format!(
        "the force's clock is {:.2} ms ahead of the position's, within [{:.2}, {:.2}] ms: aligned, and what is not known \
         of it is in every interval",
        1e3 * found.shift_s,
        1e3 * low_s,
        1e3 * high_s
    ));
}

/// The shift, s, of clocks that were put together by a shift, s, and its interval; `None` where none was looked for.
fn shift_of(slides: &Slides, shift_s: f64, period_s: f64) -> Option<(f64, Interval)> {
    let (change_s, reach_s) = slides.value(&[(Unknown::Shift, 1.0)])?;
    let (shift_s, reach_s) = (shift_s + change_s, reach_s.hypot(BETWEEN_SAMPLES * period_s));
    Some((shift_s, [shift_s - reach_s, shift_s + reach_s]))
}

/// Stores what the slides determine in the result.
fn report(found: &mut Identified, problem: &Problem<'_>, slides: &Slides, options: &Options) {
    let interval = |value: f64, reach: f64| -> Interval { [value - reach, value + reach] };
    if let Some((mass, reach)) = slides.value(&[(Unknown::Mass, 1.0)]) {
        found.mass_kg = Some(mass);
        found.intervals.insert("mass_kg".to_owned(), interval(mass, reach));
    }
    let shape = slides.fit.shape;
    if shape.sides != [true; 2] {
        refusal::refuse_one_direction(found, slides, problem);
        return;
    }
    let mut both = |name: &str, sums: [(Unknown, f64); 2], add: [f64; 2]| {
        let mut values = [0.0; 2];
        for (side, direction) in ["positive", "negative"].into_iter().enumerate() {
            let (value, reach) = slides.value(&[sums[side]])?;
            values[side] = value + add[side];
            found
                .intervals
                .insert(format!("{name}.{direction}"), interval(values[side], reach));
        }
        let [positive, negative] = values;
        Some(Directional { positive, negative })
    };
    if shape.is_separate {
        let offset = options.offset_n.unwrap_or(0.0);
        found.viscous_ns_per_m = both(
            "viscous_Ns_per_m",
            [0, 1].map(|side| (Unknown::Viscous(side), 1.0)),
            [0.0; 2],
        );
        let levels = [(Unknown::Level(0), 1.0), (Unknown::Level(1), -1.0)];
        found.dynamic_force_n = both("dynamic_force_N", levels, [-offset, offset]);
        found.offset_n = options.offset_n;
        if found.offset_n.is_none() {
            refusal::refuse_offset(found);
        }
    } else {
        found.viscous_ns_per_m = both("viscous_Ns_per_m", [(Unknown::Viscous(0), 1.0); 2], [0.0; 2]);
        found.dynamic_force_n = both("dynamic_force_N", [(Unknown::Level(0), 1.0); 2], [0.0; 2]);
        if let Some((offset, reach)) = slides.value(&[(Unknown::Level(1), 1.0)]) {
            found.offset_n = Some(offset);
            found.intervals.insert("offset_N".to_owned(), interval(offset, reach));
        }
    }
}

#[cfg(test)]
mod tests;
