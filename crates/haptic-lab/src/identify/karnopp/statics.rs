//! Static friction from the breakaways of a record.
//!
//! Static friction is the force at which a slow load sets a resting mass loose.

use super::problem::{Problem, Slides};
use super::regression::Unknown;
use crate::identify::grid::Grid;
use crate::identify::karnopp::motion::MotionEstimate;
use crate::identify::options::Options;
use crate::identify::result::{Identified, Refusal};
use crate::robust_fit::NORMAL_95;
use crate::smoothing::whole;
use crate::stats::mean::student_t;
use haptic_core::Directional;
use nalgebra::{Matrix4, Vector4};

const INSTEAD: &str = "let it rest, then push it by a ramp of at most 1 mm/s until it slides, several times in each \
                       direction";

const ONE_EACH_WAY: &str = "there is one breakaway under a slow load in each direction, which says nothing of the next";

/// The mean driving force of the slow breakaways in the positive and the negative direction, along each, N, and half of
/// that mean's 95 % interval. One breakaway says nothing of the next: what they scatter is that of both directions
/// together, and the half is infinite where no direction has two.
fn levels(breakaways: &[Breakaway]) -> [Option<(f64, f64)>; 2] {
    let sides = [1, -1].map(|sense| {
        let slow = breakaways.iter().filter(|each| each.sense == sense && each.is_slow());
        (f64::from(sense), slow.collect::<Vec<_>>())
    });
    let mean = |slow: &[&Breakaway], of: &dyn Fn(&Breakaway) -> f64| {
        slow.iter().map(|each| of(each)).sum::<f64>() / slow.len() as f64
    };
    let (mut squares, mut freedom) = (0.0, 0.0);
    for (_, slow) in sides.iter().filter(|(_, slow)| !slow.is_empty()) {
        let force_n = mean(slow, &|each| each.force_n);
        squares += slow.iter().map(|each| (each.force_n - force_n).powi(2)).sum::<f64>();
        freedom += slow.len() as f64 - 1.0;
    }
    let scatter = if freedom > 0.0 {
        student_t(freedom) * (squares / freedom).sqrt()
    } else {
        f64::INFINITY
    };
    sides.map(|(sense, slow)| {
        let n = slow.len() as f64;
        let read = mean(&slow, &|each| each.noise_n.powi(2)).sqrt() * NORMAL_95;
        let reach = read.max(scatter) / n.sqrt() + mean(&slow, &|each| each.rise_n);
        (!slow.is_empty()).then(|| (mean(&slow, &|each| each.force_n) * sense, reach))
    })
}

/// The breakaways of a record whose force's zero drifts as the slides say, and half of the 95 % interval of that drift.
fn breakaways(problem: &Problem<'_>, slides: &Slides) -> (Vec<Breakaway>, f64) {
    let (drift, reach) = slides.value(&[(Unknown::Drift, 1.0)]).unwrap_or_default();
    let n = problem.force.len() as f64;
    let samples = problem.force.iter().enumerate();
    let force: Vec<f64> = samples
        .map(|(at, force)| force - drift * (at as f64 / n - 0.5))
        .collect();
    (find_breakaways(problem.grid, problem.motion, &force), 0.5 * reach)
}

/// Whether the breakaways lie so apart in both directions that an offset cannot explain it together with
/// the slides.
pub(super) fn differ(problem: &Problem<'_>, together: &Slides) -> bool {
    let (breakaways, _) = breakaways(problem, together);
    let [Some(positive), Some(negative)] = levels(&breakaways) else {
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
    let [positive, negative] = levels(&breakaways);
    let less = |offset: f64| move |(force, reach): (f64, f64)| (force - offset, reach + offset_reach);
    let values = [positive.map(less(offset)), negative.map(less(-offset))];
    if let [Some(positive), Some(negative)] = values {
        if positive.1.is_infinite() {
            found.refuse(Refusal::new("static_force_N", ONE_EACH_WAY, INSTEAD));
            return;
        }
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
            "none of its {} rests ends {lacking} in a breakaway clear enough to be read: a load that rises evenly for \
             {SLOWEST_LOAD_S} s, then a bend",
            problem.motion.rests.len()
        )
    } else {
        format!(
            "there is no breakaway under a slow load {lacking}; {} come under faster ones, the slowest at {slowest:.3} \
             N/s: the force continues to rise while the mass sets off",
            fast.len()
        )
    };
    found.refuse(Refusal::new("static_force_N", &reason, INSTEAD));
}

