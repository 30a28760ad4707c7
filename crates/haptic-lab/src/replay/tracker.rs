//! The state of a velocity tracker, found from the velocities that it gave.
//!
//! An alpha-beta-gamma tracker forgets where it began, but not to the last bit: two that follow the
//! same hand may differ for ever in the last bits of their accelerations, which no rounded position
//! shows, and now and then of their velocities. A recording holds every velocity. So an observer that
//! is held to them comes to within rounding of the tracker's state; around it every state is tried,
//! and those stay that give the recorded velocities bit by bit.

use haptic_core::velocity::AlphaBetaGamma;
use haptic_ipc::Sample;

/// Samples after which the observer is at the tracker's state but for rounding: of an error it leaves
/// 0.376 a sample.
const LEARNED_SAMPLES: u32 = 36;

/// Samples after which the observer is asked again where no state fits.
const NEXT_TRY_SAMPLES: u32 = 8;

/// Most states that are tried at once.
const MAX_CANDIDATES: i64 = 200_000;

/// Most units in the last place by which the velocities of two trackers of one hand differ once both have forgotten
/// where they began.
const MAX_ULPS: f64 = 8.0;

/// Whether two velocities of one hand may be those of two trackers, for steps of `step_s`, that have both forgotten
/// where they began: they differ by the rounding of the velocity, and of the position over a step.
pub(super) fn is_by_rounding(step_s: f64, row: &Sample, velocity_mps: f64) -> bool {
    let unit_mps = f64::EPSILON * (row.device_velocity_mps.abs() + row.sample_position_m.abs() / step_s);
    (row.device_velocity_mps - velocity_mps).abs() <= MAX_ULPS * unit_mps
}

/// Finds the state of a tracker.
#[derive(Debug)]
pub(super) struct TrackerSearch {
    observer: AlphaBetaGamma,
    samples: u32,
    candidates: Vec<AlphaBetaGamma>,
    is_over: bool,
}

impl TrackerSearch {
    /// Begins after a row, of a tracker for steps of `period_s`.
    pub(super) fn new(period_s: f64, row: &Sample) -> Self {
        let mut observer = AlphaBetaGamma::new(period_s);
        observer.set_state([row.device_position_m, row.device_velocity_mps, 0.0]);
        Self {
            observer,
            samples: 0,
            candidates: Vec::new(),
            is_over: false,
        }
    }

    /// Whether the tracker is known to the last bit, or begins again.
    pub(super) fn is_over(&self) -> bool {
        self.is_over
    }

    /// Whether there are states that may be the tracker's.
    pub(super) fn is_found(&self) -> bool {
        self.is_over || !self.candidates.is_empty()
    }

    /// The tracker begins again with the next sample: nothing is left to be found.
    pub(super) fn end(&mut self) {
        self.is_over = true;
        self.candidates = Vec::new();
    }

    /// How far the recorded velocity lies from the nearest that a sample so long after the one before may
    /// give, m/s; `None` once the tracker is known.
    pub(super) fn distance_mps(&self, elapsed_s: f64, row: &Sample) -> Option<f64> {
        if self.is_over {
            return None;
        }
        let after = |tracker: &AlphaBetaGamma| {
            let velocity = { *tracker }.update(elapsed_s, row.sample_position_m);
            (velocity - row.device_velocity_mps).abs()
        };
        let nearest = self.candidates.iter().map(after).min_by(f64::total_cmp);
        Some(nearest.unwrap_or_else(|| after(&self.observer)))
    }

    /// The state that the tracker had before a row whose sample was taken so long after the one before,
    /// as far as it is known by now.
    pub(super) fn before(&mut self, elapsed_s: f64, row: &Sample) -> Option<[f64; 3]> {
        if self.is_over {
            return None;
        }
        let known = self.filter(elapsed_s, row);
        self.observe(elapsed_s, row);
        known
    }

    /// Keeps the candidates that give the recorded velocity; returns one of them as it was before.
    fn filter(&mut self, elapsed_s: f64, row: &Sample) -> Option<[f64; 3]> {
        let mut known = None;
        self.candidates.retain_mut(|candidate| {
            let before = candidate.state();
            let velocity = candidate.update(elapsed_s, row.sample_position_m);
            let fits = velocity.to_bits() == row.device_velocity_mps.to_bits();
            if fits {
                known.get_or_insert(before);
            }
            fits
        });
        let bits = |candidate: &AlphaBetaGamma| candidate.state().map(f64::to_bits);
        if let Some((first, others)) = self.candidates.split_first()
            && others.iter().all(|other| bits(other) == bits(first))
        {
            // From here on the tracker itself is exact.
            self.end();
        }
        known
    }

