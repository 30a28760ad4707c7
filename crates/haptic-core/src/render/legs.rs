//! The hand's motion from one sample to the next, as a contact on the device follows it.
//!
//! The positions say how far it went and which way: a velocity is an estimate, and late. The speed
//! goes evenly from one sample's to the next one's. A turn between two samples is taken only where
//! the velocities differ in sign and the samples are, to rounding, those of a constant
//! acceleration, which leaves no doubt where it lies: a computed motion has such samples, a
//! measured one never. So the noise of a velocity moves nothing.

use crate::contact::Leg;
use crate::directional::Direction;

/// Difference of two mean velocities, over the speeds, up to which they agree: rounding.
const AGREEMENT: f64 = 1e-9;

/// A tick's motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TickMotion {
    /// Displacement, m.
    pub(crate) by: f64,
    /// Velocities of both samples, m/s.
    pub(crate) from_velocity: f64,
    pub(crate) to_velocity: f64,
    pub(crate) elapsed_s: f64,
}

impl TickMotion {
    /// Where it went. A hand that stays where it is goes on facing the way that its contact does.
    #[inline]
    pub(crate) fn direction(&self, facing: impl FnOnce() -> Direction) -> Direction {
        if self.by == 0.0 {
            facing()
        } else {
            Direction::of(self.by)
        }
    }

    /// The motion in one direction, where the velocities have one sign.
    #[inline]
    pub(crate) fn leg(&self, facing: impl FnOnce() -> Direction) -> Option<Leg> {
        (self.from_velocity * self.to_velocity >= 0.0).then(|| self.whole(facing))
    }

    fn whole(&self, facing: impl FnOnce() -> Direction) -> Leg {
        Leg {
            direction: self.direction(facing),
            distance: self.by.abs(),
            from_speed: self.from_velocity.abs(),
            to_speed: self.to_velocity.abs(),
            duration_s: self.elapsed_s,
        }
    }

    /// The leg up to a turn, where there is one, and the last leg, where the velocities differ in
    /// sign.
    #[cold]
    pub(crate) fn turn(&self, facing: impl FnOnce() -> Direction) -> (Option<Leg>, Leg) {
        let whole = self.whole(facing);
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
        if there == 0.0 && back == 0.0 {
            let from_speed = 0.0;
            return (None, Leg { from_speed, ..whole });
        }
        let alone = |leg: Leg, distance: f64| (None, Leg { distance, ..leg });
        if there == 0.0 {
            return alone(last, back);
        }
        if back == 0.0 {
            return alone(first, there);
        }
        // Constant acceleration takes the time that the distance over the mean speed is.
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
        let (from, to) = (self.from_velocity, self.to_velocity);
        let mean = self.by / self.elapsed_s;
        let speeds = from.abs() + to.abs();
        if (mean - 0.5 * (from + to)).abs() > AGREEMENT * speeds {
            return 0.0;
        }
        let least = from.abs().min(to.abs());
        0.5 * least * least / speeds * self.elapsed_s
    }
}