/// Least time, s, in which a slow load reaches the breakaway. At a coupling of 25000 N/m and a
/// limit of 4 N that is a hand at 1.6 mm/s. A faster one continues to rise while the mass sets off:
/// at 100 mm/s a limit of 7 N reads as 14 N.
const SLOWEST_LOAD_S: f64 = 0.1;

/// Longest time, s, before the mass may have set off over which the load is fitted.
const MAX_LOAD_S: f64 = 0.1;

/// Largest part of the force that may be uncertain.
const MAX_ERROR: f64 = 0.08;

/// The motion is first seen at a distance, and then at this multiple of it.
const FARTHER: f64 = 2.25;

/// How long before the first it may have begun, in multiples of the time between both.
const EARLIER: f64 = 3.0;

/// Least number of samples over which it may have begun.
const MIN_STARTS: usize = 6;

/// Longest time, s, that a start takes from the one distance to the other.
const MAX_START_S: f64 = 0.1;

/// A breakaway from rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Breakaway {
    /// 1 or -1.
    pub(super) sense: i8,
    /// Driving force, N.
    pub(super) force_n: f64,
    /// Its standard error, N.
    pub(super) noise_n: f64,
    /// How much the force rises from one sample to the next, N.
    pub(super) rise_n: f64,
    /// How fast it rises, N/s.
    pub(super) rate_n_per_s: f64,
}

impl Breakaway {
    /// Whether its force is that of the surface, and not of the load's speed.
    pub(super) fn is_slow(&self) -> bool {
        let force = self.force_n.abs();
        self.rate_n_per_s.abs() * SLOWEST_LOAD_S <= force && self.rise_n + 2.0 * self.noise_n <= MAX_ERROR * force
    }
}

/// All breakaways of a record, in order. `force` is on the clock of the positions.
fn find_breakaways(grid: &Grid, motion: &MotionEstimate, force: &[f64]) -> Vec<Breakaway> {
    let found = motion.rests.iter().filter_map(|rest| {
        let x = &grid.position_m;
        // The last part of the rest may be its first motion.
        let quiet = rest.start + (rest.len() * 2 / 3).max(3);
        let rest_m = x[rest.start..quiet].iter().sum::<f64>() / (quiet - rest.start) as f64;
        let away = |threshold: f64| {
            let is_beyond = |at: &usize| (x[*at] - rest_m).abs() > threshold;
            let at = (quiet..x.len()).find(|at| (*at..(at + 3).min(x.len())).all(|next| is_beyond(&next)))?;
            Some((at, if x[at] > rest_m { 1_i8 } else { -1 }))
        };
        let threshold = 3.0 * motion.noise_m + 0.5 * motion.step_m;
        let (first, sense) = away(threshold)?;
        let (second, same) = away(FARTHER * threshold)?;
        // A load that lets go again, a creep, or a slip shorter than that.
        let rests_between =
            |other: &std::ops::Range<usize>| other.start > quiet && other.start < second && other.end > first;
        let longest = whole(MAX_START_S / grid.period_s);
        if same != sense || second > first + longest || motion.rests.iter().any(rests_between) {
            return None;
        }
        let span = whole(EARLIER * (second - first) as f64).max(MIN_STARTS);
        let earliest = first.saturating_sub(span).max(quiet);
        // A rest begins within its tolerance, where the slip before it may still continue.
        let unsettled_m = 2.0 * motion.noise_m + 0.5 * motion.step_m;
        let is_unsettled = |at: &usize| (x[*at] - rest_m).abs() > unsettled_m;
        let settled = (rest.start..quiet)
            .rev()
            .find(is_unsettled)
            .map_or(rest.start, |at| at + 1);
        let length = whole(MAX_LOAD_S / grid.period_s).min(earliest - settled);
        let load = earliest.checked_sub(length).filter(|_| length >= 8)?..first + 1;
        if !grid.is_valid[load.clone()].iter().all(|valid| *valid) {
            return None;
        }
        let signed: Vec<f64> = force[load].iter().map(|force| f64::from(sense) * force).collect();
        let bend = Bend::find(&signed, length)?;
        let rate_n_per_s = bend.rate / grid.period_s;
        (rate_n_per_s > 0.0 && bend.force_n > 0.0).then(|| Breakaway {
            sense,
            force_n: f64::from(sense) * bend.force_n,
            noise_n: bend.noise_n,
            rise_n: bend.rate,
            rate_n_per_s: f64::from(sense) * rate_n_per_s,
        })
    });
    found.collect()
}

