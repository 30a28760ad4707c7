//! A motion of the rig by its own motor, beside the scene: a single pulse of force, by which the rig is
//! commissioned, or an [excitation](crate::excitation), from which it is identified.
//!
//! It is bounded by itself in force, time, travel and speed. It ends once, keeps the reason, and gives zero
//! force for ever after. The limits of the rig hold behind it as behind every scene.

use crate::block::Contact;
use crate::bound_error::BoundError;
use crate::directional::Direction;
use crate::excitation::{Excitation, Follower};
use crate::render::VisibleState;

/// Longest pulse with its edges, s.
pub const MAX_PULSE_S: f64 = 0.3;
/// Farthest that a pulse may let the handle go, m.
pub const FARTHEST_PULSE_M: f64 = 0.02;
/// Fastest that a pulse may let the handle go, m/s.
pub const FASTEST_PULSE_MPS: f64 = 0.3;

/// Why a motion of the rig's own has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionEnd {
    /// It is complete.
    Time,
    /// The handle went farther than it may.
    Travel,
    /// The handle was faster than it may be.
    Speed,
    /// The handle was farther from the reference than it may be.
    Lag,
    /// The handle went against the force.
    WrongWay,
    /// No force flowed in the meantime.
    Interrupted,
}

/// The first bound that does not hold. Say it so that it does not hold of NaN.
pub(crate) fn broken<const N: usize>(bounds: [(bool, MotionEnd); N]) -> Option<MotionEnd> {
    let broken = bounds.into_iter().find(|(holds, _)| !holds);
    broken.map(|(_, end)| end)
}

/// A pulse of force: up along a smooth edge, level, and down along another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulseShape {
    /// Force on the hand between the edges, N; positive pushes the handle in the positive direction.
    pub force_n: f64,
    /// Duration of the edge up, s.
    pub rise_s: f64,
    /// Time between the edges, s.
    pub hold_s: f64,
    /// Duration of the edge down, s.
    pub fall_s: f64,
    /// The force ends at once when the handle has gone this far the way it is pushed, m.
    pub travel_limit_m: f64,
    /// The force ends at once when the handle is faster than this, m/s.
    pub speed_limit_mps: f64,
    /// The force ends at once when the handle has gone this far against the force, m.
    pub wrong_way_limit_m: f64,
}

impl PulseShape {
    /// From the first force to the last, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.rise_s + self.hold_s + self.fall_s
    }

    /// Whether it is bounded as every pulse is. How large a force may be depends on the rig; here it must only be a
    /// number.
    fn check(&self) -> Result<(), BoundError> {
        let within = |field, value, max, unit| BoundError::check(field, value, 0.0, max, unit);
        within("rise", self.rise_s, MAX_PULSE_S, "s")?;
        within("hold", self.hold_s, MAX_PULSE_S, "s")?;
        within("fall", self.fall_s, MAX_PULSE_S, "s")?;
        within("duration", self.duration_s(), MAX_PULSE_S, "s")?;
        within("travel", self.travel_limit_m, FARTHEST_PULSE_M, "m")?;
        within("wrong way", self.wrong_way_limit_m, FARTHEST_PULSE_M, "m")?;
        within("speed", self.speed_limit_mps, FASTEST_PULSE_MPS, "m/s")?;
        within("force", self.force_n.abs(), f64::MAX, "N")
    }

    /// The force (N) at a time (s) on a handle that has moved so far (m) and so fast (m/s), or why the pulse
    /// ends there.
    fn force(&self, gone_s: f64, moved_m: f64, velocity_mps: f64) -> Result<f64, MotionEnd> {
        let forward_m = moved_m * self.force_n.signum();
        let left_s = self.duration_s() - gone_s;
        let bounds = [
            (forward_m >= -self.wrong_way_limit_m, MotionEnd::WrongWay),
            (forward_m <= self.travel_limit_m, MotionEnd::Travel),
            (velocity_mps.abs() <= self.speed_limit_mps, MotionEnd::Speed),
            (gone_s < self.duration_s(), MotionEnd::Time),
        ];
        let edge = |gone_s: f64, of_s: f64| if gone_s < of_s { smooth(gone_s / of_s) } else { 1.0 };
        match broken(bounds) {
            Some(end) => Err(end),
            None => Ok(self.force_n * edge(gone_s, self.rise_s) * edge(left_s, self.fall_s)),
        }
    }
}

