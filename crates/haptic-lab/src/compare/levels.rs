//! Levels of friction by direction: while sliding, and where a pull sets off.

use super::Side;
use super::signal::Signal;
use haptic_motion::median::middle;
use serde::Serialize;

/// Shortest slide that counts, and shortest rest before a breakaway, s.
const MIN_S: f64 = 0.05;
/// Slides count from this share of the fastest speeds on: at a turn it is not sure which way friction
/// points.
const SLOWEST_SHARE: f64 = 0.05;
/// Samples that are faster than this share of them do not decide which speeds are fast.
const FASTEST_SHARE: f64 = 0.95;
/// A breakaway is over after this distance or this time: a rendered block sets off once its coupling is
/// stretched, 0.2 mm for 2 N at 25 N/mm after a turn.
const BREAKAWAY_M: f64 = 5e-4;
const BREAKAWAY_S: f64 = 1.0;
/// Fastest breakaway that counts, m/s, at the peak of the force: beyond it the peak is inertia's.
const SLOW_MPS: f64 = 0.01;
/// Half the time over which the force is averaged where its peak is looked for, s: a sensor's noise
/// has peaks of its own.
const HALF_MEAN_S: f64 = 0.005;
/// Velocities at which force is compared, by direction.
const BINS: usize = 20;

/// A level of both records.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Level {
    /// Of the real record, N, against the motion.
    #[serde(rename = "real_N")]
    pub real_n: f64,
    /// Of the rendered record, N, against the motion.
    #[serde(rename = "rendered_N")]
    pub rendered_n: f64,
    /// Rendered less real, N.
    #[serde(rename = "difference_N")]
    pub difference_n: f64,
    /// The same in percent of the real level.
    pub difference_percent: f64,
    /// Slides, breakaways or velocities that it is taken from.
    pub count: usize,
}

/// A level by direction of motion; absent where a record does not hold it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Levels {
    /// In positive direction.
    pub positive: Option<Level>,
    /// In negative direction.
    pub negative: Option<Level>,
}

impl Levels {
    fn of(level: impl Fn(f64) -> Option<Level>) -> Self {
        Self {
            positive: level(1.0),
            negative: level(-1.0),
        }
    }
}

fn level(real_n: f64, rendered_n: f64, count: usize) -> Level {
    let difference_n = rendered_n - real_n;
    Level {
        real_n,
        rendered_n,
        difference_n,
        difference_percent: 100.0 * difference_n / real_n.abs(),
        count,
    }
}

/// Speeds at which a motion counts as sliding.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlidingLimits {
    slowest_mps: f64,
    fastest_mps: f64,
}

impl SlidingLimits {
    /// The limits that hold for both.
    pub(super) fn of(signals: [&Signal; 2]) -> Self {
        let fastest_mps = signals.map(fast_speed).into_iter().fold(f64::INFINITY, f64::min);
        let noise = signals
            .map(|signal| signal.step_m / MIN_S)
            .into_iter()
            .fold(0.0, f64::max);
        Self {
            slowest_mps: (SLOWEST_SHARE * fastest_mps).max(noise),
            fastest_mps,
        }
    }
}

#[expect(clippy::cast_sign_loss, reason = "an index")]
fn fast_speed(signal: &Signal) -> f64 {
    let mut speeds: Vec<f64> = signal.outside_gaps(&signal.velocity_mps).map(f64::abs).collect();
    speeds.sort_unstable_by(f64::total_cmp);
    let at = (FASTEST_SHARE * speeds.len().saturating_sub(1) as f64) as usize;
    speeds.get(at).copied().unwrap_or(0.0)
}

/// Sliding levels of two signals of the same motion, each over its own slides: masses that differ slide at speeds that
/// differ. A slide is counted from where it becomes fast enough to where it is no longer: at both ends it has the same
/// speed, so that what inertia adds at first it takes away in the end.
pub(super) fn sliding_together(real: &Signal, rendered: &Signal, limits: &SlidingLimits) -> Levels {
    let least = real.samples_in(MIN_S);
    let mean_of = |signal: &Signal, direction: f64| {
        let (mut sum, mut samples, mut slides) = (0.0, 0, 0);
        let slides_at = |index| {
            let is_in_gap = real.is_in_gap[index] || rendered.is_in_gap[index];
            !is_in_gap && signal.velocity_mps[index] * direction > limits.slowest_mps
        };
        let is_sliding: Vec<bool> = (0..signal.len()).map(slides_at).collect();
        let mut begin = 0;
        for run in is_sliding.chunk_by(|a, b| a == b) {
            let range = begin..begin + run.len();
            begin = range.end;
            if run[0] && run.len() >= least {
                sum += signal.force_n[range].iter().sum::<f64>();
                (samples, slides) = (samples + run.len(), slides + 1);
            }
        }
        (slides > 0).then(|| (direction * sum / samples as f64, slides))
    };
    Levels::of(|direction| {
        let ((own, slides), (other, others)) = (mean_of(real, direction)?, mean_of(rendered, direction)?);
        Some(level(own, other, slides.min(others)))
    })
}

/// Mean forces of both at a velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bin {
    pub(super) velocity_mps: f64,
    pub(super) real_n: f64,
    pub(super) rendered_n: f64,
}

