//! A hand that reaches for a pointer: where a person points is what the arm pulls the handle to, never where the handle
//! is.
//!
//! News of a pointer come when they come. Between two of them the end of the arm moves evenly, no faster than a hand,
//! and a low pass rounds the corners; it takes hold and lets go gradually. So the force never jumps, whatever comes.

use super::hand::{ARM_DAMPING_NS_PER_M, ARM_STIFFNESS_N_PER_M};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Time without news of the pointer after which the arm has let go, ms.
pub const LETS_GO_AFTER_MS: u32 = 200;

const LETS_GO_AFTER_S: f64 = LETS_GO_AFTER_MS as f64 * 1e-3;

/// Duration of taking hold, and of letting go before that, s.
const GRIP_S: f64 = 0.05;

/// Fastest motion of the arm's end, m/s: that of a quick reach.
const MAX_SPEED_MPS: f64 = 1.0;

/// Largest force with which the arm pulls, N: the usual limit of a rig's own force.
const MAX_PULL_N: f64 = 20.0;

/// The motion to a new place takes the time since the news before, within these bounds, s: a tick of the slowest loop,
/// and a few frames of a window.
const GAP_S: (f64, f64) = (0.01, 0.05);

/// Time constant of the low pass, s. With the bounds above, and the usual arm, no force on a handle at rest changes
/// faster than 1.4 N in a millisecond.
const ROUNDING_S: f64 = 0.02;

/// Where a person points. One thread points, and the loop looks: neither waits for the other.
#[derive(Clone, Debug, Default)]
pub struct Pointer(Arc<AtomicU64>);

impl Pointer {
    /// Points at a place, m.
    #[expect(clippy::cast_possible_truncation, reason = "to 0.1 um within a metre")]
    pub fn point_at(&self, target_m: f64) {
        // The number of the news stands beside the place: also the same place once more is news.
        let number = (self.0.load(Ordering::Relaxed) >> 32).wrapping_add(1);
        let place = u64::from((target_m as f32).to_bits());
        self.0.store((number << 32) | place, Ordering::Relaxed);
    }
}

/// The usual arm, which pulls the handle to where a pointer is. It holds nothing before the pointer's first news.
#[derive(Clone, Debug)]
pub struct PointerArm {
    pointer: Pointer,
    /// The newest news, and their age, s.
    news: u64,
    age_s: f64,
    /// Where the pointer is, m.
    pointed_m: f64,
    /// The even motion to there: place, m, and velocity, m/s.
    even_m: f64,
    even_mps: f64,
    /// The arm's end, which follows that motion: place, m, and velocity, m/s, at the newest time, s.
    end_m: f64,
    end_mps: f64,
    now_s: f64,
    /// How firmly it holds: the share of its force, from 0 to 1.
    grip: f64,
}

impl Default for PointerArm {
    fn default() -> Self {
        Self {
            pointer: Pointer::default(),
            news: 0,
            age_s: f64::INFINITY,
            pointed_m: 0.0,
            even_m: 0.0,
            even_mps: 0.0,
            end_m: 0.0,
            end_mps: 0.0,
            now_s: 0.0,
            grip: 0.0,
        }
    }
}

impl PointerArm {
    /// The pointer that it reaches for.
    #[must_use]
    pub fn pointer(&self) -> &Pointer {
        &self.pointer
    }

    /// Lives through the `elapsed_s` > 0 seconds that end at `now_s`, at the beginning of which the handle is at
    /// `handle_m`.
    pub(super) fn live(&mut self, elapsed_s: f64, now_s: f64, handle_m: f64) {
        self.now_s = now_s;
        self.age_s += elapsed_s;
        self.hear(handle_m);
        let begin_m = self.even_m;
        let (left_m, step_m) = (self.pointed_m - begin_m, self.even_mps * elapsed_s);
        self.even_m += if step_m.abs() < left_m.abs() { step_m } else { left_m };
        // The low pass's answer to a motion that is even within this time: how far its end is behind.
        let steady_m = (self.even_m - begin_m) / elapsed_s * ROUNDING_S;
        let behind_m = steady_m + (begin_m - self.end_m - steady_m) * libm::exp(-elapsed_s / ROUNDING_S);
        let end_m = self.even_m - behind_m;
        self.end_mps = (end_m - self.end_m) / elapsed_s;
        self.end_m = end_m;
        let left_s = LETS_GO_AFTER_S - self.age_s;
        self.grip = (self.grip + elapsed_s / GRIP_S).min((left_s / GRIP_S).clamp(0.0, 1.0));
    }

    /// Takes news of the pointer, if there are any.
    fn hear(&mut self, handle_m: f64) {
        let news = self.pointer.0.load(Ordering::Relaxed);
        if news == self.news {
            return;
        }
        if self.grip == 0.0 {
            // It takes the handle where it is.
            (self.even_m, self.end_m) = (handle_m, handle_m);
        }
        #[expect(clippy::cast_possible_truncation, reason = "the lower half is the place")]
        let place = f32::from_bits(news as u32);
        self.pointed_m = place.into();
        let gap_s = self.age_s.clamp(GAP_S.0, GAP_S.1);
        self.even_mps = ((self.pointed_m - self.even_m) / gap_s).clamp(-MAX_SPEED_MPS, MAX_SPEED_MPS);
        (self.news, self.age_s) = (news, 0.0);
    }

