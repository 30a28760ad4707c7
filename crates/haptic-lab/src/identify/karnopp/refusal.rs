//! What a record cannot determine, why, and what to record instead. Physics first, figures of the fit after.

use super::motion::MotionEstimate;
use super::place::{self, MIN_MASS_SHARE};
use super::problem;
use super::problem::{Problem, Slides};
use super::regression::{Rows, Shape, Unknown};
use crate::identify::grid::Grid;
use crate::identify::options::{Directions, Options};
use crate::identify::result::{Identified, Interval, Refusal, at_least_zero};
use crate::robust_fit::Unfit;
use crate::two_clocks::NoShift;
use haptic_core::Directional;
use haptic_motion::median::{at_share, extent};

/// Fewest windows in a direction.
const MIN_ROWS: usize = 12;

/// Least ratio of the speed of the fastest tenth of a slide to that of its slowest tenth that determines the share of
/// viscous friction.
const MIN_SPEED_RATIO: f64 = 1.5;

/// Share of the acceleration's own variance that may be noise.
const MAX_ATTENUATION: f64 = 0.1;

/// Half of an interval may be this share of the value.
const MAX_UNCERTAINTY: f64 = 0.3;

/// Half of the interval of viscous friction, times the span of speeds, may be this share of the dynamic friction,
/// however small the viscous friction is itself.
const HARMLESS_SHARE: f64 = 0.05;

/// Fewest encoder steps, or standard deviations of noise, that the whole stroke must have.
const MIN_STROKE_STEPS: f64 = 30.0;

const DIRECTIONS: [&str; 2] = ["positive", "negative"];

const MOVE_BOTH_WAYS: &str = "push and pull by turns at 0.5 to 3 Hz, with strokes of 10 mm or more, for 10 s";

/// Which unknowns the motion itself allows, or why none.
pub(super) fn shape(problem: &Problem<'_>, options: &Options) -> Result<Shape, String> {
    let (grid, motion) = (problem.grid, problem.motion);
    let x = &grid.position_m;
    let (low, high) = extent(x.iter().copied());
    let stroke_m = high - low;
    let least_m = MIN_STROKE_STEPS * motion.noise_m.max(motion.step_m);
    if stroke_m <= least_m {
        return Err(format!(
            "the stroke of {:.4} mm is too small: at least {:.4} mm stand out of the position's noise",
            stroke_m * 1e3,
            least_m * 1e3
        ));
    }
    if grid.force_n.iter().all(|force| *force == grid.force_n[0]) {
        return Err(format!(
            "the force never changes: it is {:.4} N throughout",
            grid.force_n[0]
        ));
    }
    let half_s = problem::window_candidates(grid.period_s)[0];
    let rows = problem.rows(half_s);
    let positive = rows.rows.iter().filter(|row| row.sense > 0.0).count();
    let sides = [positive, rows.rows.len() - positive].map(|count| count >= MIN_ROWS);
    if sides == [false; 2] {
        return Err(too_little_sliding(&rows, grid, motion));
    }
    Ok(Shape {
        has_mass: options.mass_kg.is_none() && !is_acceleration_noise(&rows, motion),
        has_viscous: speed_ratio(motion) >= MIN_SPEED_RATIO,
        is_separate: options.directions != Directions::Alike || sides != [true; 2],
        sides,
        has_shift: options.clocks.longest_shift_s() > 0.0,
        has_growing_shift: false,
        hats: 0,
    })
}

/// Whether the accelerations are no larger than their noise under the shortest and under long windows.
fn is_acceleration_noise(rows: &Rows, motion: &MotionEstimate) -> bool {
    let noise = motion.acceleration_noise(&rows.window);
    rows.acceleration_rms() < noise * 1.5 && noise < 0.05
}

/// Speeds of the slides below which a tenth, and above which a tenth, of their time is spent, m/s.
fn speeds(motion: &MotionEstimate) -> (f64, f64) {
    let mut speeds: Vec<f64> = motion
        .velocity_mps
        .iter()
        .zip(&motion.sense)
        .filter(|(_, sense)| **sense != 0)
        .map(|(v, _)| v.abs())
        .collect();
    let mut at = |share| at_share(&mut speeds, share, 10).unwrap_or(0.0);
    (at(1), at(9))
}

