//! One piece of a motion on a contact that gives way, by the tangent of its law.
//!
//! The tangent at the start of the piece makes the block an oscillator, which is solved exactly;
//! what the law really gave at the end is put in as a force that grows with the square of time (the
//! exponential Rosenbrock method of third order of Hochbruck, Ostermann and Schweitzer 2009). That
//! correction measures the error: a piece with too large an error is cut. A piece ends early where
//! the block turns round and where the law has a kink; both are found as roots.

use super::body::Coupling;
use super::fall::{FallLevel, SlideEnd, first_fall, passes};
use super::oscillator::{Motion, Oscillator};
use super::piece_length::{LONGEST, next_length};
use crate::contact::{AdvanceCost, Stroke, Tangent, YieldingContact};
use crate::direction::Direction;

/// Half-turns of the oscillation that a piece may have.
const HALF_TURNS: f64 = 8.0;
/// Extrema that lie in them at most, and some for rounding.
const MOST_EXTREMA: u32 = 12;
/// Halvings that bracket a root to its last digit.
const MOST_HALVINGS: usize = 64;

/// Where a piece starts. Speeds and forces along the direction are positive.
pub(super) struct Start<'a, C> {
    pub(super) mass: f64,
    pub(super) coupling: Coupling,
    pub(super) contact: &'a C,
    pub(super) direction: Direction,
    /// Speed along the direction, m/s.
    pub(super) speed: f64,
    /// The coupling force if the block stood still, N, along the direction, and its slope, N/s.
    pub(super) at_rest: f64,
    pub(super) slope: f64,
    /// Undamped angular frequency while stuck, rad/s.
    pub(super) fastest: f64,
    /// Whether a listener wants the energy.
    pub(super) listens: bool,
}

/// Limits of a piece.
pub(super) struct Bounds {
    /// Time to the end of the tick, s.
    pub(super) remaining_s: f64,
    /// Work that it may take.
    pub(super) most_work: u32,
    /// Correction of the coupling force, N, up to which it is accepted.
    pub(super) tolerance: f64,
}

/// One piece, in the coordinate in which it goes forwards.
pub(super) struct Piece<C> {
    pub(super) lasted_s: f64,
    pub(super) distance: f64,
    pub(super) speed: f64,
    /// Whether it ends because the slide fell to the velocity at which it ends.
    pub(super) fell: bool,
    /// How far the coupling force had to be corrected, N.
    error: f64,
    /// Energy that the friction took and the contact does not hold, J.
    pub(super) dissipated: f64,
    /// The contact at its end.
    pub(super) contact: C,
    /// Work that it took.
    pub(super) work: u32,
}

/// A motion under the tangent of a law.
struct TangentMotion<'a, C> {
    start: &'a Start<'a, C>,
    tangent: Tangent,
    oscillator: Oscillator,
    motion: Motion,
}

impl<C: YieldingContact> Start<'_, C> {
    /// The next piece. `try_s` is the length to try first, s, and then that for the piece after it.
    pub(super) fn piece(&self, bounds: &Bounds, try_s: &mut f64) -> Piece<C> {
        let &Bounds {
            remaining_s,
            most_work,
            tolerance,
        } = bounds;
        let tangent_motion = self.tangent_motion();
        let TangentMotion {
            tangent, oscillator, ..
        } = &tangent_motion;
        // A few half-turns at a time, so that the search for a fall is bounded as well.
        let mut length = oscillator.within_half_turns(try_s.min(remaining_s), HALF_TURNS);
        if self.coupling.damping + tangent.damping < 0.0 {
            length = length.min(LONGEST * oscillator.shortest_time());
        }
        let mut work = 0;
        loop {
            let mut piece = tangent_motion.try_length(length);
            work += piece.work;
            let next = next_length(piece.lasted_s, piece.error, tolerance);
            if piece.error > tolerance && work < most_work && piece.lasted_s > 0.0 {
                length = next;
                continue;
            }
            // A piece that was cut short by an event says nothing against longer ones.
            if next < *try_s || piece.lasted_s >= try_s.min(remaining_s) {
                *try_s = next;
            }
            piece.work = work;
            return piece;
        }
    }

    fn tangent_motion(&self) -> TangentMotion<'_, C> {
        let w0 = self.speed;
        let mut tangent = self.contact.tangent(self.direction, w0);
        tangent.stiffness = tangent.stiffness.max(-self.coupling.stiffness);
        let net = self.at_rest - tangent.force;
        TangentMotion {
            start: self,
            tangent,
            oscillator: Oscillator::new(
                self.mass,
                self.coupling.damping + tangent.damping,
                self.coupling.stiffness + tangent.stiffness,
            ),
            motion: Motion {
                w0,
                // From rest it goes the way it was found to go, whatever rounding says.
                f0: if w0 == 0.0 { net.max(0.0) } else { net },
                g1: self.slope,
            },
        }
    }
}