/// From 0 to 1 without a corner at either end.
fn smooth(share: f64) -> f64 {
    share * share * (3.0 - 2.0 * share)
}

/// What moves the handle.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Rest,
    /// A pulse, and the time since it began, s.
    Pulse(PulseShape, f64),
    Excitation(Follower),
}

/// A motion of the rig's own.
#[derive(Clone, Copy, Debug)]
pub struct OwnMotion {
    kind: Kind,
    /// Nominal time of a tick, s.
    period_s: f64,
    has_begun: bool,
    end: Option<MotionEnd>,
    /// Where the handle was at the beginning, and where and how fast it was at the newest sample, m and m/s.
    origin: f64,
    position: f64,
    velocity: f64,
}

impl OwnMotion {
    /// No force: the handle is left alone.
    pub const REST: Self = Self::new(Kind::Rest, 0.0);

    /// A single pulse of force, for ticks of about `period_s` seconds.
    ///
    /// # Errors
    /// The first quantity of the shape that is out of range, or not a number.
    pub fn pulse(shape: PulseShape, period_s: f64) -> Result<Self, BoundError> {
        shape.check()?;
        Ok(Self::new(Kind::Pulse(shape, 0.0), period_s))
    }

    /// An excitation, for ticks of about `period_s` seconds.
    ///
    /// # Errors
    /// Those of [`Excitation::check`].
    pub fn excitation(excitation: Excitation, period_s: f64) -> Result<Self, BoundError> {
        excitation.check()?;
        Ok(Self::new(Kind::Excitation(Follower::new(excitation)), period_s))
    }

    const fn new(kind: Kind, period_s: f64) -> Self {
        Self {
            kind,
            period_s,
            has_begun: false,
            end: None,
            origin: 0.0,
            position: 0.0,
            velocity: 0.0,
        }
    }

    /// Puts it where the handle is, m and m/s; it begins with the next tick.
    pub fn place(&mut self, position: f64, velocity: f64) {
        self.origin = position;
        self.come_to(position, velocity);
        if let Kind::Excitation(follower) = &mut self.kind {
            follower.rest((position, 0.0));
        }
    }

    /// No force flows where the handle is, m and m/s: a motion that was to go on or to begin ends.
    pub(crate) fn interrupt(&mut self, position: f64, velocity: f64) {
        self.come_to(position, velocity);
        match &mut self.kind {
            Kind::Rest => return,
            Kind::Pulse(..) => {}
            Kind::Excitation(follower) => follower.rest((position, velocity)),
        }
        self.end.get_or_insert(MotionEnd::Interrupted);
    }

    fn come_to(&mut self, position: f64, velocity: f64) {
        (self.position, self.velocity) = (position, velocity);
    }

    /// Moves on by a time, s, in which the handle came to a position (m) and a velocity (m/s). Returns the force, N, as
    /// [`Rendered::coupling_force`](crate::block::Rendered::coupling_force) is: the hand feels it the other way round.
    pub fn tick(&mut self, elapsed_s: f64, position: f64, velocity: f64) -> f64 {
        let moved = position - self.position;
        self.come_to(position, velocity);
        if self.end.is_some() {
            return 0.0;
        }
        let elapsed_s = core::mem::replace(&mut self.has_begun, true).then_some(elapsed_s);
        let from_origin = position - self.origin;
        let force = match &mut self.kind {
            Kind::Rest => return 0.0,
            Kind::Pulse(shape, gone_s) => {
                // A device that sends nothing new does not prolong it.
                *gone_s += elapsed_s.map_or(0.0, |elapsed_s| elapsed_s.max(self.period_s));
                shape.force(*gone_s, from_origin, velocity)
            }
            Kind::Excitation(follower) => {
                follower.go_on(elapsed_s, self.period_s);
                follower.force(self.origin, moved, (position, velocity), self.period_s)
            }
        };
        match force {
            Ok(force) => -force,
            Err(end) => {
                self.end = Some(end);
                0.0
            }
        }
    }