/// Where a load bends: it rises along a parabola while the mass rests, and falls behind that once the mass gives way,
/// which is seen some milliseconds before an encoder shows a motion.
///
/// Static friction gives way to the smaller dynamic one at once, so that the mass sets off with an acceleration, and
/// the damping of what holds it takes force in proportion to the time since. That is the bend. What its spring takes
/// grows with the square of the time and begins without one: fitted beside the bend or in its place, a square begins
/// some milliseconds too early, where the load is less. Each instant counts by its likelihood.
#[derive(Clone, Copy, Debug)]
struct Bend {
    /// Force there, N.
    force_n: f64,
    /// Its standard error, N.
    noise_n: f64,
    /// How fast the load rises there, N a sample.
    rate: f64,
}

impl Bend {
    /// In the load until the motion is seen; it bends from the sample `earliest` on.
    fn find(load: &[f64], earliest: usize) -> Option<Self> {
        let freedom = load.len() as f64 - 4.0;
        let fits: Vec<(f64, Self)> = (earliest..load.len() - 1)
            .filter_map(|at| Self::at(load, at, freedom))
            .collect();
        let least = fits.iter().map(|(square, _)| *square).fold(f64::INFINITY, f64::min);
        let weights = || {
            fits.iter()
                .map(|(square, fit)| (((least - square) * freedom / (2.0 * least)).exp(), fit))
        };
        let sum: f64 = weights().map(|(weight, _)| weight).sum();
        let mean = |of: &dyn Fn(&Self) -> f64| weights().map(|(weight, fit)| weight * of(fit)).sum::<f64>() / sum;
        let force_n = mean(&|fit| fit.force_n);
        let variance = mean(&|fit| fit.noise_n.powi(2) + (fit.force_n - force_n).powi(2));
        (!fits.is_empty()).then(|| Self {
            force_n,
            noise_n: variance.sqrt(),
            rate: mean(&|fit| fit.rate),
        })
    }

