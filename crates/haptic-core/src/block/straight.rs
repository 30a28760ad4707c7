//! A piece of a motion on a straight line of a law: friction is a force, a spring and a damper, up
//! to the next kink.
//!
//! The block is then an oscillator, whose piece is exact in closed form. A curved law's straight
//! parts are mostly far shorter than a turn of that oscillator, where its series is cheaper.

use super::expansion::{Piece, Start};
use super::linear_slide::{FallLevel, SlideEnd, first_fall, passes};
use super::oscillator::{InitialState, Oscillator};
use crate::contact::{FrictionLine, Leg, StraightContact};
use crate::series::{FINE_TOLERANCE_N, Newest, Path, RECIPROCAL, Recurrence};

/// Half-turns of the oscillation that a piece may have.
const HALF_TURNS: f64 = 8.0;
/// Extrema that lie in them at most, and some for rounding.
const MAX_EXTREMA: u32 = 12;
/// Halvings that bracket a root to its last digit.
const MAX_HALVINGS: usize = 64;
/// Up to this many times the shortest time of an oscillator, squared, its series converges.
const SERIES_LIMIT_SQUARED: f64 = 2.25;

/// End of a piece on a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LineEnd {
    /// It continues.
    Lasts,
    /// It fell to the speed at which it ends.
    Falls,
    /// It came to the kink.
    Kink,
}

/// The series of a line.
struct LineSeries {
    force: f64,
    stiffness: f64,
    next_size: f64,
}

impl Recurrence for LineSeries {
    const LOOK_BACK: usize = 2;
    const MIN_ORDERS: usize = 4;

    fn tolerance_n(&self) -> f64 {
        FINE_TOLERANCE_N
    }

    #[inline(always)]
    fn friction<const N: usize>(&mut self, path: &Path, newest: Newest) -> f64 {
        self.next_size = self.stiffness * path.duration_s * RECIPROCAL[N + 1] * newest.speed.abs();
        let spring = self.stiffness * newest.distance;
        if N == 0 { self.force + spring } else { spring }
    }

    fn next_size(&self) -> f64 {
        self.next_size
    }
}

impl Start {
    /// The piece of a curved law on a straight part of it, which ends where its speed falls to
    /// `falls_to`, m/s.
    pub(crate) fn on_line(&self, line: &FrictionLine, falls_to: f64) -> (Piece, LineEnd) {
        let (mass, coupling) = (self.held.mass, self.held.coupling);
        let (t, damping) = (self.remaining_s, coupling.damping + line.damping);
        let spring = (coupling.stiffness + line.stiffness) * t * t;
        if spring.max(damping * t) > SERIES_LIMIT_SQUARED * mass {
            let level = FallLevel {
                armed: true,
                threshold: falls_to,
            };
            return self.on_line_in_closed_form(line, level);
        }
        let mut series = LineSeries {
            force: line.force,
            stiffness: line.stiffness,
            next_size: 0.0,
        };
        let mut expansion = self.expand(line.damping, &mut series);
        let mut end = LineEnd::Lasts;
        if expansion.falls_to(falls_to) {
            end = LineEnd::Falls;
        }
        if line.kink.is_finite() {
            let left = |path: &Path, n: usize| if n == 0 { line.kink } else { -path.distance.get(n) };
            if expansion.until(left) {
                end = LineEnd::Kink;
            }
        }
        let mut piece = expansion.piece((end == LineEnd::Falls).then_some(falls_to), 0.0);
        if end == LineEnd::Kink {
            piece.distance = line.kink;
        }
        (piece, end)
    }

    /// A slide against a force, N, and a drag, N s/m, down to a speed, m/s; whether it comes to that.
    pub(crate) fn slide(&self, force: f64, drag: f64, falls_to: f64) -> (Piece, bool) {
        let line = FrictionLine {
            force,
            stiffness: 0.0,
            damping: drag,
            kink: f64::INFINITY,
        };
        let (mut piece, end) = self.on_line(&line, falls_to);
        piece.dissipated = force * piece.distance;
        (piece, end == LineEnd::Falls)
    }

    /// A piece on a line as the oscillator that it is, whatever its length.
    pub(crate) fn on_line_in_closed_form(&self, line: &FrictionLine, level: FallLevel) -> (Piece, LineEnd) {
        let (mass, coupling) = (self.held.mass, self.held.coupling);
        let oscillator = Oscillator::new(
            mass,
            coupling.damping + line.damping,
            coupling.stiffness + line.stiffness,
        );
        let net = self.at_rest - line.force;
        let motion = InitialState {
            w0: self.speed,
            // From rest it goes the way it was found to go, whatever rounding says.
            f0: self.net.unwrap_or(if self.speed == 0.0 { net.max(0.0) } else { net }),
            g1: self.slope,
        };
        // A few half-turns at a time, so that the search for a fall is bounded as well.
        let length = oscillator.within_half_turns(self.remaining_s, HALF_TURNS);
        let r = oscillator.response(length);
        let (mut lasted_s, mut end, mut extrema) = (length, LineEnd::Lasts, 0);
        let mut falls_to = 0.0;
        let (mut y, mut w) = passes(&oscillator, &motion, &r, length, level).unwrap_or_else(|| {
            let (slide_end, looked_at) = first_fall(&oscillator, &motion, length, level, MAX_EXTREMA);
            extrema = looked_at;
            let mut r = r;
            if let SlideEnd::Falls { at, armed } = slide_end {
                (lasted_s, end) = (at, LineEnd::Falls);
                // It may have been armed on the way.
                falls_to = FallLevel { armed, ..level }.speed();
                r = oscillator.response(at);
            }
            oscillator.advance(&motion, &r)
        });
        if y > line.kink {
            lasted_s = arrival(&oscillator, &motion, line.kink, lasted_s);
            w = oscillator.advance(&motion, &oscillator.response(lasted_s)).1;
            (y, end) = (line.kink, LineEnd::Kink);
        }
        let piece = Piece {
            lasted_s,
            distance: y.max(0.0),
            speed: if end == LineEnd::Falls { falls_to } else { w.max(0.0) },
            dissipated: 0.0,
            work: 1 + extrema,
        };
        (piece, end)
    }
}

/// Moves a contact on whose law is made of straight lines.
pub(crate) fn straight_piece(contact: &mut impl StraightContact, start: &Start) -> Piece {
    let line = contact.line(start.direction);
    let (armed, threshold) = contact.fall_level();
    let (mut piece, end) = start.on_line_in_closed_form(&line, FallLevel { armed, threshold });
    contact.advance(&Leg {
        direction: start.direction,
        distance: piece.distance,
        from_speed: start.speed,
        to_speed: piece.speed,
        duration_s: piece.lasted_s,
    });
    // A spring holds what it takes.
    if line.stiffness == 0.0 {
        piece.dissipated = line.force * piece.distance;
    }
    if end == LineEnd::Falls {
        let before = contact.stored_energy();
        contact.fall(start.direction, piece.speed);
        piece.dissipated -= contact.stored_energy() - before;
    }
    piece
}

/// When a forward motion has gone a distance, which it has after `latest`.
fn arrival(oscillator: &Oscillator, motion: &InitialState, distance: f64, latest: f64) -> f64 {
    let (mut early, mut late) = (0.0, latest);
    let mut at = 0.5 * latest;
    for _ in 0..MAX_HALVINGS {
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