    /// Its force on a handle that rests at `handle_m` in the middle of a step of `h` seconds around `middle_s`, N, and
    /// how much of it each m/s of the handle takes away, N s/m.
    pub(super) fn pull(&self, middle_s: f64, h: f64, handle_m: f64) -> (f64, f64) {
        let end_m = self.end_m - self.end_mps * (self.now_s - middle_s);
        let (stiffness, damping) = (ARM_STIFFNESS_N_PER_M, ARM_DAMPING_NS_PER_M);
        let pull_n = stiffness * (end_m - handle_m) + damping * self.end_mps;
        (
            self.grip * pull_n.clamp(-MAX_PULL_N, MAX_PULL_N),
            self.grip * (0.5 * stiffness * h + damping),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::{Hand, Plant, RigProperties};
    use proptest::prelude::*;

    /// A rig with such a hand, and the newest tick.
    struct TestRig {
        plant: Plant,
        now_s: f64,
    }

    /// What is seen of a tick.
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Seen {
        handle_m: f64,
        handle_mps: f64,
        end_mps: f64,
        /// Force of the arm on the handle, N.
        force_n: f64,
    }

    impl TestRig {
        fn new() -> Self {
            let hand = Hand::Pointer(PointerArm::default());
            Self {
                plant: Plant::new(&RigProperties::default(), hand),
                now_s: 0.0,
            }
        }

        fn arm(&self) -> &PointerArm {
            let Hand::Pointer(arm) = self.plant.hand() else {
                panic!("it has another hand")
            };
            arm
        }

        fn tick(&mut self, elapsed_s: f64, motor_n: f64) -> Seen {
            self.now_s += elapsed_s;
            self.plant.advance(elapsed_s, self.now_s, motor_n);
            let (handle_m, handle_mps) = (self.plant.position_m(), self.plant.velocity_mps());
            let (pull_n, drag) = self.arm().pull(self.now_s, 0.0, handle_m);
            Seen {
                handle_m,
                handle_mps,
                end_mps: self.arm().end_mps,
                force_n: pull_n - drag * handle_mps,
            }
        }
    }

    proptest! {
        #[test]
        fn whatever_a_pointer_does_no_force_jumps_and_silence_frees(
            news in prop::collection::vec((0.0..0.5_f64, -0.1..0.1_f64), 1..12),
            elapsed_s in 0.2e-3..10e-3_f64,
            motor_n in -5.0..5.0_f64,
        ) {
            let mut rig = TestRig::new();
            let mut before = rig.tick(elapsed_s, motor_n);
            for (gap_s, target_m) in news {
                rig.arm().pointer().point_at(target_m);
                let until_s = rig.now_s + gap_s;
                let mut silent_s = -elapsed_s;
                while rig.now_s < until_s {
                    let now = rig.tick(elapsed_s, motor_n);
                    silent_s += elapsed_s;
                    prop_assert!(now.end_mps.abs() <= MAX_SPEED_MPS + 1e-9, "{now:?}");
                    if silent_s >= LETS_GO_AFTER_S {
                        prop_assert_eq!(now.force_n, 0.0, "after {} s", silent_s);
                    }
                    // The grip, the spring and the damper at the arm's end, and both at the handle.
                    let speed_mps = now.handle_mps.abs().max(before.handle_mps.abs());
                    let per_s = (MAX_PULL_N + ARM_DAMPING_NS_PER_M * speed_mps) / GRIP_S
                        + ARM_STIFFNESS_N_PER_M * MAX_SPEED_MPS
                        + ARM_DAMPING_NS_PER_M * 2.0 * MAX_SPEED_MPS / ROUNDING_S;
                    let by_handle_n = ARM_STIFFNESS_N_PER_M * (now.handle_m - before.handle_m).abs()
                        + ARM_DAMPING_NS_PER_M * (now.handle_mps - before.handle_mps).abs();
                    let step_n = (now.force_n - before.force_n).abs();
                    prop_assert!(step_n <= per_s * elapsed_s + by_handle_n + 1e-9, "{before:?} {now:?}");
                    let bound_n = MAX_PULL_N + ARM_DAMPING_NS_PER_M * now.handle_mps.abs();
                    prop_assert!(now.force_n.abs() <= bound_n + 1e-9, "{now:?}");
                    before = now;
                }
            }
        }
    }

    #[test]
    fn the_handle_follows_a_pointer_with_rare_news() {
        let mut rig = TestRig::new();
        let mut seen = rig.tick(1e-3, 0.0);
        for ms in 0..2000_u32 {
            // 30 times a second, at uneven times.
            if ms % 33 == ms / 33 % 7 {
                rig.arm().pointer().point_at(0.03);
            }
            seen = rig.tick(1e-3, 0.0);
        }
        // The guide's friction holds it back.
        let held_back_m = RigProperties::default().friction_n / ARM_STIFFNESS_N_PER_M;
        assert!((seen.handle_m - 0.03).abs() <= held_back_m + 1e-6, "{seen:?}");
        // A motor that holds it makes it lag: that is what is felt.
        for _ in 0..10 {
            rig.arm().pointer().point_at(0.03);
            for _ in 0..100 {
                seen = rig.tick(1e-3, -3.0);
            }
        }
        let lag_m = 3.0 / ARM_STIFFNESS_N_PER_M;
        assert!((0.03 - seen.handle_m - lag_m).abs() <= held_back_m + 1e-6, "{seen:?}");
    }

    #[test]
    fn an_arm_takes_the_handle_where_it_is() {
        let mut rig = TestRig::new();
        for _ in 0..1000 {
            rig.tick(1e-3, 2.0);
        }
        let free = rig.tick(1e-3, 0.0);
        assert!(free.handle_m > 0.1 && free.force_n == 0.0, "{free:?}");
        rig.arm().pointer().point_at(-0.1);
        let held = rig.tick(1e-3, 0.0);
        assert!(held.force_n.abs() < 0.2, "{held:?}");
    }
}