    /// In the plane the handle may leave the line that it is pushed along: a pulse ends where the handle, this far (m)
    /// from where it began, and this fast (m/s), whatever the direction, is beyond its bounds.
    pub(crate) fn bound(&mut self, gone: f64, speed: f64) {
        let bounds = [
            (gone <= FARTHEST_PULSE_M, MotionEnd::Travel),
            (speed <= FASTEST_PULSE_MPS, MotionEnd::Speed),
        ];
        if !matches!(self.kind, Kind::Rest)
            && let Some(end) = broken(bounds)
        {
            self.end.get_or_insert(end);
        }
    }

    /// Why it has ended; `None` until then, and of [`REST`](Self::REST).
    #[must_use]
    pub fn end(&self) -> Option<MotionEnd> {
        self.end
    }

    /// Where the handle is drawn to, m, and how fast, m/s: of what draws it nowhere the handle itself.
    #[must_use]
    pub fn reference(&self) -> (f64, f64) {
        match &self.kind {
            Kind::Rest | Kind::Pulse(..) => (self.position, self.velocity),
            Kind::Excitation(follower) => follower.reference(),
        }
    }

    /// What a tick shows instead of the block: the reference, which slides; that of an excitation sticks once it has
    /// ended.
    pub(crate) fn shown(&self) -> VisibleState {
        let (position, velocity) = self.reference();
        let sticks = matches!(self.kind, Kind::Excitation(_)) && self.end.is_some();
        let contact = if sticks {
            Contact::Stuck
        } else {
            Contact::Sliding(Direction::of(velocity))
        };
        VisibleState {
            position,
            velocity,
            contact,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString;
    use alloc::vec::Vec;
    use proptest::prelude::*;

    const PERIOD_S: f64 = 1e-3;

    fn shape(force_n: f64) -> PulseShape {
        PulseShape {
            force_n,
            rise_s: 0.05,
            hold_s: 0.1,
            fall_s: 0.05,
            travel_limit_m: 0.01,
            speed_limit_mps: 0.2,
            wrong_way_limit_m: 1e-4,
        }
    }

    fn placed(shape: PulseShape, position: f64) -> OwnMotion {
        let mut pulse = OwnMotion::pulse(shape, PERIOD_S).expect("bounded");
        pulse.place(position, 0.0);
        pulse
    }

    fn on_hand(motion: &mut OwnMotion, position: f64, velocity: f64) -> f64 {
        -motion.tick(PERIOD_S, position, velocity)
    }

    #[test]
    fn a_pulse_rises_holds_falls_and_ends_for_ever() {
        // A device that sends nothing new does not prolong it.
        for (force_n, elapsed_s) in [(2.0, PERIOD_S), (-2.0, PERIOD_S), (2.0, 0.0), (2.0, f64::NAN)] {
            let mut pulse = placed(shape(force_n), 0.3);
            let forces: Vec<f64> = (0..400).map(|_| -pulse.tick(elapsed_s, 0.3, 0.0)).collect();
            assert_eq!((forces[0], forces[100]), (0.0, force_n));
            assert!((forces[25] - force_n / 2.0).abs() < 1e-12, "{}", forces[25]);
            assert!(forces[199].abs() > 0.0 && forces[200..].iter().all(|force| *force == 0.0));
            assert_eq!(pulse.end(), Some(MotionEnd::Time));
            for pair in forces.windows(2) {
                // The steepest part of the edge: 1.5 of the force in its time.
                assert!((pair[1] - pair[0]).abs() <= 1.5 * 2.0 / 50.0 + 1e-9, "{pair:?}");
            }
        }
    }

    #[test]
    fn a_broken_bound_ends_a_pulse_at_once_for_its_reason() {
        for (force_n, position, velocity, end) in [
            (2.0, 0.0101, 0.0, MotionEnd::Travel),
            (2.0, -0.0002, 0.0, MotionEnd::WrongWay),
            (-2.0, 0.0002, 0.0, MotionEnd::WrongWay),
            (2.0, 0.001, 0.21, MotionEnd::Speed),
            (2.0, 0.001, -0.21, MotionEnd::Speed),
            (2.0, f64::NAN, 0.0, MotionEnd::WrongWay),
            (2.0, 0.0, f64::INFINITY, MotionEnd::Speed),
        ] {
            let mut pulse = placed(shape(force_n), 0.0);
            for _ in 0..100 {
                on_hand(&mut pulse, 0.0, 0.0);
            }
            assert_eq!(on_hand(&mut pulse, 0.005 * force_n.signum(), 0.1), force_n);
            assert_eq!(on_hand(&mut pulse, position, velocity), 0.0, "{end:?}");
            assert_eq!(pulse.end(), Some(end));
            assert_eq!(on_hand(&mut pulse, 0.0, 0.0), 0.0, "and stays so");
        }
    }

    #[test]
    fn a_pulse_that_was_interrupted_does_not_begin_again() {
        // One that comes while no force flows never begins.
        for ticks in [100, 0] {
            let mut pulse = placed(shape(2.0), 0.0);
            for _ in 0..ticks {
                on_hand(&mut pulse, 0.0, 0.0);
            }
            pulse.interrupt(0.0, 0.0);
            assert!((0..200).all(|_| on_hand(&mut pulse, 0.0, 0.0) == 0.0));
            assert_eq!(pulse.end(), Some(MotionEnd::Interrupted));
        }
        let mut rest = OwnMotion::REST;
        rest.interrupt(0.0, 0.0);
        assert_eq!((on_hand(&mut rest, 0.1, 1.0), rest.end()), (0.0, None));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn force_and_time_are_bounded_whatever_the_device_says(
            samples in prop::collection::vec((any::<f64>(), -0.03..0.03f64, -0.5..0.5f64), 400),
        ) {
            let mut pulse = placed(shape(2.0), 0.0);
            for (k, (elapsed_s, position, velocity)) in samples.into_iter().enumerate() {
                let force = -pulse.tick(elapsed_s, position, velocity);
                prop_assert!((0.0..=2.0).contains(&force), "{force} N");
                prop_assert!(k < 200 || force == 0.0, "{force} N in tick {k}");
            }
        }
    }

    #[test]
    fn a_pulse_beyond_the_bounds_is_refused_by_its_field() {
        let with = |change: fn(&mut PulseShape)| {
            let mut shape = shape(1.0);
            change(&mut shape);
            shape
        };
        for (shape, field) in [
            (with(|shape| shape.hold_s = 0.25), "duration"),
            (with(|shape| shape.rise_s = -0.1), "rise"),
            (with(|shape| shape.travel_limit_m = 0.021), "travel"),
            (with(|shape| shape.speed_limit_mps = 0.31), "speed"),
            (with(|shape| shape.wrong_way_limit_m = f64::NAN), "wrong way"),
            (with(|shape| shape.force_n = f64::INFINITY), "force"),
            (with(|shape| shape.force_n = f64::NAN), "force"),
        ] {
            let error = OwnMotion::pulse(shape, PERIOD_S).expect_err(field);
            assert_eq!(error.field, field);
            assert!(error.to_string().contains("out of range"), "{error}");
        }
    }
}
