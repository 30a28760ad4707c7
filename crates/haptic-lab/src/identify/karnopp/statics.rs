//! Static friction from the breakaways of a record.

use super::breakaway::{self, Breakaway};
use super::problem::Problem;
use super::regression::Unknown;
use super::slides::Slides;
use crate::identify::options::Options;
use crate::identify::result::{Identified, Refusal};
use crate::robust_fit::NORMAL_95;
use crate::stats::mean::student_t;
use haptic_core::Directional;

const INSTEAD: &str = "let it rest, then push it by a ramp of at most 1 mm/s until it slides, several times in each \
                       direction";

/// The slow breakaways in a direction, their mean driving force along it and half of that mean's 95 % interval.
fn level(breakaways: &[Breakaway], sense: i8) -> Option<(f64, f64)> {
    let slow: Vec<&Breakaway> = breakaways
        .iter()
        .filter(|each| each.sense == sense && each.is_slow())
        .collect();
    let n = slow.len() as f64;
    let mean = slow.iter().map(|each| each.force_n).sum::<f64>() / n;
    let square = |f: &dyn Fn(&Breakaway) -> f64| slow.iter().map(|each| f(each).powi(2)).sum::<f64>();
    let read = (square(&|each| each.noise_n) / n).sqrt() * NORMAL_95 / n.sqrt();
    let scatter = if slow.len() < 3 {
        0.0
    } else {
        let deviation = (square(&|each| each.force_n - mean) / (n - 1.0)).sqrt();
        student_t((n - 1.0).max(3.0)) * deviation / n.sqrt()
    };
    let rise = slow.iter().map(|each| each.rise_n).sum::<f64>() / n;
    (!slow.is_empty()).then_some((mean * f64::from(sense), read.max(scatter) + rise))
}

/// The breakaways of a record whose force's zero drifts as the slides say, and half of the 95 % interval of that drift.
fn breakaways(problem: &Problem<'_>, slides: &Slides) -> (Vec<Breakaway>, f64) {
    let (drift, reach) = slides.value(&[(Unknown::Drift, 1.0)]).unwrap_or_default();
    let n = problem.force.len() as f64;
    let samples = problem.force.iter().enumerate();
    let force: Vec<f64> = samples
        .map(|(at, force)| force - drift * (at as f64 / n - 0.5))
        .collect();
    (breakaway::find(problem.grid, problem.motion, &force), 0.5 * reach)
}

/// Whether the breakaways lie so apart in both directions that an offset cannot explain it together with
/// the slides.
pub(super) fn differ(problem: &Problem<'_>, together: &Slides) -> bool {
    let (breakaways, _) = breakaways(problem, together);
    let (Some(positive), Some(negative)) = (level(&breakaways, 1), level(&breakaways, -1)) else {
        return false;
    };
    let Some((offset, reach)) = together.value(&[(Unknown::Level(1), 1.0)]) else {
        return false;
    };
    let apart = f64::midpoint(positive.0, -negative.0) - offset;
    let certain = 2.0 * (positive.1.hypot(negative.1) / 2.0).hypot(reach);
    apart.abs() > certain.max(0.01 * (positive.0 + negative.0))
}

/// Puts the static friction into the result, or says why it is not determined.
pub(super) fn report(found: &mut Identified, problem: &Problem<'_>, slides: &Slides, options: &Options) {
    let (breakaways, drift_reach) = breakaways(problem, slides);
    let offset = found.offset_n.or(options.offset_n).unwrap_or(0.0);
    let offset_reach = slides
        .value(&[(Unknown::Level(1), 1.0)])
        .filter(|_| !slides.fit.shape.is_separate)
        .map_or(0.0, |(_, reach)| reach)
        .hypot(drift_reach);
    let mut values = [None; 2];
    for (value, sense) in values.iter_mut().zip([1, -1]) {
        *value =
            level(&breakaways, sense).map(|(force, reach)| (force - f64::from(sense) * offset, reach + offset_reach));
    }
    if let [Some(positive), Some(negative)] = values {
        found.static_force_n = Some(Directional {
            positive: positive.0,
            negative: negative.0,
        });
        for (direction, (value, reach)) in [("positive", positive), ("negative", negative)] {
            found
                .intervals
                .insert(format!("static_force_N.{direction}"), [value - reach, value + reach]);
        }
        return;
    }
    let lacking = match values {
        [None, None] => "in either direction",
        [None, _] => "in the positive direction",
        _ => "in the negative direction",
    };
    let fast: Vec<&Breakaway> = breakaways.iter().filter(|each| !each.is_slow()).collect();
    let slowest = fast
        .iter()
        .map(|each| each.rate_n_per_s.abs())
        .fold(f64::INFINITY, f64::min);
    let reason = if fast.is_empty() {
        format!(
            "there is no breakaway from a rest under a rising force {lacking} ({} rests)",
            problem.motion.rests.len()
        )
    } else {
        format!(
            "there is no breakaway under a slow load {lacking}; {} come under faster ones, the slowest at {slowest:.3} \
             N/s: the force continues to rise while the mass sets off",
            fast.len()
        )
    };
    found.refused.push(Refusal {
        parameter: "static_force_N".to_owned(),
        reason,
        instead: INSTEAD.to_owned(),
    });
}
