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

mod breakaway;
mod clocks;
mod fitted;
mod motion;
mod place;
mod problem;
mod refusal;
mod regression;
mod slides;
mod statics;
mod window;

pub(super) use fitted::fitted;
pub(super) use slides::{CALIBRATION_SHARE, SAMPLING_SHARE};

use super::clocks::Clocks;
use super::grid::Grid;
use super::options::{Directions, Options};
use super::record::Record;
use super::result::{Identified, Interval, ModelKind};
use crate::robust_fit::{Unfit, certain};
use crate::two_clocks::{Drift, NoShift};
use haptic_core::Directional;
use motion::Motion;
use problem::Problem;
use regression::{Rows, Shape, Unknown};
use slides::Slides;

/// What a fit with friction alike must leave, in multiples of what the separate one leaves, before friction is
/// said to differ by direction, where the separate one leaves more than noise. A better fit of a law that
/// misses something says little about the unknowns that it gained.
const LEAST_GAIN: f64 = 3.0;

/// What a fit leaves is noise up to this correlation between windows that do not touch, up to this multiple of what the
/// noise of the force itself leaves, and where windows of 2.25 times the length leave less by this factor: white noise
/// falls by 1.5.
const NOISE_STRUCTURE: f64 = 0.2;
const NOISE_EXCESS: f64 = 1.4;
const NOISE_FALL: f64 = 1.3;

/// What is said where friction is taken as alike.
pub(super) const ALIKE: &str = "friction is taken as alike in both directions; a constant force and a difference of Fd \
                                look the same. Where the sensor's zero is known, give the offset";

/// Identifies a record that was checked.
pub(super) fn identify(record: &Record, options: &Options) -> Identified {
    let grid = Grid::new(record);
    let motion = Motion::new(&grid, record.resolution_m);
    let mut found = Identified::empty(ModelKind::Karnopp);
    found.notes.clone_from(&grid.notes);
    found.mass_kg = options.mass_kg;
    let known_mass = options.mass_kg.unwrap_or(0.0);
    let mut problem = Problem {
        force: grid.force_shifted(0.0, 0.0),
        grid: &grid,
        motion: &motion,
        known_mass,
    };
    let shape = match refusal::shape(&problem, options) {
        Ok(shape) => shape,
        Err(reason) => {
            refusal::refuse_all(&mut found, options, &reason);
            return found;
        }
    };
    problem.force = on_one_clock(&problem, options, shape, &mut found);
    let slides =
        window::choose(&problem, shape).and_then(|rows| choose_directions(&problem, rows, shape, options, &mut found));
    let slides = match slides {
        Ok(slides) => slides,
        Err(unfit) => {
            refusal::refuse_all(&mut found, options, &refusal::reason(&unfit, &grid, &motion));
            return found;
        }
    };
    let slides = place::explained(&problem, slides, &mut found);
    found.residual_rms_n = slides.fit.rms_n();
    found.residual_window_s = Some(2.0 * slides.rows.half_s);
    note_drift(&mut found, &slides);
    found.notes.push(format!(
        "{} windows of {:.0} ms slide; the residual is that of the force smoothed by them",
        slides.rows.rows.len(),
        2e3 * slides.rows.half_s
    ));
    report(&mut found, &problem, &slides, options);
    statics::report(&mut found, &problem, &slides, options);
    refusal::refuse_poor(&mut found, &problem, &slides, options);
    place::note_one_frequency(&problem, &slides, &mut found);
    found
}

fn note_drift(found: &mut Identified, slides: &Slides) {
    let certain = slides
        .value(&[(Unknown::Drift, 1.0)])
        .filter(|(drift, reach)| drift.abs() > 2.0 * reach);
    if let Some((drift, reach)) = certain {
        found.notes.push(format!(
            "the force's zero drifts by {drift:.3} +- {reach:.3} N over the record, which is fitted and left out"
        ));
    }
}

/// Finds the clocks' shift and gives the force on the positions' clock.
fn on_one_clock(problem: &Problem<'_>, options: &Options, shape: Shape, found: &mut Identified) -> Vec<f64> {
    let longest_s = options.clocks.longest_shift_s();
    if let Clocks::Shifted(shift_s) = options.clocks {
        found.shift_s = shift_s;
    }
    let as_given = problem.grid.force_shifted(found.shift_s, 0.0);
    if longest_s <= 0.0 {
        return as_given;
    }
    let of = |problem: &Problem<'_>| {
        let rows = window::choose(problem, shape).map_err(|_| NoShift::OutOfReach)?;
        clocks::find(problem.grid, &rows, shape, problem.known_mass, longest_s)
    };
    // The best window for clocks that differ is not the best one for those that agree.
    let shift = match of(problem) {
        Ok(shift) if shift.is_significant => of(&Problem {
            force: problem.grid.force_shifted(shift.value_s, 0.0),
            ..*problem
        }),
        shift => shift,
    };
    let shift = match shift {
        Ok(shift) => shift,
        Err(why) => {
            refusal::report_no_shift(found, why, options.clocks);
            return as_given;
        }
    };
    let [low, high] = shift.interval();
    found.intervals.insert("shift_s".to_owned(), [low, high]);
    if !shift.is_significant {
        found.notes.push(format!(
            "shift between the clocks: {:.2} ms within [{:.2}, {:.2}] ms, not different from 0 and not applied",
            shift.value_s * 1e3,
            low * 1e3,
            high * 1e3
        ));
        return as_given;
    }
    found.shift_s = shift.value_s;
    found.notes.push(format!(
        "the force's clock is {:.2} ms ahead of the position's, within [{:.2}, {:.2}] ms: aligned",
        shift.value_s * 1e3,
        low * 1e3,
        high * 1e3
    ));
    problem.grid.force_shifted(shift.value_s, 0.0)
}

/// How much faster the force's clock runs than the position's; `None` where that is not certain.
pub(super) fn clock_drift(record: &Record, options: &Options) -> Option<Drift> {
    let grid = Grid::new(record);
    let motion = Motion::new(&grid, record.resolution_m);
    let problem = Problem {
        force: grid.force_shifted(0.0, 0.0),
        grid: &grid,
        motion: &motion,
        known_mass: options.mass_kg.unwrap_or(0.0),
    };
    let shape = refusal::shape(&problem, options).ok()?;
    let longest_s = options.clocks.longest_shift_s();
    let of = |problem: &Problem<'_>| {
        let rows = window::choose(problem, shape).ok()?;
        clocks::growing(problem.grid, &rows, shape, problem.known_mass, longest_s)
    };
    // As with a shift alone.
    let (shift, growth) = of(&problem)?;
    let (_, growth) = of(&Problem {
        force: grid.force_shifted(shift.value_s, growth.value_s),
        ..problem
    })?;
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
        .is_some_and(|(value, reach)| value.abs() > reach * certain(apart.fit.found.freedom) / apart.fit.reach_95());
    if !viscous_differs && !statics_differ {
        return false;
    }
    let gain = together.fit.rms_n() / apart.fit.rms_n().max(f64::MIN_POSITIVE);
    let structure = apart.fit.structure(&apart.rows);
    let falls = match &apart.neighbours[..] {
        [short, long] => short.rms_n() >= NOISE_FALL * long.rms_n(),
        _ => true,
    };
    let is_noise =
        structure < NOISE_STRUCTURE && falls && apart.fit.rms_n() <= NOISE_EXCESS * problem.force_noise(&apart.rows);
    if statics_differ || gain >= LEAST_GAIN || is_noise {
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
