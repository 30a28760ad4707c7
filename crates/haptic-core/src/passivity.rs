//! Watches the energy that the sampled loop makes, and takes it out again where that is asked for:
//! a passivity observer and controller after Hannaford and Ryu 2002, "Time-domain passivity control
//! of haptic interfaces".
//!
//! A force is held from one sample to the next while the hand moves on. The motor does `f_(k-1) dx`
//! on the hand; a surface that went along with the hand would have done `(f_(k-1) + f_k)/2 dx`. The
//! difference, `(f_(k-1) - f_k)/2 dx`, is made of nothing: it is what sampling, delay and a noisy
//! velocity add, to whatever scene. (Observing the whole work at the port instead would let the
//! friction of an hour pay for it.) The rig's own friction and damping take energy up in every
//! sample. What is left over is the excess; it never falls below zero, so that no long rest is
//! credited.
//!
//! What compensates the rig's friction is not a part of the surface: all of its energy counts as made.
//!
//! The controller, where it is wanted, opposes the motion until the excess is gone.

use crate::math::NOTHING;
use crate::snapshot::Archive;
use crate::vector::Vector;

/// What the rig itself takes up; by default nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RigLosses {
    /// Viscous damping, N s/m.
    #[cfg_attr(feature = "serde", serde(rename = "damping_Ns_per_m"))]
    pub damping: f64,
    /// Coulomb friction, N.
    #[cfg_attr(feature = "serde", serde(rename = "friction_N"))]
    pub friction: f64,
}

/// Keeps the account of one rig.
#[derive(Clone, Copy, Debug)]
pub struct PassivityObserver<V = f64> {
    losses: RigLosses,
    /// Largest force that the controller may add, N; zero only observes.
    control_n: f64,
    excess_j: f64,
    last: Option<Sample<V>>,
}

/// What there was at the last sample.
#[derive(Clone, Copy, Debug, Default)]
struct Sample<V> {
    position: V,
    /// The surface's force on the hand, N.
    force: V,
    /// The force that was applied, with what the controller added, N.
    applied: V,
}