fn speed_ratio(motion: &MotionEstimate) -> f64 {
    let (slow, fast) = speeds(motion);
    fast / slow.max(motion.slowest_mps)
}

fn too_little_sliding(rows: &Rows, grid: &Grid, motion: &MotionEstimate) -> String {
    let saturated = if grid.saturated_share > 0.0 {
        format!(
            "; the force is saturated for {:.0} % of the time",
            100.0 * grid.saturated_share
        )
    } else {
        String::new()
    };
    format!(
        "it slides for {:.3} s in the positive and {:.3} s in the negative direction, in pieces that hold {} windows \
         of {:.0} ms{saturated}",
        motion.sliding(1) as f64 * grid.period_s,
        motion.sliding(-1) as f64 * grid.period_s,
        rows.rows.len(),
        2e3 * rows.half_s,
    )
}

/// Why the fit cannot be made.
pub(super) fn reason(unfit: &Unfit, problem: &Problem<'_>) -> String {
    let (grid, motion) = (problem.grid, problem.motion);
    let slides = |sense| motion.slides(sense, 8);
    match unfit {
        Unfit::TooFewRows(_) => {
            let half_s = problem::window_candidates(grid.period_s)[0];
            too_little_sliding(&problem.rows(half_s), grid, motion)
        }
        Unfit::Condition(condition) => format!(
            "the motion does not separate inertia, viscous and dynamic friction (condition number {condition:.0e})"
        ),
        Unfit::OnePart => format!(
            "it rests on one part of the record alone: {} slides in the positive and {} in the negative direction",
            slides(1),
            slides(-1)
        ),
    }
}

/// Refuses all that slides would determine.
pub(super) fn refuse_all(found: &mut Identified, options: &Options, reason: &str) {
    let mass = options.mass_kg.is_none().then_some("mass_kg");
    let names = ["dynamic_force_N", "viscous_Ns_per_m", "static_force_N", "offset_N"];
    for name in mass.into_iter().chain(names) {
        refuse(found, name, reason, MOVE_BOTH_WAYS);
    }
    found.offset_n = options.offset_n;
    if found.offset_n.is_some() {
        found.refused.retain(|refusal| refusal.parameter != "offset_N");
    }
}

/// Why no shift between the clocks was found.
pub(super) fn no_shift(why: NoShift, longest_s: f64) -> String {
    let longest_ms = 1e3 * longest_s;
    match why {
        NoShift::AllAlike => format!(
            "whatever the shift of the clocks within {longest_ms} ms, about the same force is left: the motion changes too \
             little to determine it"
        ),
        NoShift::OutOfReach => format!("no shift of the clocks within {longest_ms} ms fits best"),
        NoShift::Noise => {
            "the shift of the clocks is not determined: within strokes of one frequency a shift looks like \
                           other inertia and viscous friction"
                .to_owned()
        }
        NoShift::Other(other_s) => format!(
            "the shift of the clocks is not determined: one of {:.1} ms leaves about the same",
            1e3 * other_s
        ),
    }
}

/// Refuses the shift of the clocks.
pub(super) fn refuse_shift(found: &mut Identified, reason: &str) {
    refuse(
        found,
        "shift_s",
        reason,
        "a chirp of 0.5 to 3 Hz, or give the shift by --shift-ms",
    );
}

/// Refuses the offset of friction that differs by direction.
pub(super) fn refuse_offset(found: &mut Identified) {
    refuse(
        found,
        "offset_N",
        "a constant force and a difference of the dynamic friction by direction look the same; the forces given hold \
         for an offset of 0",
        "zero the force sensor without contact on a level axis and give --offset 0, or the force that it shows there",
    );
}

