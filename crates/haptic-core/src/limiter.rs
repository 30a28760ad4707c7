//! The last gate before the motor: what leaves it is finite, within the rig's force limit, and no
//! faster in changing than the rig allows. And the speed beyond which a hand, or an encoder, is out
//! of control.

use crate::snapshot::Archive;
use crate::vector::Vector;
use thiserror::Error;

/// What a rig allows. A limit that is not a number, or negative, counts as zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Limits {
    /// Largest force on the hand, N (> 0).
    #[cfg_attr(feature = "serde", serde(rename = "force_N"))]
    pub force_n: f64,
    /// Fastest change of the force, N/s (> 0). Zero force is never held back.
    #[cfg_attr(feature = "serde", serde(rename = "slew_N_per_s"))]
    pub slew_n_per_s: f64,
    /// Largest speed of the device, m/s (> 0).
    pub speed_mps: f64,
    /// Largest acceleration of the device, m/s^2 (> 0): anything faster is an encoder jump.
    pub acceleration_mps2: f64,
}

/// Those of the daemon where nobody names others.
impl Default for Limits {
    fn default() -> Self {
        Self {
            force_n: 20.0,
            slew_n_per_s: 5000.0,
            speed_mps: 5.0,
            acceleration_mps2: 2000.0,
        }
    }
}

impl Limits {
    /// These, with zero for what is no limit: where in doubt, no force.
    fn checked(self) -> Self {
        let positive = |limit: f64| if limit > 0.0 { limit } else { 0.0 };
        Self {
            force_n: positive(self.force_n),
            slew_n_per_s: positive(self.slew_n_per_s),
            speed_mps: positive(self.speed_mps),
            acceleration_mps2: positive(self.acceleration_mps2),
        }
    }
}

/// Counts by which two positions may differ without the device having moved otherwise than was foreseen.
const COUNTS_OF_DOUBT: f64 = 4.0;

/// Longest time in which a force is taken down to a lower limit, s.
pub const MAX_LOWERING_S: f64 = 0.2;

/// Clamps forces and lets nothing through that is not a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetyLimiter<V = f64> {
    limits: Limits,
    /// The configured limit of force as far as its ramp has come, N.
    configured_n: f64,
    /// How fast that moves to the limit, N/s; 0 once it is there.
    move_n_per_s: f64,
    /// Largest force that passes, N: the smaller of the configured limit and the device's own.
    force_n: f64,
    last_n: V,
}

/// A force that is not a finite number: the rig must fault, at zero force.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("the force computed is {0} N, not a finite number")]
pub struct NonFiniteForce(pub f64);