    /// The best fit with the bend at a sample, and the sum of squares that it leaves, N^2.
    fn at(load: &[f64], bend: usize, freedom: f64) -> Option<(f64, Self)> {
        let n = load.len() as f64;
        let place = |at: usize| at as f64 / n - 1.0;
        let (mut normal, mut right, mut square) = (Matrix4::zeros(), Vector4::zeros(), 0.0);
        for (at, force) in load.iter().enumerate() {
            let u = place(at);
            let row = Vector4::new(1.0, u, u * u, (u - place(bend)).max(0.0));
            normal += row * row.transpose();
            right += row * *force;
            square += force * force;
        }
        let inverse = normal.try_inverse()?;
        let found = inverse * right;
        // A mass that gives way takes from the load.
        if found[3] > 0.0 {
            return None;
        }
        let left = (square - found.dot(&right)).max(1e-12 * square);
        let u = place(bend);
        let there = Vector4::new(1.0, u, u * u, 0.0);
        let fit = Self {
            force_n: found.dot(&there),
            noise_n: (left / freedom * there.dot(&(inverse * there))).max(0.0).sqrt(),
            rate: (found[1] + 2.0 * found[2] * u) / n,
        };
        Some((left, fit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::sensor::normal;

    #[test]
    fn a_load_bends_where_the_mass_gives_way() {
        let mut random = fastrand::Rng::with_seed(1);
        for noise_n in [0.0, 0.05] {
            let load: Vec<f64> = (0..120_i32)
                .map(|at| 4.0 + 0.02 * f64::from(at - 110) - 0.05 * f64::from((at - 110).max(0)).powi(2))
                .map(|force| force + noise_n * (random.f64() + random.f64() + random.f64() - 1.5) * 2.0)
                .collect();
            let bend = Bend::find(&load, 95).expect("it bends");
            assert!((bend.force_n - 4.0).abs() < 0.03 + noise_n, "{bend:?}");
            assert!((bend.rate - 0.02).abs() < 0.01, "{bend:?}");
            assert!((bend.force_n - 4.0).abs() < 2.5 * bend.noise_n + bend.rate, "{bend:?}");
        }
    }

    /// Slow breakaways, so many each way, of a static friction of 5 N that each draws anew within 5 %.
    fn drawn(each_way: usize, random: &mut fastrand::Rng) -> Vec<Breakaway> {
        let noise_n = 0.02;
        let senses = [1, -1]
            .into_iter()
            .flat_map(|sense| std::iter::repeat_n(sense, each_way));
        senses
            .map(|sense| Breakaway {
                sense,
                force_n: f64::from(sense) * (5.0 * (1.0 + 0.05 * normal(random)) + noise_n * normal(random)),
                noise_n,
                rise_n: 0.001,
                rate_n_per_s: f64::from(sense),
            })
            .collect()
    }

    #[test]
    fn few_breakaways_that_scatter_give_an_interval_that_holds() {
        let mut random = fastrand::Rng::with_seed(1);
        for each_way in [2, 3, 4] {
            let draws = 1000_u32;
            let held: usize = (0..draws)
                .map(|_| {
                    let levels = levels(&drawn(each_way, &mut random)).map(|level| level.expect("breakaways"));
                    levels
                        .iter()
                        .filter(|(force, reach)| (force - 5.0).abs() <= *reach)
                        .count()
                })
                .sum();
            let share = held as f64 / f64::from(2 * draws);
            println!("{each_way} each way: {share}");
            assert!(share >= 0.92, "{each_way} each way: {share}");
        }
        // One each way has no interval; beside others it has theirs.
        let mut one = drawn(1, &mut random);
        assert!(
            levels(&one)
                .into_iter()
                .all(|level| level.is_some_and(|(_, reach)| reach.is_infinite()))
        );
        one.extend(drawn(2, &mut random).into_iter().filter(|each| each.sense == 1));
        let [three, alone] = levels(&one).map(|level| level.expect("breakaways").1);
        assert!(alone.is_finite() && alone > 1.5 * three, "{three} {alone}");
        assert_eq!(levels(&[]), [None; 2]);
    }

    #[test]
    fn a_bend_in_noise_is_not_put_before_the_mass_gives_way() {
        let mut random = fastrand::Rng::with_seed(5);
        // What a grip's damper and spring take of a load that rises by 20 N/s, N a sample and its square.
        for (damper, spring) in [(0.06, 0.01), (0.03, 0.0025)] {
            let draws = 300;
            let mean_n = (0..draws)
                .map(|_| {
                    let load: Vec<f64> = (0..117_i32)
                        .map(|at| (f64::from(at - 110), f64::from((at - 110).max(0))))
                        .map(|(t, gone)| 0.02 * t - damper * gone - spring * gone * gone + 0.1 * normal(&mut random))
                        .map(|force_n| 4.0 + force_n)
                        .collect();
                    Bend::find(&load, 95).map_or(4.0, |bend| bend.force_n)
                })
                .sum::<f64>()
                / f64::from(draws);
            // A square beside the kink would take 0.056 N from the softer one.
            assert!((mean_n - 4.0).abs() < 0.042, "{damper}, {spring}: {mean_n} N");
        }
    }
}