impl<C: YieldingContact> TangentMotion<'_, C> {
    fn try_length(&self, length: f64) -> Piece<C> {
        let Self {
            start,
            tangent,
            oscillator,
            motion,
        } = self;
        let (armed, threshold) = start.contact.fall_level();
        let level = FallLevel { armed, threshold };
        let mut r = oscillator.response(length);
        let (mut lasted_s, mut fell, mut extrema) = (length, false, 0);
        let (mut y, mut w) = passes(oscillator, motion, &r, length, level).unwrap_or_else(|| {
            let (end, looked_at) = first_fall(oscillator, motion, length, level, MOST_EXTREMA);
            extrema = looked_at;
            if let SlideEnd::Falls { at, .. } = end {
                (lasted_s, fell) = (at, true);
                r = oscillator.response(at);
            }
            oscillator.advance(motion, &r)
        });
        if y > tangent.kink {
            lasted_s = arrival(oscillator, motion, tangent.kink, lasted_s);
            r = oscillator.response(lasted_s);
            w = oscillator.advance(motion, &r).1;
            y = tangent.kink;
            fell = false;
        }
        let stroke = |distance: f64, to_speed: f64| Stroke {
            direction: start.direction,
            distance: distance.max(0.0),
            from_speed: motion.w0,
            to_speed: to_speed.max(0.0),
            elapsed_s: lasted_s,
        };
        let mut contact = start.contact.clone();
        let AdvanceCost { uncertain, work } = contact.advance(&stroke(y, w));
        let missed = if tangent.linear {
            // Also where it jumps at the kink: up to there it gave what its tangent did.
            0.0
        } else {
            let sign = start.direction.sign();
            let given = sign * contact.friction(sign * w.max(0.0));
            given - (tangent.force + tangent.stiffness * y + tangent.damping * w)
        };
        let (dy, dw) = oscillator.late_force(-missed, lasted_s, &r);
        let Coupling { stiffness, damping } = start.coupling;
        let (dy_unsure, dw_unsure) = oscillator.late_force(uncertain, lasted_s, &r);
        let felt = |dy: f64, dw: f64| (stiffness * (dy.abs() + dw.abs() * lasted_s)).max(damping * dw.abs());
        let error = felt(dy, dw).max(felt(dy_unsure, dw_unsure)).max(0.1 * uncertain);
        if dy != 0.0 {
            contact = start.contact.clone();
            contact.advance(&stroke(y + dy, w + dw));
        }
        let speed = if fell { level.speed() } else { (w + dw).max(0.0) };
        let dissipated = if start.listens {
            self.dissipated(&contact, lasted_s, (dy, dw), speed)
        } else {
            0.0
        };
        Piece {
            lasted_s,
            distance: (y + dy).max(0.0),
            speed,
            fell,
            error,
            dissipated,
            contact,
            work: work + extrema,
        }
    }

    /// Energy that friction dissipated in a piece, J: the work of the coupling, less the gain of
    /// the block and of the contact. By Simpson's rule.
    fn dissipated(&self, contact: &C, lasted_s: f64, (dy, dw): (f64, f64), speed: f64) -> f64 {
        let Self {
            start,
            tangent,
            oscillator,
            motion,
        } = self;
        let Coupling { stiffness, damping } = start.coupling;
        let pull = |t: f64, y: f64, w: f64| motion.f0 + tangent.force + motion.g1 * t - stiffness * y - damping * w;
        let power = |share: f64| {
            let t = share * lasted_s;
            let (y, w) = oscillator.advance(motion, &oscillator.response(t));
            // The correction grew with the fourth power of time in displacement, and with the third
            // in velocity.
            let cube = share * share * share;
            let (y, w) = (y + dy * cube * share, w + dw * cube);
            pull(t, y, w) * w
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 2 to 1602")]
        let panels = 2 + 2 * (2.0 * (start.fastest * lasted_s).min(400.0)) as u32;
        let mut sum = 0.0;
        for panel in 0..panels {
            let at = |k: f64| (f64::from(panel) + k) / f64::from(panels);
            sum += power(at(0.0)) + 4.0 * power(at(0.5)) + power(at(1.0));
        }
        let work = lasted_s / (6.0 * f64::from(panels)) * sum;
        let gained = 0.5 * start.mass * (speed * speed - motion.w0 * motion.w0);
        work - gained - (contact.stored_energy() - start.contact.stored_energy())
    }
}

/// When a forward motion has gone a distance, which it has after `latest`.
fn arrival(oscillator: &Oscillator, motion: &Motion, distance: f64, latest: f64) -> f64 {
    let (mut early, mut late) = (0.0, latest);
    let mut at = 0.5 * latest;
    for _ in 0..MOST_HALVINGS {
        let (y, w) = oscillator.advance(motion, &oscillator.response(at));
        if y < distance {
            early = at;
        } else {
            late = at;
        }
        let newton = at - (y - distance) / w;
        if (newton - at).abs() <= 1e-14 * latest {
            return newton.max(0.0).min(latest);
        }
        let next = if newton > early && newton < late {
            newton
        } else {
            0.5 * (early + late)
        };
        if (next - at).abs() <= 1e-14 * latest {
            return next;
        }
        at = next;
    }
    at
}