/// Takes back the forces of each direction where they were asked for, and a constant force that is not known may be all
/// that makes them differ.
pub(super) fn refuse_beside_offset(found: &mut Identified, slides: &Slides, options: &Options) {
    let is_asked = slides.fit.shape.is_separate && options.directions == Directions::Separate;
    let Some((twice, reach)) = slides
        .value(&[(Unknown::Level(0), 1.0), (Unknown::Level(1), 1.0)])
        .filter(|(twice, reach)| is_asked && options.offset_n.is_none() && twice.abs() > *reach)
    else {
        return;
    };
    let Some(dynamic) = found.dynamic_force_n else { return };
    let reason = format!(
        "friction and a constant force together are {:.4} N in the positive and {:.4} N in the negative direction, which is \
         a constant force of {:.4} +- {:.4} N, a difference of friction, or both",
        dynamic.positive,
        dynamic.negative,
        twice / 2.0,
        reach / 2.0
    );
    let instead = "give the constant force by --offset, 0 for a sensor that was zeroed without contact on a level axis";
    refuse(found, "dynamic_force_N", &reason, instead);
    if found.static_force_n.is_some() {
        refuse(found, "static_force_N", &reason, instead);
    }
}

/// Refuses what sliding in one direction alone does not determine.
pub(super) fn refuse_one_direction(found: &mut Identified, slides: &Slides, problem: &Problem<'_>) {
    let side = usize::from(!slides.fit.shape.sides[0]);
    let direction = DIRECTIONS[side];
    let level = slides.fit.value(Unknown::Level(side)).unwrap_or(0.0);
    let (slow, fast) = speeds(problem.motion);
    let viscous = slides.fit.value(Unknown::Viscous(side));
    let total = viscous.map_or_else(
        || format!("{level:.4} N at {slow:.4} to {fast:.4} m/s"),
        |viscous| {
            format!(
                "{level:.4} N {} {viscous:.4} N s/m times the velocity",
                ["+", "-"][usize::from(viscous < 0.0)]
            )
        },
    );
    let reason = format!("it slides in the {direction} direction only, where friction and offset together are {total}");
    for name in ["dynamic_force_N", "viscous_Ns_per_m", "offset_N"] {
        refuse(found, name, &reason, MOVE_BOTH_WAYS);
    }
}

/// Takes back what the fit holds too loosely.
pub(super) fn refuse_poor(found: &mut Identified, problem: &Problem<'_>, slides: &Slides, options: &Options) {
    if refuse_reversed(found, problem.motion, options) {
        return;
    }
    refuse_poor_mass(found, slides, problem.motion, options);
    let (slow, fast) = speeds(problem.motion);
    if slides.fit.shape.sides != [true; 2] {
        return;
    }
    let dynamic = found
        .dynamic_force_n
        .map_or(0.0, |dynamic| dynamic.positive.min(dynamic.negative));
    let reach = |found: &Identified, name: &str| {
        DIRECTIONS
            .into_iter()
            .filter_map(|direction| interval(found, name, direction))
            .map(|[low, high]| (high - low) / 2.0)
            .fold(0.0, f64::max)
    };
    let viscous_reach = reach(found, "viscous_Ns_per_m");
    let least_viscous = found
        .viscous_ns_per_m
        .map_or(0.0, |viscous| viscous.positive.min(viscous.negative));
    let span = format!("nine tenths of the sliding is between {slow:.4} and {fast:.4} m/s");
    let instead = "vary the speed: sines of 0.5 to 3 Hz, or ramps at several speeds, at least three times as fast at \
                   the fastest as at the slowest";
    let too_loose = viscous_reach > MAX_UNCERTAINTY * least_viscous.abs()
        && viscous_reach * (fast - slow) > HARMLESS_SHARE * dynamic.abs();
    if !slides.fit.shape.has_viscous || too_loose {
        let why = if too_loose {
            format!("its interval is +-{viscous_reach:.4} N s/m; {span}")
        } else {
            format!("the span of speeds is too small: {span}")
        };
        let longer = format!("record longer, and both slower than {slow:.4} and faster than {fast:.4} m/s");
        let instead = if too_loose { longer.as_str() } else { instead };
        refuse(found, "viscous_Ns_per_m", &why, instead);
        let whole = dynamic + least_viscous * f64::midpoint(slow, fast);
        let level =
            format!("at {slow:.4} to {fast:.4} m/s the friction is about {whole:.4} N; its viscous part is unknown");
        refuse(found, "dynamic_force_N", &level, instead);
        return;
    }
    let drag = Drag {
        force_n: least_viscous * fast,
        fast_mps: fast,
    };
    if refuse_pushing(found, &drag) || report_no_dry_friction(found, &drag) {
        return;
    }
    let dynamic_reach = reach(found, "dynamic_force_N");
    if dynamic_reach > MAX_UNCERTAINTY * dynamic.abs() && dynamic_reach > 0.1 * slides.fit.rms_n() {
        let why = format!("its interval is +-{dynamic_reach:.4} N around {dynamic:.4} N");
        refuse(found, "dynamic_force_N", &why, MOVE_BOTH_WAYS);
    }
}

