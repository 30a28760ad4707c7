//! A slide against friction that falls with speed (Stribeck's curve): power series of the motion
//! where the curve is felt, and a slide against constant friction above.

use super::course::Course;
use super::exact::{Slide, SlidePiece};
use super::expansion::{CoupledMass, Piece, Start};
use super::linear_slide::{FallLevel, LinearSlide};
use super::oscillator::InitialState;
use crate::contact::{Fall, FallSeries, LOOK_BACK_ON_CURVE, MIN_ON_CURVE, fallen_from};
use crate::directional::Direction;
use crate::series::{Newest, Path, Recurrence, integral_of_product};
use crate::snapshot::Archive;

/// One direction of sliding under Stribeck's curve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FallingSlide {
    /// The slide above the curve.
    fast: LinearSlide,
    held: CoupledMass,
    /// `b`, N s/m.
    viscous: f64,
    /// Where the curve begins, N: the limit at which this slide let go.
    peak: f64,
    fall: Fall,
}

/// Friction on the curve.
struct OnCurve {
    dynamic_force: f64,
    above: FallSeries,
}

impl Recurrence for OnCurve {
    const LOOK_BACK: usize = LOOK_BACK_ON_CURVE;
    const MIN_ORDERS: usize = MIN_ON_CURVE;

    fn tolerance_n(&self) -> f64 {
        // A slide that sets off against falling friction runs away: an error grows a hundredfold.
        1e-12
    }

    #[inline(always)]
    fn friction<const N: usize>(&mut self, _path: &Path, newest: Newest) -> f64 {
        if N == 0 {
            self.above.begin(newest);
            self.dynamic_force + self.above.at_start
        } else {
            self.above.next::<N>(newest)
        }
    }

    fn newest_damping(&self) -> f64 {
        self.above.per_speed
    }

    fn next_size(&self) -> f64 {
        self.above.size()
    }
}

/// Reason why a piece ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ends {
    /// The series, or the tick.
    Lasts,
    /// The speed falls to where the slide ends.
    Stops,
    /// It falls to where the curve begins.
    Slows,
    /// It comes to the threshold.
    Arms,
}

impl FallingSlide {
    /// `fast` is the slide above the curve, `viscous` `b`, N s/m, and `velocity` `ws`, m/s.
    pub(crate) fn new(fast: LinearSlide, held: CoupledMass, viscous: f64, velocity: f64) -> Self {
        let mut slide = Self {
            fast,
            held,
            viscous,
            peak: 0.0,
            fall: Fall {
                excess: 0.0,
                velocity,
                fallen_from: 0.0,
            },
        };
        slide.set_off(fast.static_force());
        slide
    }

    /// Whether nothing of the curve is left at a speed.
    fn is_fallen(&self, speed: f64) -> bool {
        speed > self.fall.fallen_from || self.fall.fallen_from == 0.0
    }

    /// The slide's motion in the coordinates of the one above the curve.
    fn above(&self, motion: &InitialState) -> InitialState {
        InitialState {
            f0: motion.f0 + (self.peak - self.dynamic_force()),
            ..*motion
        }
    }

    /// A piece above the curve, of a slide that does not have to be armed any more.
    fn above_curve(&self, start: &Start, stop: f64) -> (Piece, Ends) {
        let slow = self.fall.fallen_from;
        let (piece, falls) = start.slide(self.dynamic_force(), self.viscous, stop.max(slow));
        let ends = if !falls {
            Ends::Lasts
        } else if slow > stop {
            Ends::Slows
        } else {
            Ends::Stops
        };
        (piece, ends)
    }

