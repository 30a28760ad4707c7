//! A position is believed only if a hand could have made it: a lone wrong sample is never rendered.
//!
//! A sample that lies aside from where the motion before it leads is held back for one sample. If
//! the next one lies where the motion led, the one between was wrong and is forgotten; if it agrees
//! with the one held back, the hand has really moved so, unless that is faster than the rig allows:
//! then the encoder has jumped.

use crate::limiter::SafetyLimiter;
use crate::snapshot::Archive;
use crate::vector::Vector;

/// How far a sample may lie from where the motion led, m, on the softest surface: below what a hand
/// feels as a kick (0.3 mm are 0.3 N at 1 kN/m). On a stiffer one it may lie as far as makes a step of
/// force that the slew limit lets pass.
const DOUBT_M: f64 = 0.3e-3;

/// What a hand does without being doubted, m/s^2: to hold an honest sample back is a delay under force.
/// Over several milliseconds that is more than [`DOUBT_M`].
const HAND_MPS2: f64 = 200.0;

/// Counts of the encoder within which nothing is doubted.
const DOUBT_COUNTS: f64 = 4.0;

/// What each sample that was forgotten adds to the score, of which every believed one takes one away.
const WRONG: u32 = 20;

/// A sensor with such a score is not to be believed at all: it means five wrong samples within twenty or so.
const MAX_WRONG: u32 = 100;

/// What to do with a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// It is rendered, over the time since the last one that was, s.
    Believed {
        /// Time since the last sample that was believed, s.
        elapsed_s: f64,
    },
    /// It is held back: the next one decides.
    Held,
    /// The encoder has jumped, or its positions are noise: the rig must fault.
    Jumped,
}

/// The sample that is held back.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct HeldBack<V> {
    position: V,
    elapsed_s: f64,
    /// Whether it is farther away than the rig can move.
    too_far: bool,
}

/// Holds each position against the motion before it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PositionGuard<V = f64> {
    held: Option<HeldBack<V>>,
    score: u32,
    forgotten: u64,
}

/// The motion before a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PriorMotion<V = f64> {
    /// The last position that was believed, m.
    pub position: V,
    /// Velocity there, m/s.
    pub velocity: V,
    /// Time over which that was seen, s: since the sample before.
    pub seen_over_s: f64,
    /// Distance between two positions that the device can distinguish, m.
    pub resolution: f64,
    /// Distance that makes as large a step of force as a tick may have, m.
    pub felt: f64,
}

impl<V: Vector> PriorMotion<V> {
    /// Whether nobody doubts that the hand went so far (m) with a velocity (m/s) in a time (s).
    #[inline(always)]
    fn allows(&self, moved: V, velocity: V, elapsed_s: f64, limits: &SafetyLimiter<V>) -> bool {
        self.allows_within(DOUBT_M.min(self.felt), moved, velocity, elapsed_s, limits)
    }

    #[inline(always)]
    fn allows_within(&self, least: f64, moved: V, velocity: V, elapsed_s: f64, limits: &SafetyLimiter<V>) -> bool {
        let doubt = least
            .max(0.5 * HAND_MPS2 * elapsed_s * elapsed_s)
            .max(DOUBT_COUNTS * self.resolution);
        (moved - velocity * elapsed_s).length() <= doubt
            && limits.allows_step(moved, velocity, self.seen_over_s, elapsed_s, self.resolution)
    }
}