impl<V: Vector> PassivityObserver<V> {
    /// Saves or loads the account.
    pub(crate) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("excess_J", &mut self.excess_j);
        archive.option("has_sample", &mut self.last, Sample::default(), |archive, last| {
            archive.vector("sample_m", &mut last.position);
            archive.vector("surface_N", &mut last.force);
            archive.vector("applied_N", &mut last.applied);
        });
    }

    /// An empty account. `control_n` (N, >= 0) is the largest force that the controller may add;
    /// with 0 it only observes.
    #[must_use]
    pub fn new(losses: RigLosses, control_n: f64) -> Self {
        Self {
            losses,
            control_n,
            excess_j: 0.0,
            last: None,
        }
    }

    /// Takes in a sample and the force on the hand that it leads to (N); returns the force that the
    /// controller wants to add (N), against the motion. Where not just the sum of both is applied,
    /// [`applied`](Self::applied) reports what is.
    ///
    /// `position` in m, `velocity` in m/s.
    #[inline(always)]
    pub fn observe(&mut self, elapsed_s: f64, position: V, velocity: V, force: V) -> V {
        let added = self.control(elapsed_s, position, velocity, force);
        self.last = Some(Sample {
            position,
            force,
            applied: force + added,
        });
        added
    }

    /// The force on the hand (N) that is applied until the next sample: what the rig's limits have
    /// made of the sum.
    pub fn applied(&mut self, force: V) {
        if let Some(last) = &mut self.last {
            last.applied = force;
        }
    }

    #[inline(always)]
    fn control(&mut self, elapsed_s: f64, position: V, velocity: V, force: V) -> V {
        let Some(last) = self.last else {
            return V::ZERO;
        };
        let moved = position - last.position;
        let made = (last.applied - (last.force + force) * 0.5).dot(moved);
        let (distance, speed) = (moved.length(), velocity.length());
        let taken_up = self.losses.friction * distance + self.losses.damping * speed * distance;
        let excess_j = self.excess_j + made - taken_up;
        // Next to nothing is nothing. An account that is not a number is closed: the force itself is
        // checked elsewhere.
        if !(NOTHING..f64::INFINITY).contains(&excess_j) {
            self.excess_j = 0.0;
            return V::ZERO;
        }
        self.excess_j = excess_j;
        if self.control_n == 0.0 {
            return V::ZERO;
        }
        let coming = speed * elapsed_s;
        if coming <= 0.0 {
            return V::ZERO;
        }
        // Over the distance that the hand will go until the next sample it takes out what there is, as
        // far as it may.
        -velocity.pointing((self.excess_j / coming).min(self.control_n))
    }

    /// Without force there is nothing to watch: the account begins again.
    pub fn rest(&mut self) {
        self.excess_j = 0.0;
        self.last = None;
    }

    /// Energy made and not taken up, J.
    #[must_use]
    pub fn excess_j(&self) -> f64 {
        self.excess_j
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 1e-3;
    const MASS: f64 = 0.1;

    /// A mass on a sampled spring and nothing else, which sampling makes swing ever wider: the
    /// energy of the swing at the end over that at the beginning, and the largest excess, J.
    fn swing(losses: RigLosses, control_n: f64) -> (f64, f64) {
        let stiffness = 2000.0;
        let mut observer = PassivityObserver::new(losses, control_n);
        let (mut position, mut velocity) = (1e-3, 0.0);
        let energy = |x: f64, v: f64| 0.5 * (stiffness * x * x + MASS * v * v);
        let begun = energy(position, velocity);
        let mut largest = 0.0_f64;
        for _ in 0..2000 {
            let spring = -stiffness * position;
            let force = spring + observer.observe(T, position, velocity, spring);
            largest = largest.max(observer.excess_j());
            let pull = force - losses.damping * velocity;
            position += velocity * T + 0.5 * pull / MASS * T * T;
            velocity += pull / MASS * T;
        }
        (energy(position, velocity) / begun, largest)
    }

    #[test]
    fn a_sampled_spring_makes_energy_which_is_seen_and_taken_out() {
        let (grown, seen) = swing(RigLosses::default(), 0.0);
        assert!(grown > 100.0, "sampling drives the swing: {grown}");
        assert!(seen > 0.05, "{seen} J");
        let (held, left) = swing(RigLosses::default(), 5.0);
        assert!(held < 1.5 && left < 1e-3, "{held}, {left} J");
        // A rig that damps enough has no excess, by Colgate's bound: b > K T/2.
        let (damping, friction) = (1.5, 0.0);
        let damped = RigLosses { damping, friction };
        let (held, seen) = swing(damped, 0.0);
        assert!(held < 1.0 && seen < 1e-5, "{held}, {seen} J");
    }

    #[test]
    fn passivity_force_is_capped_and_opposes_motion() {
        let mut observer = PassivityObserver::new(RigLosses::default(), 2.0);
        assert_eq!(observer.observe(T, 0.0, 0.3, 10.0), 0.0, "nothing is known of what was");
        let added = observer.observe(T, 0.01, 0.3, -10.0);
        assert_eq!(added, -2.0);
        observer.rest();
        assert_eq!(observer.excess_j(), 0.0);
        assert_eq!(observer.observe(T, 0.02, 0.3, 10.0), 0.0);
    }

    #[test]
    fn what_the_limits_kept_back_was_not_taken_out() {
        let begun = || {
            let mut observer = PassivityObserver::new(RigLosses::default(), 2.0);
            observer.observe(T, 0.0, 0.3, 10.0);
            assert_eq!(observer.observe(T, 0.01, 0.3, -10.0), -2.0);
            observer
        };
        let (mut whole, mut half, mut none) = (begun(), begun(), begun());
        half.applied(-11.0);
        none.applied(-10.0);
        let left = [&mut whole, &mut half, &mut none].map(|observer| {
            observer.observe(T, 0.02, 0.3, -10.0);
            observer.excess_j()
        });
        // 10 N over a centimetre were made; what was added went on for another.
        for (left, wanted) in left.iter().zip([0.08, 0.09, 0.1]) {
            assert!((left - wanted).abs() < 1e-12, "{left} J");
        }
    }
}
