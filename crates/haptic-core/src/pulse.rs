//! A single pulse of force on the hand, by which a rig is commissioned.
//!
//! It is rendered in the place of a scene, and has no law of friction: it is bounded by itself in
//! time, travel and speed, and gives zero force for ever once it has ended, been interrupted, or
//! gone the wrong way. The limits of the rig hold behind it as behind every scene.

use crate::block::{BlockState, Contact, EventSink, Moving, Rendered};
use crate::bound_error::BoundError;
use crate::directional::Direction;
use crate::snapshot::Archive;

/// Longest pulse with its edges, s.
pub const MAX_PULSE_S: f64 = 0.3;
/// Farthest that a pulse may let the handle go, m.
pub const FARTHEST_PULSE_M: f64 = 0.02;
/// Fastest that a pulse may let the handle go, m/s.
pub const FASTEST_PULSE_MPS: f64 = 0.3;

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
    /// No force at all, for ever.
    pub const REST: Self = Self {
        force_n: 0.0,
        rise_s: 0.0,
        hold_s: 0.0,
        fall_s: 0.0,
        travel_limit_m: 0.0,
        speed_limit_mps: 0.0,
        wrong_way_limit_m: 0.0,
    };

    /// From the first force to the last, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.rise_s + self.hold_s + self.fall_s
    }

    /// Whether it is bounded as every pulse is. How large a force may be depends on the
    /// rig; here it must only be a number.
    ///
    /// # Errors
    /// The first quantity that is out of range, or no number.
    pub fn check(&self) -> Result<(), BoundError> {
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

    /// The force at a time after its beginning, N.
    fn force_at(&self, at_s: f64) -> f64 {
        let left_s = self.duration_s() - at_s;
        if left_s <= 0.0 {
            return 0.0;
        }
        let edge = |gone_s: f64, of_s: f64| if gone_s < of_s { smooth(gone_s / of_s) } else { 1.0 };
        self.force_n * edge(at_s, self.rise_s) * edge(left_s, self.fall_s)
    }
}

/// From 0 to 1 without a corner at either end.
fn smooth(share: f64) -> f64 {
    share * share * (3.0 - 2.0 * share)
}

/// How far a pulse has come.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// Nobody has said yet where the handle is.
    Unplaced,
    /// It begins with the next tick.
    Armed,
    /// It has run for this time, s.
    Running(f64),
    /// It gives no force any more, whatever happens.
    Spent,
}

/// A pulse on the device itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pulse {
    shape: PulseShape,
    /// A tick counts for no less, s: a device that sends nothing new does not prolong it.
    period_s: f64,
    phase: Phase,
    origin: f64,
    position: f64,
    velocity: f64,
}

impl Pulse {
    pub(crate) fn new(shape: PulseShape, period_s: f64) -> Self {
        Self {
            shape,
            period_s,
            phase: Phase::Unplaced,
            origin: 0.0,
            position: 0.0,
            velocity: 0.0,
        }
    }

    /// Whether the handle is where and as fast as the pulse allows.
    fn is_within_limits(&self) -> bool {
        let forward = (self.position - self.origin) * self.shape.force_n.signum();
        forward <= self.shape.travel_limit_m
            && forward >= -self.shape.wrong_way_limit_m
            && self.velocity.abs() <= self.shape.speed_limit_mps
    }
}

impl Moving for Pulse {
    fn advance(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        _sink: &mut (impl EventSink + ?Sized),
    ) -> Rendered {
        (self.position, self.velocity) = (position, velocity);
        let gone_s = match self.phase {
            Phase::Armed => 0.0,
            Phase::Running(gone_s) => gone_s + elapsed_s.max(self.period_s),
            Phase::Unplaced | Phase::Spent => return Rendered::default(),
        };
        if gone_s >= self.shape.duration_s() || !self.is_within_limits() {
            self.phase = Phase::Spent;
            return Rendered::default();
        }
        self.phase = Phase::Running(gone_s);
        Rendered {
            // The hand feels the coupling force the other way round.
            coupling_force: -self.shape.force_at(gone_s),
            ..Rendered::default()
        }
    }

    fn state(&self) -> BlockState {
        let mut state = BlockState::new(self.position, self.velocity, self.position, self.velocity);
        state.contact = Contact::Sliding(Direction::of(self.velocity));
        state
    }

    /// The first call says where it begins. After that it has been interrupted: no force
    /// flowed, or another pulse was meant.
    fn set_state(&mut self, state: BlockState) {
        (self.position, self.velocity) = (state.device_position, state.device_velocity);
        self.phase = match self.phase {
            Phase::Unplaced => Phase::Armed,
            _ => Phase::Spent,
        };
        self.origin = self.position;
    }