/// The viscous friction of the fastest slides.
struct Drag {
    force_n: f64,
    fast_mps: f64,
}

impl Drag {
    /// The largest dry friction that makes no difference beside it, N.
    fn harmless_n(&self) -> f64 {
        HARMLESS_SHARE * self.force_n
    }
}

/// The interval of a parameter in a direction.
fn interval(found: &Identified, name: &str, direction: &str) -> Option<Interval> {
    found.intervals.get(&format!("{name}.{direction}")).copied()
}

/// The intervals of the dynamic friction, N, where it is known in both directions.
fn dynamic_intervals(found: &Identified) -> Option<[Interval; 2]> {
    let [positive, negative] = DIRECTIONS.map(|direction| interval(found, "dynamic_force_N", direction));
    Some([positive?, negative?])
}

/// Refuses a dynamic friction that would push, and by more than makes no difference.
fn refuse_pushing(found: &mut Identified, drag: &Drag) -> bool {
    let pushes = |intervals: [Interval; 2]| intervals.iter().any(|[_, high]| *high < -drag.harmless_n().max(0.0));
    let Some(dynamic) = found
        .dynamic_force_n
        .filter(|_| dynamic_intervals(found).is_some_and(pushes))
    else {
        return false;
    };
    let reason = format!(
        "it would be {:.4} N in the positive and {:.4} N in the negative direction, and friction does not push: there is \
         a constant force, or a drag that does not grow in proportion to the velocity",
        dynamic.positive, dynamic.negative
    );
    let instead = "zero the force sensor without contact on a level axis and give --offset 0; record slower motions";
    refuse(found, "dynamic_force_N", &reason, instead);
    true
}

/// Puts no dry friction into the result, where the record shows none beside the drag: none that slides and, without a
/// breakaway, none that holds.
fn report_no_dry_friction(found: &mut Identified, drag: &Drag) -> bool {
    let Some(intervals) = dynamic_intervals(found) else {
        return false;
    };
    let is_none = intervals
        .iter()
        .all(|[low, high]| *low <= 0.0 && *high <= drag.harmless_n());
    if !is_none {
        return false;
    }
    // Beyond zero to the other side it is an error of the fit all the same.
    let most_n = intervals.iter().flatten().map(|end| end.abs()).fold(0.0, f64::max);
    found.notes.push(format!(
        "no dry friction: at most {most_n:.4} N beside a drag of {:.4} N at {:.4} m/s",
        drag.force_n, drag.fast_mps
    ));
    found.dynamic_force_n = Some(Directional::both(0.0));
    let mut names = vec!["dynamic_force_N"];
    if found.static_force_n.is_none() {
        found.static_force_n = found.dynamic_force_n;
        found.refused.retain(|refusal| refusal.parameter != "static_force_N");
        names.push("static_force_N");
    }
    for name in names {
        for direction in DIRECTIONS {
            found.intervals.insert(format!("{name}.{direction}"), [0.0, most_n]);
        }
    }
    true
}