/// Forces of both at the velocities that both have.
pub(super) fn by_velocity(real: &Signal, rendered: &Signal, limits: &SlidingLimits) -> Vec<Bin> {
    let (slowest, fastest) = (limits.slowest_mps, limits.fastest_mps);
    let width = (fastest - slowest) / BINS as f64;
    if width <= 0.0 || !width.is_finite() {
        return Vec::new();
    }
    let means = |signal: &Signal, direction: f64| {
        let mut sums = [(0.0, 0_usize); BINS];
        let velocities = signal.outside_gaps(&signal.velocity_mps);
        for (velocity, force) in velocities.zip(signal.outside_gaps(&signal.friction_n)) {
            let place = (velocity * direction - slowest) / width;
            if place >= 0.0 && place < BINS as f64 {
                #[expect(clippy::cast_sign_loss, reason = "it is a bin")]
                let bin = &mut sums[place as usize];
                *bin = (bin.0 + force, bin.1 + 1);
            }
        }
        let least = signal.samples_in(0.5 * MIN_S);
        sums.map(|(sum, count)| (count >= least).then(|| sum / count as f64))
    };
    let curve = [-1.0, 1.0].into_iter().flat_map(|direction| {
        let pairs = means(real, direction).into_iter().zip(means(rendered, direction));
        pairs.enumerate().filter_map(move |(index, (real_n, rendered_n))| {
            Some(Bin {
                velocity_mps: direction * (slowest + (index as f64 + 0.5) * width),
                real_n: real_n?,
                rendered_n: rendered_n?,
            })
        })
    });
    let mut curve: Vec<Bin> = curve.collect();
    curve.sort_by(|a, b| a.velocity_mps.total_cmp(&b.velocity_mps));
    curve
}

/// Sliding levels of two signals of different motions: the means over the velocities that both have.
pub(super) fn sliding_at_common_speeds(curve: &[Bin]) -> Levels {
    Levels::of(|direction| {
        let bins: Vec<&Bin> = curve.iter().filter(|bin| bin.velocity_mps * direction > 0.0).collect();
        let mean =
            |force: fn(&Bin) -> f64| direction * bins.iter().map(|bin| force(bin)).sum::<f64>() / bins.len() as f64;
        (!bins.is_empty()).then(|| level(mean(|bin| bin.real_n), mean(|bin| bin.rendered_n), bins.len()))
    })
}

/// A slow pull that sets off: its samples from the rest on, and its direction.
#[derive(Clone, Debug)]
struct Breakaway {
    direction: f64,
    /// The greatest force, N, along its direction.
    peak_n: f64,
}

/// The breakaways of a signal.
fn breakaways(signal: &Signal) -> Vec<Breakaway> {
    let rest_m = (1.5 * signal.step_m).max(1e-6);
    let (rest, longest) = (signal.samples_in(MIN_S), signal.samples_in(BREAKAWAY_S));
    let half_mean = signal.samples_in(HALF_MEAN_S);
    let force_n = signal.mean_of(&signal.force_n, half_mean);
    let mut found = Vec::new();
    let mut begin = 0;
    while begin < signal.len() {
        let away = |index: &usize| signal.position_m[*index] - signal.position_m[begin];
        let Some(leaves) = (begin..signal.len()).find(|index| away(index).abs() > rest_m) else {
            break;
        };
        if leaves - begin < rest {
            begin += 1;
            continue;
        }
        let direction = away(&leaves).signum();
        let latest = (leaves + longest).min(signal.len());
        let end = (leaves..latest)
            .find(|index| away(index).abs() > BREAKAWAY_M)
            .unwrap_or(latest);
        let along = |index: &usize| direction * force_n[*index];
        let samples = leaves - rest..end;
        let peak = samples.clone().max_by(|a, b| along(a).total_cmp(&along(b)));
        // What it slips by afterwards, on a soft grip, is fast, and lessens the force.
        let is_slow = peak.is_some_and(|peak| {
            let before = leaves..peak.saturating_sub(half_mean).max(leaves);
            signal.velocity_mps[before]
                .iter()
                .all(|velocity| velocity.abs() < SLOW_MPS)
        });
        // A rest that is only jostled is not one that is left.
        let is_left = away(&(end - 1)) * direction > 4.0 * rest_m;
        let is_whole = !signal.is_in_gap[samples].contains(&true);
        if let Some(peak) = peak.filter(|_| is_slow && is_left && is_whole) {
            found.push(Breakaway {
                direction,
                peak_n: along(&peak),
            });
        }
        begin = leaves;
    }
    found
}

fn peaks(breakaways: &[Breakaway], direction: f64) -> Vec<f64> {
    let that_way = breakaways.iter().filter(|breakaway| breakaway.direction == direction);
    that_way.map(|breakaway| breakaway.peak_n).collect()
}

/// Breakaway levels, each from the record's own pulls: a stiffer surface sets off later. With them, what says which
/// record has no pull that way.
pub(super) fn breakaway(real: &Signal, rendered: &Signal) -> (Levels, Vec<String>) {
    let pulls = [(Side::Real, breakaways(real)), (Side::Rendered, breakaways(rendered))];
    let levels = Levels::of(|direction| {
        let [own, other] = pulls.each_ref().map(|(_, pulls)| peaks(pulls, direction));
        let count = own.len().min(other.len());
        Some(level(middle(own)?, middle(other)?, count))
    });
    let mut notes = Vec::new();
    for (side, pulls) in &pulls {
        for (name, direction) in [("positive", 1.0), ("negative", -1.0)] {
            if peaks(pulls, direction).is_empty() {
                notes.push(format!(
                    "no breakaway level in {name} direction: the {side} record has no rest of 50 ms that a pull of \
                     1 mm/s or slower ends that way"
                ));
            }
        }
    }
    (levels, notes)
}