impl<V: Vector> SafetyLimiter<V> {
    /// Saves or loads where its force and its limit are.
    pub(crate) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("configured_N", &mut self.configured_n);
        archive.number("move_N_per_s", &mut self.move_n_per_s);
        archive.number("force_N", &mut self.force_n);
        archive.vector("last_N", &mut self.last_n);
    }

    /// A gate that begins without force.
    #[must_use]
    pub fn new(limits: Limits) -> Self {
        let limits = limits.checked();
        Self {
            limits,
            configured_n: limits.force_n,
            move_n_per_s: 0.0,
            force_n: limits.force_n,
            last_n: V::ZERO,
        }
    }

    /// Continues with other limits. Each holds at once but for the limit of force: a higher one takes effect over
    /// `ramp_s`. A lower one lets no force grow beyond it from now on, and takes a force that is beyond it already
    /// down to it in that time, at most [`MAX_LOWERING_S`].
    pub fn set_limits(&mut self, limits: Limits, ramp_s: f64) {
        let limits = limits.checked();
        if limits == self.limits {
            return;
        }
        self.limits = limits;
        let to_n = limits.force_n;
        self.configured_n = self.configured_n.min(to_n.max(self.last_n.length()));
        let change_n = to_n - self.configured_n;
        let time_s = if change_n < 0.0 {
            ramp_s.min(MAX_LOWERING_S)
        } else {
            ramp_s
        };
        self.move_n_per_s = change_n / time_s;
        if !self.move_n_per_s.is_finite() {
            // There is no time to move in.
            self.arrive();
        }
    }

    /// Whether the limit of force is yet to come to its new value.
    pub(crate) fn is_moving(&self) -> bool {
        self.move_n_per_s != 0.0
    }

    /// Moves the limit of force towards its new value for a time, s.
    pub(crate) fn advance(&mut self, elapsed_s: f64) {
        let moved_n = self.configured_n + self.move_n_per_s * elapsed_s;
        let to_n = self.limits.force_n;
        let is_there = if self.move_n_per_s > 0.0 {
            moved_n >= to_n
        } else {
            moved_n <= to_n
        };
        if is_there {
            self.arrive();
        } else {
            self.configured_n = moved_n;
        }
    }

    fn arrive(&mut self) {
        self.configured_n = self.limits.force_n;
        self.move_n_per_s = 0.0;
    }

    /// Another device is there, which gives this force at most, N (>= 0; infinite where it names
    /// no limit). NaN counts as 0 N.
    pub fn set_device_force(&mut self, force_n: f64) {
        self.force_n = if force_n >= self.configured_n {
            self.configured_n
        } else {
            force_n.max(0.0)
        };
    }

    /// The largest force that passes, N: the smaller of the configured limit and the device's own.
    #[must_use]
    pub fn force_n(&self) -> f64 {
        self.force_n
    }

    /// Scales `force` (N) by `gain` in 0..1, cuts it to the limit, and lets it go no farther from
    /// the last one than `elapsed_s` allows. To zero it may go at once, and beyond zero by what the step to it has
    /// left.
    ///
    /// # Errors
    /// [`NonFiniteForce`] where the product is not a finite number.
    #[inline]
    pub fn limit(&mut self, force: V, gain: f64, elapsed_s: f64) -> Result<V, NonFiniteForce> {
        let limited = self.limited(force, gain, elapsed_s);
        self.last_n = limited.unwrap_or(V::ZERO);
        limited
    }

    /// What [`limit`](Self::limit) would let pass, N.
    #[inline(always)]
    pub(crate) fn limited(&self, force: V, gain: f64, elapsed_s: f64) -> Result<V, NonFiniteForce> {
        let wanted = (force * gain.clamp(0.0, 1.0)).flushed();
        if !wanted.is_finite() {
            return Err(NonFiniteForce(wanted.length()));
        }
        // Zero is safe at any rate; more force, or force the other way, is not. Without a limit on the slew the step of
        // no time is not a number.
        let step = self.step_n(elapsed_s.max(0.0));
        let reached = wanted.within(self.force_n).reached_from(self.last_n, step);
        // The sum may round to beyond the limit.
        Ok(reached.within(self.force_n))
    }

    /// How far the force may go in a time, s, N.
    #[inline(always)]
    pub(crate) fn step_n(&self, elapsed_s: f64) -> f64 {
        self.limits.slew_n_per_s * elapsed_s
    }

    /// The force that was let pass, N.
    pub(crate) fn passed(&mut self, force: V) {
        self.last_n = force;
    }

    /// The force is zero now, whatever it was: no hand feels a limit that moves.
    pub fn zero(&mut self) {
        self.last_n = V::ZERO;
        self.arrive();
    }

    /// Whether a device that had a velocity (m/s), seen over a time (s), can have moved so far (m) in the time (s)
    /// after that, counting with a resolution (m). NaN cannot.
    #[must_use]
    pub fn allows_step(&self, moved: V, velocity: V, seen_over_s: f64, elapsed_s: f64, resolution: f64) -> bool {
        // At its end the hand may have been faster or slower than in the mean of a long time.
        let changing_s = elapsed_s.max(seen_over_s);
        // The velocity is an estimate from positions, good to about a count a sample.
        let unforeseen = 0.5 * self.limits.acceleration_mps2 * elapsed_s * changing_s + COUNTS_OF_DOUBT * resolution;
        (moved - velocity * elapsed_s).length() <= unforeseen
    }

    /// Whether a velocity (m/s) is within the limit; NaN is not.
    #[must_use]
    pub fn allows_speed(&self, velocity: V) -> bool {
        velocity.length() <= self.limits.speed_mps
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits {
        force_n: 20.0,
        slew_n_per_s: 1000.0,
        speed_mps: 5.0,
        acceleration_mps2: 2000.0,
    };

    fn with(force_n: f64, slew_n_per_s: f64) -> Limits {
        Limits {
            force_n,
            slew_n_per_s,
            ..LIMITS
        }
    }

    #[test]
    fn what_is_no_limit_lets_no_force_through() {
        for wrong in [f64::NAN, -1.0, f64::NEG_INFINITY, 0.0] {
            for limits in [with(wrong, 1000.0), with(20.0, wrong)] {
                let begun_with = SafetyLimiter::new(limits);
                let mut changed = SafetyLimiter::new(LIMITS);
                changed.set_limits(limits, 0.2);
                for mut limiter in [begun_with, changed] {
                    limiter.set_device_force(f64::INFINITY);
                    assert_eq!(limiter.limit(3.0, 1.0, 1.0), Ok(0.0), "{limits:?}");
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        // hazard: P1, H25
        #[test]
        fn whatever_comes_in_stays_within_the_limits(
            // NaN and infinity come as well.
            steps in prop::collection::vec((prop::num::f64::ANY, prop::num::f64::ANY, -1e-3..0.1f64), 1..40),
            force_n in 0.1..100.0, slew_n_per_s in 1.0..1e6,
        ) {
            let mut limiter = SafetyLimiter::new(with(force_n, slew_n_per_s));
            let mut last = 0.0_f64;
            for (force, gain, elapsed_s) in steps {
                match limiter.limit(force, gain, elapsed_s) {
                    Ok(limited) => {
                        prop_assert!((force * gain.clamp(0.0, 1.0)).is_finite(), "{limited} N from NaN or infinity");
                        prop_assert!(limited.abs() <= force_n);
                        let allowed = slew_n_per_s * elapsed_s.max(0.0) * (1.0 + 1e-12) + 1e-12;
                        let more = if last * limited < 0.0 {
                            last.abs() + limited.abs()
                        } else {
                            limited.abs() - last.abs()
                        };
                        prop_assert!(more <= allowed, "from {last} N to {limited} N in {elapsed_s} s");
                        last = limited;
                    }
                    Err(NonFiniteForce(value)) => {
                        prop_assert!(!value.is_finite());
                        last = 0.0;
                    }
                }
            }
        }
    }

    // hazard: H8
    #[test]
    fn the_smaller_of_the_two_force_limits_holds() {
        let mut limiter = SafetyLimiter::new(with(20.0, 1e9));
        let mut limit = |device_n: f64, force: f64| {
            limiter.set_device_force(device_n);
            limiter.limit(force, 1.0, 1e-3).expect("a number")
        };
        assert_eq!([limit(1.0, 5.0), limit(1.0, -5.0)], [1.0, -1.0], "the device's");
        assert_eq!(
            [limit(100.0, 50.0), limit(f64::INFINITY, 50.0)],
            [20.0, 20.0],
            "the configured one"
        );
        assert_eq!([limit(0.0, 5.0), limit(f64::NAN, 5.0), limit(-1.0, 5.0)], [0.0; 3]);
    }

    // hazard: H21
    #[test]
    fn changed_force_limit_ramps_without_a_step() {
        let with = |force_n| with(force_n, 1e9);
        let step = |limiter: &mut SafetyLimiter, wanted: f64| {
            limiter.advance(1e-3);
            limiter.set_device_force(f64::INFINITY);
            limiter.limit(wanted, 1.0, 1e-3).expect("a number")
        };
        for (sign, ramp_s, steps) in [(1.0, 0.1, 100), (-1.0, 10.0, 200)] {
            let mut limiter = SafetyLimiter::new(with(20.0));
            assert_eq!(step(&mut limiter, sign * 12.0), sign * 12.0);
            limiter.set_limits(with(4.0), ramp_s);
            let mut last = 12.0;
            for index in 0..steps {
                // The same limits once more begin no new ramp.
                limiter.set_limits(with(4.0), ramp_s);
                let now = sign * step(&mut limiter, sign * 12.0);
                let fallen = last - now;
                assert!(
                    fallen > 0.0 && fallen < 8.0 / f64::from(steps) * 1.001,
                    "{fallen} N in step {index}"
                );
                last = now;
            }
            assert!((last - 4.0).abs() < 1e-9, "{last} N after {steps} ms");
            step(&mut limiter, 0.0);
            assert_eq!(step(&mut limiter, 12.0), 4.0);

            limiter.set_limits(with(20.0), 0.1);
            assert!(limiter.is_moving());
            for index in 1..=101 {
                let now = step(&mut limiter, 30.0);
                let expected = (4.0 + 0.16 * f64::from(index)).min(20.0);
                assert!((now - expected).abs() < 1e-9, "{now} N in step {index}");
            }
            assert!(!limiter.is_moving());
        }

        // A force below the lower limit does not grow beyond it any more.
        let mut limiter = SafetyLimiter::new(with(20.0));
        step(&mut limiter, 3.0);
        limiter.set_limits(with(4.0), 0.1);
        assert_eq!(step(&mut limiter, 12.0), 4.0);
        // A ramp of no time is none.
        for force_n in [4.0, 2.0, 9.0, 9.0] {
            let mut limits = with(force_n);
            limits.speed_mps = force_n;
            limiter.set_limits(limits, 0.0);
            assert_eq!(step(&mut limiter, 12.0), force_n);
        }
        limiter.set_limits(with(4.0), 0.0);
        // Without force a higher one holds at once.
        limiter.set_limits(with(20.0), 0.1);
        limiter.zero();
        assert!(!limiter.is_moving());
        assert_eq!(step(&mut limiter, 12.0), 12.0);
    }

    #[test]
    fn a_motion_is_distinguished_from_a_jump_of_the_encoder() {
        let limiter = SafetyLimiter::new(LIMITS);
        let allows = |moved, velocity, elapsed_s| limiter.allows_step(moved, velocity, 0.0, elapsed_s, 1e-5);
        assert!(allows(1e-3, 1.0, 1e-3) && allows(1.9e-3, 1.0, 1e-3) && allows(0.1e-3, 1.0, 1e-3));
        assert!(!allows(3e-3, 1.0, 1e-3) && !allows(-1e-3, 1.0, 1e-3));
        // In a shorter time less can change, and a count more or less still is none.
        assert!(allows(3e-5, 0.0, 50e-6) && !allows(1e-4, 0.0, 50e-6));
        // After a gap a hand may be anywhere that it can have gone to.
        assert!(allows(0.05, 0.0, 20e-3) && !allows(0.5, 0.0, 20e-3));
        assert!(!allows(f64::NAN, 0.0, 1e-3) && !allows(0.0, f64::INFINITY, 1e-3));
    }

    /// A gate that a force has passed.
    fn at(force: f64) -> SafetyLimiter {
        let mut limiter = SafetyLimiter::new(LIMITS);
        assert_eq!(limiter.limit(force, 1.0, 1.0), Ok(force));
        limiter
    }

    #[test]
    fn the_gain_is_a_share_and_never_more_than_all() {
        for (gain, expected) in [(0.0, 0.0), (0.25, 2.0), (1.0, 8.0), (2.0, 8.0), (-1.0, 0.0)] {
            assert_eq!(SafetyLimiter::new(LIMITS).limit(8.0, gain, 1.0), Ok(expected), "{gain}");
        }
    }

    #[test]
    fn a_force_that_turns_round_makes_one_step_and_not_two() {
        // Of 1 N in a millisecond, a tenth.
        let next = |last: f64, wanted: f64| at(last).limit(wanted, 1.0, 1e-4).expect("a number");
        for sign in [1.0, -1.0] {
            assert_eq!(next(sign * 3.0, sign * -0.5), 0.0, "a smaller one the other way");
            assert_eq!(next(sign * 3.0, sign * -5.0), 0.0, "a larger one the other way");
            assert!(
                (next(sign * 0.04, sign * -5.0) - sign * -0.06).abs() < 1e-12,
                "the rest of the step the other way"
            );
            assert_eq!(next(sign * 0.04, sign * -0.05), sign * -0.05, "all of a small one");
            assert!(
                (next(sign * 1.0, sign * 3.0) - sign * 1.1).abs() < 1e-12,
                "more the same way"
            );
            assert_eq!(next(sign * 3.0, sign * 1.0), sign * 1.0, "less the same way");
            assert_eq!([next(sign * 3.0, 0.0), next(sign * 3.0, -0.0)], [0.0, 0.0], "none");
            assert_eq!(next(0.0, sign * 5.0), sign * 0.1, "some from none");
        }
    }

    #[test]
    fn after_zero_force_the_next_one_begins_there() {
        let mut limiter = at(3.0);
        limiter.zero();
        assert_eq!(limiter.limit(5.0, 1.0, 1e-3), Ok(1.0));
        // So after a force that was none.
        let mut limiter = at(3.0);
        assert!(limiter.limit(f64::NAN, 1.0, 1e-3).is_err());
        assert_eq!(limiter.limit(5.0, 1.0, 1e-3), Ok(1.0));
    }

    #[test]
    fn a_speed_is_allowed_up_to_the_limit_either_way() {
        let allows = |velocity| SafetyLimiter::new(LIMITS).allows_speed(velocity);
        assert!(allows(0.0) && allows(5.0) && allows(-5.0));
        assert!(!allows(5.1) && !allows(-5.1) && !allows(f64::INFINITY) && !allows(f64::NAN));
    }
}