impl<V: Vector> PositionGuard<V> {
    /// Saves or loads what it doubts.
    pub(crate) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.option("holds_back", &mut self.held, HeldBack::default(), |archive, held| {
            archive.vector("held_back_m", &mut held.position);
            archive.number("held_back_s", &mut held.elapsed_s);
            archive.flag("held_back_too_far", &mut held.too_far);
        });
        archive.count_u32("doubts", &mut self.score);
        archive.count("forgotten_samples", &mut self.forgotten, u64::MAX);
    }

    /// Samples that were forgotten so far.
    #[must_use]
    pub fn forgotten(&self) -> u64 {
        self.forgotten
    }

    /// The next sample is believed as it is: it is the first, or no force flows that it could change.
    pub fn rest(&mut self) {
        self.held = None;
        self.score = 0;
    }

    /// Judges a position (m), taken `elapsed_s` after the sample before it.
    #[inline(always)]
    pub fn judge(&mut self, before: PriorMotion<V>, position: V, elapsed_s: f64, limits: &SafetyLimiter<V>) -> Verdict {
        let moved = position - before.position;
        if self.held.is_none() && before.allows(moved, before.velocity, elapsed_s, limits) {
            self.score = self.score.saturating_sub(1);
            return Verdict::Believed { elapsed_s };
        }
        self.judge_doubtful(before, position, elapsed_s, limits)
    }

    /// Judges a position that lies aside, or that comes after one.
    #[inline(never)]
    fn judge_doubtful(
        &mut self,
        before: PriorMotion<V>,
        position: V,
        elapsed_s: f64,
        limits: &SafetyLimiter<V>,
    ) -> Verdict {
        let moved = position - before.position;
        let Some(held) = self.held else {
            if !moved.is_finite() {
                return Verdict::Jumped;
            }
            self.held = Some(HeldBack {
                position,
                elapsed_s,
                too_far: !limits.allows_step(moved, before.velocity, before.seen_over_s, elapsed_s, before.resolution),
            });
            return Verdict::Held;
        };
        self.held = None;
        let since_s = held.elapsed_s + elapsed_s;
        // The hand continues as before, or as the held sample reported: an infinite velocity is never
        // allowed.
        let step = position - held.position;
        let velocity = (held.position - before.position) / held.elapsed_s;
        // Of a sample that another one speaks for: on a stiff surface, too, it may lie as far aside as on a soft one.
        let agrees = |velocity: V| before.allows_within(DOUBT_M, step, velocity, elapsed_s, limits);
        let speaks_for_held = !held.too_far && (agrees(before.velocity) || agrees(velocity));
        let aside = |moved: V, velocity: V, elapsed_s: f64| (moved - velocity * elapsed_s).length();
        let is_nearer_to_held = aside(step, before.velocity, elapsed_s).min(aside(step, velocity, elapsed_s))
            < aside(moved, before.velocity, since_s);
        if !(speaks_for_held && is_nearer_to_held) && before.allows(moved, before.velocity, since_s, limits) {
            self.forgotten += 1;
            self.score += WRONG;
            return if self.score > MAX_WRONG {
                Verdict::Jumped
            } else {
                Verdict::Believed { elapsed_s: since_s }
            };
        }
        if speaks_for_held {
            Verdict::Believed { elapsed_s: since_s }
        } else {
            Verdict::Jumped
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limiter::Limits;
    use alloc::vec;
    use alloc::vec::Vec;
    use proptest::prelude::*;

    const TICK_S: f64 = 1e-3;

    const AT_REST: PriorMotion = PriorMotion {
        position: 0.0,
        velocity: 0.0,
        seen_over_s: TICK_S,
        resolution: 1e-5,
        felt: f64::INFINITY,
    };

    fn limits() -> SafetyLimiter {
        SafetyLimiter::new(Limits::default())
    }

    /// What is rendered of positions at 1 kHz, by a device that moves at a steady speed before
    /// them, and how it ended.
    fn rendered(speed: f64, positions: &[f64]) -> (Vec<f64>, Option<usize>, PositionGuard) {
        rendered_at(speed, positions.iter().map(|position| (TICK_S, *position)))
    }

    /// The same of positions, each with the time since the one before, s.
    fn rendered_at(
        speed: f64,
        samples: impl IntoIterator<Item = (f64, f64)>,
    ) -> (Vec<f64>, Option<usize>, PositionGuard) {
        let mut guard = PositionGuard::default();
        let mut motion = PriorMotion {
            position: -speed * TICK_S,
            velocity: speed,
            ..AT_REST
        };
        let mut seen = Vec::new();
        for (k, (elapsed_s, position)) in samples.into_iter().enumerate() {
            match guard.judge(motion, position, elapsed_s, &limits()) {
                Verdict::Believed { elapsed_s } => {
                    motion.velocity = (position - motion.position) / elapsed_s;
                    motion.position = position;
                    motion.seen_over_s = elapsed_s;
                    seen.push(position);
                }
                Verdict::Held => {}
                Verdict::Jumped => return (seen, Some(k), guard),
            }
        }
        (seen, None, guard)
    }

    #[test]
    fn the_sample_after_a_doubtful_one_speaks_for_it_or_against() {
        // To either side of a hand at rest: neither speaks for the other, and neither is where the hand was.
        assert_eq!(rendered(0.0, &[0.0, 0.0, 0.6e-3, -0.6e-3]).1, Some(3));
        // A hand at 0.5 m/s that goes a little further: nearer to the doubtful sample than to the course before it.
        let (seen, jumped, guard) = rendered(0.5, &[0.0, 0.5e-3, 1.35e-3, 1.7e-3]);
        assert_eq!((jumped, guard.forgotten(), seen.last()), (None, 0, Some(&1.7e-3)));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        // hazard: H6
        #[test]
        fn a_lone_wrong_sample_is_never_rendered(
            speed in -1.0..1.0f64, wrong in prop_oneof![0.5e-3..1.0f64, -1.0..-0.5e-3], at in 1..20_usize,
        ) {
            let honest: Vec<f64> = (0..40).map(|k| speed * TICK_S * f64::from(k)).collect();
            let mut read = honest.clone();
            read[at] += wrong;
            let (seen, jumped, guard) = rendered(speed, &read);
            prop_assert_eq!(jumped, None);
            prop_assert_eq!(seen.len(), honest.len() - 1);
            prop_assert!(seen.iter().all(|position| honest.contains(position)));
            prop_assert_eq!(guard.forgotten(), 1);
        }

        /// A hand that shakes with up to 150 m/s^2 loses no sample.
        #[test]
        fn a_hand_is_believed(frequency_hz in 0.1..60.0f64, acceleration in 0.1..150.0f64) {
            let omega = core::f64::consts::TAU * frequency_hz;
            let amplitude = (acceleration / (omega * omega)).min(0.1);
            let positions: Vec<f64> = (0..500).map(|k| amplitude * libm::sin(omega * TICK_S * f64::from(k))).collect();
            let (seen, jumped, _) = rendered(amplitude * omega, &positions);
            prop_assert_eq!(jumped, None);
            prop_assert_eq!(seen.len(), positions.len());
        }

        /// A loop that stands still for up to 0.3 s, and then looks again at once, as one does that makes up for what
        /// it missed: the hand that went on meanwhile, or turned, has not jumped.
        #[test]
        fn a_hand_has_not_jumped_while_nobody_looked(
            frequency_hz in 0.1..60.0f64,
            acceleration in 0.1..150.0f64,
            pauses in prop::collection::vec((1e-3..0.3f64, 0.05e-3..1e-3f64, 1..20_usize), 1..10),
        ) {
            let omega = core::f64::consts::TAU * frequency_hz;
            let amplitude = (acceleration / (omega * omega)).min(0.1);
            let mut time_s = 0.0;
            let elapsed = pauses.iter().flat_map(|&(pause_s, soon_s, ticks)| {
                [pause_s, soon_s].into_iter().chain(core::iter::repeat_n(TICK_S, ticks))
            });
            let counted = |position: f64| 1e-5 * libm::round(position / 1e-5);
            let samples = elapsed.map(|elapsed_s| {
                time_s += elapsed_s;
                (elapsed_s, counted(amplitude * libm::sin(omega * time_s)))
            });
            let (_, jumped, guard) = rendered_at(amplitude * omega, core::iter::once((TICK_S, 0.0)).chain(samples));
            prop_assert_eq!((jumped, guard.forgotten()), (None, 0));
        }
    }

    #[test]
    fn lasting_step_is_believed_one_sample_late() {
        let step: Vec<f64> = (0..10).map(|k| if k < 5 { 0.0 } else { 0.8e-3 }).collect();
        let (seen, jumped, _) = rendered(0.0, &step);
        assert_eq!((seen[4..6].to_vec(), jumped), (vec![0.0, 0.8e-3], None));
        // The velocity that the step seems to have is doubted as well.
        assert_eq!(seen.len(), 8, "held twice");
        let jump: Vec<f64> = (0..10).map(|k| if k < 5 { 0.0 } else { 3e-3 }).collect();
        let (seen, jumped, _) = rendered(0.0, &jump);
        assert_eq!(
            (seen.len(), jumped),
            (5, Some(6)),
            "faulted in the sample that confirms it, and never rendered"
        );
        assert!(seen.iter().all(|position| *position == 0.0));
    }

    // hazard: H6
    #[test]
    fn pulled_hand_is_believed_once_next_sample_confirms() {
        // From rest to 0.8 m/s within a sample, and on at that speed.
        let pulled = [0.0, 0.0, 0.8e-3, 1.6e-3, 2.4e-3];
        let (seen, jumped, guard) = rendered(0.0, &pulled);
        assert_eq!((seen, jumped), (vec![0.0, 0.0, 1.6e-3, 2.4e-3], None));
        assert_eq!(guard.forgotten(), 0);
    }

    #[test]
    fn after_a_gap_a_hand_may_be_farther_away() {
        // 5 mm in 10 ms from rest are 100 m/s^2.
        let judged = |elapsed_s| PositionGuard::default().judge(AT_REST, 5e-3, elapsed_s, &limits());
        assert_eq!(judged(0.01), Verdict::Believed { elapsed_s: 0.01 });
        assert_eq!(judged(TICK_S), Verdict::Held);
    }

    // hazard: H25
    #[test]
    fn stiff_surface_doubts_samples_making_a_force_step() {
        let judged = |felt: f64, resolution: f64, moved: f64, elapsed_s: f64| {
            let at_rest = PriorMotion {
                resolution,
                felt,
                ..AT_REST
            };
            PositionGuard::default().judge(at_rest, moved, elapsed_s, &limits()) == Verdict::Held
        };
        // 5 N in a tick at 25 kN/m and 10 N s/m, at 1 kHz: 0.143 mm.
        let felt = 5.0 / (25e3 + 10.0 / TICK_S);
        for (felt, resolution, doubted_m) in [
            (felt, 1e-5, felt),
            (f64::INFINITY, 1e-5, DOUBT_M),
            // However stiff: 100 m/s^2 for a tick, and four counts.
            (1e-6, 1e-5, 0.1e-3),
            (1e-6, 0.1e-3, 0.4e-3),
        ] {
            assert!(
                !judged(felt, resolution, 0.99 * doubted_m, TICK_S),
                "{felt} {resolution}"
            );
            assert!(
                judged(felt, resolution, 1.01 * doubted_m, TICK_S),
                "{felt} {resolution}"
            );
        }
        assert!(
            !judged(1e-6, 1e-5, 0.4e-3, 2.0 * TICK_S),
            "in twice the time four times as far"
        );
    }

    // hazard: H25
    #[test]
    fn held_sample_is_believed_when_next_roughly_agrees() {
        // A hand that hits something: 0.25 mm aside, and from there nearly as far aside again.
        for second in [0.0, 0.2e-3, 0.29e-3, 0.45e-3] {
            let felt = 0.14e-3;
            let at_rest = PriorMotion { felt, ..AT_REST };
            let mut guard = PositionGuard::default();
            assert_eq!(guard.judge(at_rest, 0.25e-3, TICK_S, &limits()), Verdict::Held);
            let elapsed_s = 2.0 * TICK_S;
            assert_eq!(
                guard.judge(at_rest, 0.25e-3 + second, TICK_S, &limits()),
                Verdict::Believed { elapsed_s },
                "{second}"
            );
            assert_eq!(guard.forgotten(), 0);
        }
    }

    // hazard: H6
    #[test]
    fn the_sixth_wrong_sample_among_few_honest_ones_is_a_jump() {
        let alternating: Vec<f64> = (0..20).map(|k| if k % 2 == 1 { 0.01 } else { 0.0 }).collect();
        let (_, jumped, guard) = rendered(0.0, &alternating);
        assert_eq!((jumped, guard.forgotten()), (Some(12), 6));
    }

    #[test]
    fn a_guard_at_rest_has_forgotten_the_held_sample_and_the_score() {
        let mut guard = PositionGuard::default();
        assert_eq!(guard.forgotten(), 0);
        for _ in 0..20 {
            assert_eq!(guard.judge(AT_REST, 0.01, TICK_S, &limits()), Verdict::Held);
            guard.rest();
            assert_eq!(
                guard.judge(AT_REST, 0.0, TICK_S, &limits()),
                Verdict::Believed { elapsed_s: TICK_S }
            );
        }
        assert_eq!(guard.forgotten(), 0);
    }

    #[test]
    fn noise_is_a_jump() {
        let noise: Vec<f64> = (0..40).map(|k| if k % 3 == 2 { 0.01 } else { 0.0 }).collect();
        let (seen, jumped, _) = rendered(0.0, &noise);
        assert!(jumped.is_some_and(|at| at < 25), "{jumped:?}");
        assert!(seen.iter().all(|position| *position == 0.0));
        let (_, jumped, _) = rendered(0.0, &[0.0, f64::NAN, 0.0]);
        assert_eq!(jumped, Some(1));
    }
}