    /// A piece by its series. `arms_at` is the threshold of a slide that is not armed.
    fn by_series(&self, start: &Start, stop: f64, arms_at: Option<f64>) -> (Piece, Ends) {
        let mut friction = OnCurve {
            dynamic_force: self.dynamic_force(),
            above: FallSeries::new(&self.fall, start.speed),
        };
        let mut expansion = start.expand(self.viscous, &mut friction);
        let slow = self.fall.fallen_from;
        let (mut ends, mut speed) = (Ends::Lasts, None);
        if self.is_fallen(start.speed) && slow > stop {
            if expansion.falls_to(slow) {
                (ends, speed) = (Ends::Slows, Some(slow));
            }
        } else if expansion.falls_to(stop) {
            (ends, speed) = (Ends::Stops, Some(stop));
        }
        if let Some(threshold) = arms_at {
            let below = |path: &Path, n: usize| {
                let slower = -path.speed.get(n);
                if n == 0 { threshold + slower } else { slower }
            };
            if expansion.until(below) {
                (ends, speed) = (Ends::Arms, Some(threshold));
            }
        }
        let mut piece = expansion.piece(speed, 0.0);
        if start.listens {
            let path = &expansion.path;
            let above = integral_of_product(
                |n| friction.above.get(n),
                |n| path.speed.get(n),
                expansion.end,
                expansion.last_of_law(),
            );
            piece.dissipated = self.dynamic_force() * piece.distance + path.duration_s * above;
        }
        (piece, ends)
    }
}

impl Slide for FallingSlide {
    const EXTRA_WORK: u32 = 128;

    fn static_force(&self) -> f64 {
        self.fast.static_force()
    }

    fn dynamic_force(&self) -> f64 {
        self.fast.dynamic_force()
    }

    fn friction_at(&self, speed: f64) -> f64 {
        if speed == 0.0 {
            return self.peak;
        }
        self.dynamic_force() + self.fall.at(speed)
    }

    fn damping(&self) -> f64 {
        self.fast.damping()
    }

    fn half_turns(&self, time_s: f64) -> f64 {
        self.fast.half_turns(time_s)
    }

    fn rest(&mut self) {
        self.fast.rest();
        if self.peak != self.static_force() {
            self.set_off(self.static_force());
        }
    }

    fn archive(&mut self, direction: Direction, archive: &mut Archive<'_>) {
        let name = match direction {
            Direction::Positive => "set_off_positive_N",
            Direction::Negative => "set_off_negative_N",
        };
        let mut peak = self.peak;
        archive.number(name, &mut peak);
        if archive.is_loading() {
            self.set_off(peak);
        }
        self.fast.archive(direction, archive);
    }

    fn set_off(&mut self, limit: f64) {
        self.peak = limit;
        self.fall.excess = limit - self.dynamic_force();
        self.fall.fallen_from = fallen_from(self.fall.excess, self.fall.velocity);
    }

    fn peak(&self) -> f64 {
        self.peak
    }

    fn steady(&mut self, motion: &InitialState, elapsed_s: f64, level: FallLevel) -> Option<(f64, f64)> {
        let FallLevel { armed, threshold } = level;
        let sure = self.is_fallen(motion.w0) && (armed || threshold == 0.0);
        let above = FallLevel {
            armed: true,
            threshold: threshold.max(self.fall.fallen_from),
        };
        sure.then(|| self.fast.steady(&self.above(motion), elapsed_s, above))
            .flatten()
    }

    fn piece(&mut self, motion: &InitialState, level: FallLevel, course: &Course, listens: bool) -> Option<SlidePiece> {
        let FallLevel { armed, threshold } = level;
        let armed = armed || motion.w0 > threshold;
        let stop = FallLevel { armed, threshold }.speed();
        let start = Start {
            held: self.held,
            direction: Direction::Positive,
            speed: motion.w0,
            at_rest: motion.f0 + self.peak,
            slope: motion.g1,
            net: (motion.w0 == 0.0).then_some(motion.f0),
            remaining_s: course.remaining(),
            listens,
        };
        let arms_at = (!armed && threshold > 0.0).then_some(threshold);
        let (piece, ends) = if self.is_fallen(motion.w0) && arms_at.is_none() {
            self.above_curve(&start, stop)
        } else {
            self.by_series(&start, stop, arms_at)
        };
        Some(SlidePiece {
            piece,
            armed: armed || ends == Ends::Arms,
            falls: ends == Ends::Stops,
        })
    }
}
