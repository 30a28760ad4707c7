//! The hand of a simulated subject: a spring and a damper towards a place that moves by minimum jerk (Flash and Hogan
//! 1985).

use super::rig::{PERIOD_S, Rig};

/// Mass of hand and arm at the handle, kg: ours.
pub(super) const MASS_KG: f64 = 1.5;

/// Stiffness (N/m) and damping (N s/m) of the arm at the handle: ours. Stiff, so that friction does not stop it far
/// from where it goes.
const STIFFNESS_N_PER_M: f64 = 1500.0;
const DAMPING_NS_PER_M: f64 = 80.0;

/// A hand that moves, or rests where it went last.
#[derive(Debug)]
pub(super) struct Hand {
    from_m: f64,
    to_m: f64,
    duration_s: f64,
    gone_s: f64,
}

impl Hand {
    /// A hand at rest, m.
    pub(super) fn at(place_m: f64) -> Self {
        Self {
            from_m: place_m,
            to_m: place_m,
            duration_s: PERIOD_S,
            gone_s: PERIOD_S,
        }
    }

    /// Where it goes, m.
    pub(super) fn goal_m(&self) -> f64 {
        self.to_m
    }

    /// Whether it rests.
    pub(super) fn is_at_rest(&self) -> bool {
        self.gone_s >= self.duration_s
    }

    /// Begins a movement to a place, m.
    pub(super) fn move_to(&mut self, to_m: f64, duration_s: f64) {
        *self = Self {
            from_m: self.place().0,
            to_m,
            duration_s,
            gone_s: 0.0,
        };
    }

    /// Position (m) and velocity (m/s): `x = A (10 t^3 - 15 t^4 + 6 t^5)`.
    fn place(&self) -> (f64, f64) {
        let t = (self.gone_s / self.duration_s).min(1.0);
        let length_m = self.to_m - self.from_m;
        (
            self.from_m + length_m * t * t * t * (10.0 - 15.0 * t + 6.0 * t * t),
            length_m / self.duration_s * 30.0 * t * t * (1.0 - t) * (1.0 - t),
        )
    }

    /// The force on the handle in the next tick, N.
    pub(super) fn force_n(&mut self, rig: &Rig) -> f64 {
        self.gone_s += PERIOD_S;
        let (position_m, velocity_mps) = self.place();
        STIFFNESS_N_PER_M * (position_m - rig.position_m()) + DAMPING_NS_PER_M * (velocity_mps - rig.velocity_mps())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minimum_jerk_movement_rests_at_both_ends() {
        let mut hand = Hand::at(-0.1);
        hand.move_to(0.1, 0.5);
        assert_eq!(hand.place(), (-0.1, 0.0));
        hand.gone_s = 0.25;
        let (position_m, speed_mps) = hand.place();
        // 15/8 of the mean speed (Flash and Hogan 1985).
        assert!(position_m.abs() < 1e-15 && (speed_mps - 0.4 * 15.0 / 8.0).abs() < 1e-12);
        hand.gone_s = 0.7;
        let (position_m, speed_mps) = hand.place();
        assert!((position_m - 0.1).abs() < 1e-15 && speed_mps == 0.0);
    }
}
