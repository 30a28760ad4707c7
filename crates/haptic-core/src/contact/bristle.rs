//! A bristle: a deflection `z` that follows the motion by its elastic share, `dz/dx = 1 - alpha(z)
//! z/zss`, and gives `sigma z`. The laws that are made of one differ in `alpha` and in where `zss`
//! comes from.

use super::leg::Leg;
use super::level::Level;
use super::state::{Contact, ContactMemory, LawContact};
use super::yielding::{YieldingContact, by_elastic_share};
use crate::directional::{Direction, Directional};
use crate::math::{exp, exp_m1, flush};
use crate::snapshot::Archive;
use core::fmt::Debug;

/// How much of a motion is lost to plastic flow, as a function of the deflection along the motion
/// and of the deflection in steady motion (> 0).
pub(crate) trait Plasticity: Clone + Copy + Debug + Send + Sync + 'static {
    /// Whether the flow is closed-form.
    const EXACT: bool;

    /// Whether a deflection against the motion is given back whole.
    const UNLOADS_ELASTICALLY: bool;

    /// `alpha`.
    fn alpha(&self, deflection: f64, steady: f64) -> f64;

    /// Moves a deflection on by a distance.
    fn flow(&self, deflection: f64, distance: f64, steady: f64) -> f64;
}

/// Always whole: the flow is closed-form.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FullPlasticity;

impl Plasticity for FullPlasticity {
    const EXACT: bool = true;
    const UNLOADS_ELASTICALLY: bool = false;

    fn alpha(&self, _deflection: f64, _steady: f64) -> f64 {
        1.0
    }

    fn flow(&self, deflection: f64, distance: f64, steady: f64) -> f64 {
        steady + (deflection - steady) * flush(exp(-distance / steady))
    }
}

/// Pieces into which a displacement is cut at most.
const MAX_PIECES: f64 = 16.0;
/// Elastic share below which the rest of a displacement is one piece.
const NEARLY_STEADY: f64 = 0.02;
/// A piece's share of the steady deflection.
const PIECE: f64 = 1.0 / 16.0;

/// The flow for an `alpha` that varies: by the exponential midpoint rule, which is stable whatever
/// the displacement.
pub(crate) fn flow_in_pieces(mut deflection: f64, distance: f64, steady: f64, alpha: impl Fn(f64) -> f64) -> f64 {
    let step = |from: f64, rate_at: f64, by: f64| {
        let rate = alpha(rate_at) / steady;
        let z = rate * by;
        let phi = if z > 1e-9 { -exp_m1(-z) / z } else { 1.0 };
        from + (1.0 - rate * from) * by * phi
    };
    let mut left = distance;
    let shortest = (PIECE * steady).max(distance / MAX_PIECES);
    while left > 0.0 {
        let share = 1.0 - alpha(deflection) / steady * deflection;
        // Nearly steady, or the last: alpha hardly changes any more.
        let piece = if share.abs() < NEARLY_STEADY || left < 1.5 * shortest {
            left
        } else {
            shortest
        };
        let middle = step(deflection, deflection, 0.5 * piece);
        deflection = step(deflection, middle, piece);
        left -= piece;
    }
    deflection
}

/// The contact of such a law.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bristle<L, P> {
    pub(crate) level: L,
    pub(crate) plasticity: P,
    /// `sigma0`, N/m.
    pub(crate) stiffness: f64,
    /// `sigma1`, N s/m.
    pub(crate) damping: f64,
    /// `b`, N s/m.
    pub(crate) viscous: Directional,
    /// `z`, m, signed.
    pub(crate) deflection: f64,
}

impl<L: Level, P: Plasticity> Bristle<L, P> {
    fn steady(&self, direction: Direction, speed: f64) -> f64 {
        self.level.at(direction, speed) / self.stiffness
    }

    /// `dz/dx` along a direction.
    fn share(&self, direction: Direction, steady: f64) -> f64 {
        let along = direction.sign() * self.deflection;
        if steady <= 0.0 {
            // Nothing holds this way. A deflection the other way vanishes at once, or as a spring's
            // does.
            return if P::UNLOADS_ELASTICALLY && along < 0.0 {
                1.0
            } else {
                0.0
            };
        }
        1.0 - self.plasticity.alpha(along, steady) * along / steady
    }
}

impl<L: Level, P: Plasticity> LawContact for Bristle<L, P> {
    fn force_at_rest(&self) -> f64 {
        self.stiffness * self.deflection
    }

    fn recall(&mut self, memory: &ContactMemory, _speed: f64) {
        self.deflection = flush(memory.held(|direction| self.level.at(direction, 0.0)) / self.stiffness);
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("deflection_m", &mut self.deflection);
        self.level.archive(archive);
    }

    fn contact(&self, direction: Direction, speed: f64) -> Contact {
        by_elastic_share(self.share(direction, self.steady(direction, speed)), direction)
    }
}

impl<L: Level, P: Plasticity> YieldingContact for Bristle<L, P> {
    fn advance(&mut self, leg: &Leg) {
        let sign = leg.direction.sign();
        let (from, to) = (leg.from_speed, leg.to_speed);
        let middle = 0.5 * (from + to);
        let flow = |along: f64, distance: f64, speed: f64| {
            let steady = self.steady(leg.direction, speed);
            if steady > 0.0 {
                self.plasticity.flow(along, distance, steady)
            } else if P::UNLOADS_ELASTICALLY {
                (along + distance).min(0.0)
            } else {
                0.0
            }
        };
        let along = sign * self.deflection;
        let at_once = flow(along, leg.distance, middle);
        if P::EXACT && !L::VARIES {
            self.deflection = flush(sign * at_once);
            return;
        }
        // In two halves of the time, the speed growing evenly, and extrapolated from both.
        let first = if middle > 0.0 {
            leg.distance * (0.25 * (3.0 * from + to) / (2.0 * middle))
        } else {
            0.5 * leg.distance
        };
        let halfway = flow(along, first, 0.25 * (3.0 * from + to));
        let in_halves = flow(halfway, leg.distance - first, 0.25 * (from + 3.0 * to));
        let missed = (in_halves - at_once) / 3.0;
        self.deflection = flush(sign * (in_halves + missed));
    }

    fn friction(&self, velocity: f64) -> f64 {
        let direction = Direction::of(velocity);
        let steady = self.steady(direction, velocity.abs());
        // Without a limit this way, whatever the bristle held is gone at once.
        let held = if steady > 0.0 || P::UNLOADS_ELASTICALLY {
            self.force_at_rest()
        } else {
            0.0
        };
        held + (self.damping * self.share(direction, steady) + self.viscous.get(direction)) * velocity
    }

    fn stored_energy(&self) -> f64 {
        0.5 * self.stiffness * self.deflection * self.deflection
    }
}