/// A force that brakes is never below zero, whatever the noise: neither is its interval.
pub(super) fn floor_forces(found: &mut Identified) {
    found.dynamic_force_n = found.dynamic_force_n.map(at_least_zero);
    found.static_force_n = found.static_force_n.map(at_least_zero);
    for (name, ends) in &mut found.intervals {
        if name.starts_with("dynamic_force_N") || name.starts_with("static_force_N") {
            *ends = ends.map(|end| end.max(0.0));
        }
    }
}

/// Refuses everything where friction would push also at the fastest slides: the force or the position has the other
/// sign.
fn refuse_reversed(found: &mut Identified, motion: &MotionEstimate, options: &Options) -> bool {
    let (_, fast) = speeds(motion);
    let pushes = |direction: &str| {
        let high = |name| interval(found, name, direction).map(|[_, high]| high);
        high("dynamic_force_N").is_some_and(|dynamic| dynamic + high("viscous_Ns_per_m").unwrap_or(0.0) * fast < 0.0)
    };
    let Some(dynamic) = found.dynamic_force_n.filter(|_| DIRECTIONS.into_iter().all(pushes)) else {
        return false;
    };
    let viscous = found.viscous_ns_per_m.unwrap_or_default();
    let reason = format!(
        "the force points against the motion: it would be a friction of {:.4} N in the positive and {:.4} N in the \
         negative direction at {fast:.4} m/s",
        dynamic.positive + viscous.positive * fast,
        dynamic.negative + viscous.negative * fast
    );
    let names = ["mass_kg", "dynamic_force_N", "viscous_Ns_per_m", "static_force_N"];
    found
        .refused
        .retain(|refusal| !names.contains(&refusal.parameter.as_str()));
    for name in names {
        if name == "mass_kg" && options.mass_kg.is_some() {
            continue;
        }
        refuse(
            found,
            name,
            &reason,
            "check the signs: a sensor that points against the position wants a negative --force-gain",
        );
    }
    true
}

fn refuse_poor_mass(found: &mut Identified, slides: &Slides, motion: &MotionEstimate, options: &Options) {
    if options.mass_kg.is_some() {
        return;
    }
    let instead = "move faster: sines of 1 to 3 Hz with strokes of 20 mm or more; or weigh the mass and give --mass";
    let acceleration = slides.rows.acceleration_rms();
    let noise = motion.acceleration_noise(&slides.rows.window);
    let Some((mass, reach)) = slides.value(&[(Unknown::Mass, 1.0)]) else {
        let why =
            format!("accelerations of {acceleration:.4} m/s^2 rms do not stand out of their noise of {noise:.4} m/s^2");
        refuse(found, "mass_kg", &why, instead);
        return;
    };
    let share = place::share_of_mass(&slides.rows, &slides.fit);
    if slides.fit.shape.hats > 0 && share < MIN_MASS_SHARE {
        let why = format!(
            "the force depends on the place, and {:.0} % of the acceleration's variance is given by that: a spring along \
             the way would look like less mass",
            100.0 * (1.0 - share)
        );
        refuse(
            found,
            "mass_kg",
            &why,
            "two frequencies, or a chirp of 0.5 to 3 Hz; or weigh the mass and give --mass",
        );
        return;
    }
    let attenuation = slides.fit.noise_share(Unknown::Mass).unwrap_or(1.0);
    if attenuation > MAX_ATTENUATION {
        let why = format!(
            "{:.0} % of the acceleration's variance ({acceleration:.4} m/s^2 rms) is the position's noise",
            100.0 * attenuation.min(1.0)
        );
        refuse(found, "mass_kg", &why, instead);
    } else if reach > MAX_UNCERTAINTY * mass {
        let why = format!(
            "its interval is {mass:.4} +- {reach:.4} kg: accelerations of {acceleration:.4} m/s^2 rms are too small \
             beside the {:.4} N that the fit leaves",
            slides.fit.rms_n()
        );
        refuse(found, "mass_kg", &why, instead);
    }
}

fn refuse(found: &mut Identified, parameter: &str, reason: &str, instead: &str) {
    found.refuse(Refusal::new(parameter, reason, instead));
}