    /// Holds the observer to the recorded velocity.
    fn observe(&mut self, elapsed_s: f64, row: &Sample) {
        let computed = self.observer.update(elapsed_s, row.sample_position_m);
        let [position, _, mut acceleration] = self.observer.state();
        if elapsed_s > 0.0 {
            acceleration -= (computed - row.device_velocity_mps) / elapsed_s;
        }
        let state = [position, row.device_velocity_mps, acceleration];
        self.observer.set_state(state);
        self.samples += 1;
        let is_due = self.samples >= LEARNED_SAMPLES && self.samples.is_multiple_of(NEXT_TRY_SAMPLES);
        if !self.is_over && self.candidates.is_empty() && is_due {
            self.candidates = around(self.observer, elapsed_s);
        }
    }
}

/// All trackers with the velocity of one whose position and acceleration differ from its by rounding.
fn around(tracker: AlphaBetaGamma, elapsed_s: f64) -> Vec<AlphaBetaGamma> {
    let [position, velocity, acceleration] = tracker.state();
    // What a rounded velocity leaves unsaid of the acceleration, and that of the next position.
    let unsaid = 4.0 * ulp(velocity) / elapsed_s;
    let reach = |unsaid: f64, number: f64, least: i64| -> i64 {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "the cast saturates, and a large number is refused"
        )]
        let ulps = (unsaid / ulp(number)).ceil() as i64;
        ulps.max(least)
    };
    let positions = reach(0.25 * elapsed_s * elapsed_s * unsaid, position, 2);
    let accelerations = reach(unsaid, acceleration, 16);
    if positions.saturating_mul(accelerations) > MAX_CANDIDATES / 4 {
        return Vec::new();
    }
    let mut all = Vec::new();
    for up in -positions..=positions {
        for faster in -accelerations..=accelerations {
            let mut candidate = tracker;
            candidate.set_state([step(position, up), velocity, step(acceleration, faster)]);
            all.push(candidate);
        }
    }
    all
}

/// Distance from a number to the next larger one.
fn ulp(number: f64) -> f64 {
    let size = number.abs().max(f64::MIN_POSITIVE);
    size.next_up() - size
}

/// The number a few places up.
fn step(number: f64, places: i64) -> f64 {
    // The bits of numbers of one sign count their size.
    f64::from_bits(number.to_bits().saturating_add_signed(places))
}

#[cfg(test)]
mod tests {
    use super::super::stepper::MAX_MEMORY_SAMPLES;
    use super::*;

    const STEP_S: f64 = 1e-3;

    #[test]
    fn two_trackers_of_one_hand_end_up_within_rounding() {
        let mut random = fastrand::Rng::with_seed(1);
        let mut differ = 0;
        for case in 0..400 {
            let (middle_m, amplitude_m, rad_per_s) =
                (0.2 * (random.f64() - 0.5), 0.05 * random.f64(), 60.0 * random.f64());
            let mut now_s = 0.0;
            let mut trackers = [AlphaBetaGamma::new(STEP_S); 2];
            trackers[0].set_state([0.0, 0.3, -7.0]);
            for sample in 0..4000 {
                let share = match case % 3 {
                    0 => 1.0,
                    1 => 0.9 + 0.2 * random.f64(),
                    _ if random.u8(0..8) == 0 => 30.0 * random.f64(),
                    _ => 0.02 + random.f64(),
                };
                let elapsed_s = share * STEP_S;
                now_s += elapsed_s;
                let position = middle_m + amplitude_m * (rad_per_s * now_s).sin();
                let position = if case % 2 == 0 {
                    position
                } else {
                    (position * 1e5).round() * 1e-5
                };
                let [one, other] = trackers.each_mut().map(|tracker| tracker.update(elapsed_s, position));
                if sample > MAX_MEMORY_SAMPLES {
                    let row = Sample {
                        device_velocity_mps: one,
                        sample_position_m: position,
                        ..Sample::default()
                    };
                    assert!(is_by_rounding(STEP_S, &row, other), "case {case}: {one} and {other}");
                    differ += u32::from(one.to_bits() != other.to_bits());
                }
            }
        }
        assert!(differ > 1000, "{differ}: nothing was put to the test");
    }
}