    /// None, for whatever follows: the force of a pulse that is replaced ends at once and does not fade.
    /// A motion of its own is never gone on with.
    fn archive(&mut self, _archive: &mut Archive<'_>) {}

    fn coupling_force(&self) -> f64 {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Renderer, Scene, Scheme};
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

    /// A pulse as the loop takes it, in the place of one without force, at a position.
    fn armed(shape: PulseShape, position: f64) -> Renderer {
        let mut rest = Renderer::pulse(PulseShape::REST, PERIOD_S).expect("bounded");
        rest.start_at(position, 0.0);
        let mut pulse = Renderer::pulse(shape, PERIOD_S).expect("bounded");
        assert_eq!(pulse.take_over(&rest), 0.0);
        pulse
    }

    fn on_hand(pulse: &mut Renderer, position: f64, velocity: f64) -> f64 {
        -pulse.tick(PERIOD_S, position, velocity).coupling_force
    }

    #[test]
    fn a_pulse_rises_holds_falls_and_ends_for_ever() {
        for force_n in [2.0, -2.0] {
            let mut pulse = armed(shape(force_n), 0.3);
            let forces: Vec<f64> = (0..400).map(|_| on_hand(&mut pulse, 0.3, 0.0)).collect();
            assert_eq!((forces[0], forces[100]), (0.0, force_n));
            assert!((forces[25] - force_n / 2.0).abs() < 1e-12, "{}", forces[25]);
            assert!(forces[199].abs() > 0.0 && forces[200..].iter().all(|force| *force == 0.0));
            for pair in forces.windows(2) {
                // The steepest part of the edge: 1.5 of the force in its time.
                assert!((pair[1] - pair[0]).abs() <= 1.5 * 2.0 / 50.0 + 1e-9, "{pair:?}");
            }
        }
    }

    #[test]
    fn travel_speed_and_the_wrong_way_end_it_at_once() {
        for (position, velocity) in [
            (0.0101, 0.0),
            (-0.0002, 0.0),
            (0.001, 0.21),
            (0.001, -0.21),
            (f64::NAN, 0.0),
            (0.0, f64::INFINITY),
        ] {
            let mut pulse = armed(shape(2.0), 0.0);
            for _ in 0..100 {
                on_hand(&mut pulse, 0.0, 0.0);
            }
            assert_eq!(on_hand(&mut pulse, 0.005, 0.1), 2.0);
            assert_eq!(
                on_hand(&mut pulse, position, velocity),
                0.0,
                "{position} m, {velocity} m/s"
            );
            assert_eq!(on_hand(&mut pulse, 0.0, 0.0), 0.0, "and stays so");
        }
        let mut pulse = armed(shape(-2.0), 0.0);
        for _ in 0..100 {
            on_hand(&mut pulse, -0.005, 0.0);
        }
        assert_eq!(
            on_hand(&mut pulse, 2e-4, 0.0),
            0.0,
            "the wrong way is the positive one here"
        );
    }

    #[test]
    fn a_pulse_that_was_interrupted_does_not_begin_again() {
        let mut pulse = armed(shape(2.0), 0.0);
        for _ in 0..100 {
            on_hand(&mut pulse, 0.0, 0.0);
        }
        // As the loop does it while no force flows.
        pulse.start_at(0.0, 0.0);
        assert_eq!(on_hand(&mut pulse, 0.0, 0.0), 0.0);
        // One that comes while no force flows never begins.
        let mut late = armed(shape(2.0), 0.0);
        late.start_at(0.0, 0.0);
        assert!((0..200).all(|_| on_hand(&mut late, 0.0, 0.0) == 0.0));
    }

    #[test]
    fn whatever_takes_over_from_a_pulse_begins_without_its_force() {
        let mut pulse = armed(shape(2.0), 0.0);
        for _ in 0..100 {
            on_hand(&mut pulse, 0.0, 0.0);
        }
        let mut scene = Renderer::new(&Scene::paper(), Scheme::Exact, PERIOD_S).expect("it is sound");
        assert_eq!(scene.take_over(&pulse), 0.0);
        assert_eq!(scene.tick(0.0, 0.0, 0.0).coupling_force, 0.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn force_and_time_are_bounded_whatever_the_device_says(
            samples in prop::collection::vec((any::<f64>(), -0.03..0.03f64, -0.5..0.5f64), 400),
        ) {
            let mut pulse = armed(shape(2.0), 0.0);
            for (k, (elapsed_s, position, velocity)) in samples.into_iter().enumerate() {
                let force = -pulse.tick(elapsed_s, position, velocity).coupling_force;
                prop_assert!((0.0..=2.0).contains(&force), "{force} N");
                prop_assert!(k < 200 || force == 0.0, "{force} N in tick {k}");
            }
        }
    }

    #[test]
    fn a_pulse_beyond_the_bounds_is_refused_by_its_field() {
        for (shape, field) in [
            (
                PulseShape {
                    hold_s: 0.25,
                    ..shape(1.0)
                },
                "duration",
            ),
            (
                PulseShape {
                    rise_s: -0.1,
                    ..shape(1.0)
                },
                "rise",
            ),
            (
                PulseShape {
                    travel_limit_m: 0.021,
                    ..shape(1.0)
                },
                "travel",
            ),
            (
                PulseShape {
                    speed_limit_mps: 0.31,
                    ..shape(1.0)
                },
                "speed",
            ),
            (
                PulseShape {
                    wrong_way_limit_m: f64::NAN,
                    ..shape(1.0)
                },
                "wrong way",
            ),
            (shape(f64::INFINITY), "force"),
            (shape(f64::NAN), "force"),
        ] {
            let error = Renderer::pulse(shape, PERIOD_S).expect_err(field);
            assert_eq!(error.field, field);
            assert!(error.to_string().contains("out of range"), "{error}");
        }
    }
}
