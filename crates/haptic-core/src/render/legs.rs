//! The hand's motion from one sample to the next, as a contact on the device follows it.
//!
//! The positions say how far it went and which way: a velocity is an estimate, and late. The speed
//! goes evenly from one sample's to the next one's. A turn between two samples is taken only where
//! all agree on it: the velocities differ in sign, the parabola through both positions with the
//! acceleration of the velocities turns as well, and the positions came from there in the tick
//! before. A hand at rest under a noisy velocity then moves nothing.

use crate::contact::Leg;
use crate::direction::Direction;

/// How far beyond the samples a turn may lie, over the way of the tick before.
const FARTHEST_TURN: f64 = 2.0;

/// A tick's motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    /// Displacement, m.
    pub(crate) by: f64,
    /// Displacement of the tick before, m.
    pub(crate) came_by: f64,
    /// Velocities of both samples, m/s.
    pub(crate) from_velocity: f64,
    pub(crate) to_velocity: f64,
    pub(crate) elapsed_s: f64,
}

impl Motion {
    /// The motion in one direction, where the velocities have one sign.
    #[inline]
    pub(crate) fn leg(&self) -> Option<Leg> {
        (self.from_velocity * self.to_velocity >= 0.0).then(|| self.whole())
    }

    fn whole(&self) -> Leg {
        Leg {
            direction: Direction::of(if self.by == 0.0 { self.to_velocity } else { self.by }),
            distance: self.by.abs(),
            from_speed: self.from_velocity.abs(),
            to_speed: self.to_velocity.abs(),
            duration_s: self.elapsed_s,
        }
    }

    /// The leg up to a turn, where there is one, and the last leg, where the velocities differ in
    /// sign.
    #[cold]
    pub(crate) fn turn(&self) -> (Option<Leg>, Leg) {
        let whole = self.whole();
        let first = Leg {
            direction: Direction::of(self.from_velocity),
            to_speed: 0.0,
            ..whole
        };
        let last = Leg {
            direction: Direction::of(self.to_velocity),
            from_speed: 0.0,
            ..whole
        };
        let along = first.direction.sign() * self.by;
        let beyond = self.beyond();
        let (there, back) = (beyond + along.max(0.0), beyond + (-along).max(0.0));
        if there == 0.0 {
            return (None, Leg { distance: back, ..last });
        }
        if back == 0.0 {
            return (
                None,
                Leg {
                    distance: there,
                    ..first
                },
            );
        }
        // Constant acceleration takes the time that the way over the mean speed is.
        let (there_s, back_s) = (there / first.from_speed, back / last.to_speed);
        let share = there_s / (there_s + back_s);
        let first = Leg {
            distance: there,
            duration_s: self.elapsed_s * share,
            ..first
        };
        let last = Leg {
            distance: back,
            duration_s: self.elapsed_s - first.duration_s,
            ..last
        };
        (Some(first), last)
    }

    /// How far beyond both samples the turn is, m.
    fn beyond(&self) -> f64 {
        let gained = 0.5 * (self.to_velocity - self.from_velocity);
        let mean = self.by / self.elapsed_s;
        let (from, to) = (mean - gained, mean + gained);
        let agree = from * self.from_velocity > 0.0 && to * self.to_velocity > 0.0;
        if !agree || self.came_by * from <= 0.0 {
            return 0.0;
        }
        let least = from.abs().min(to.abs());
        let parabola = 0.25 * least * least / gained.abs() * self.elapsed_s;
        parabola.min(FARTHEST_TURN * self.came_by.abs())
    }
}
