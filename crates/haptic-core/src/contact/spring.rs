//! A contact that holds by a spring up to its static limit, then slides, and holds again when it has
//! come to rest.

use super::leg::Leg;
use super::level::Level;
use super::state::{Contact, ContactMemory, LawContact, StaticLimit};
use super::yielding::{FrictionLine, StraightContact, YieldingContact};
use crate::directional::{Direction, Directional};
use crate::math::flush;
use crate::snapshot::Archive;

/// What a stuck spring is anchored to when a slide ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Reseat {
    /// Where the force does not jump.
    #[default]
    Continuous,
    /// Where the spring has the whole static force, as in the paper's slides and in Haessig and Friedland's model. Each
    /// re-stick makes a jump of `Fs - Fd` and an energy of `(Fs^2 - Fd^2)/2 Kp`: for reproduction only.
    #[cfg_attr(feature = "serde", serde(alias = "published"))]
    Slides,
}

/// A stuck spring, and its sliding friction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpringContact<L, R> {
    /// The spring's stiffness by the direction that it is loaded in, N/m.
    pub(crate) stiffness: Directional,
    /// Damping while stuck, N s/m.
    pub(crate) damping: f64,
    /// Static limit after a long rest, N.
    pub(crate) static_force: Directional,
    pub(crate) static_limit: R,
    /// Friction while sliding.
    pub(crate) level: L,
    pub(crate) viscous: Directional,
    /// `DV`, m/s.
    pub(crate) velocity_threshold: f64,
    pub(crate) reseat: Reseat,
    pub(crate) state: SpringState,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SpringState {
    /// The spring's force, N, signed.
    Stuck { force: f64 },
    /// Whether the slide has been faster than the threshold.
    Sliding { direction: Direction, armed: bool },
}

impl SpringState {
    pub(crate) const AT_REST: Self = Self::Stuck { force: 0.0 };

    fn archive(&mut self, archive: &mut Archive<'_>) {
        let (mut slide, mut force, mut armed) = match *self {
            Self::Stuck { force } => (None, force, false),
            Self::Sliding { direction, armed } => (Some(direction), 0.0, armed),
        };
        archive.choice(
            "slide",
            &mut slide,
            &[None, Some(Direction::Positive), Some(Direction::Negative)],
        );
        archive.number("spring_force_N", &mut force);
        archive.flag("slide_armed", &mut armed);
        *self = match slide {
            None => Self::Stuck { force },
            Some(direction) => Self::Sliding { direction, armed },
        };
    }
}

/// A spring that is this near its limit, as a share of it, has reached it: displacements are found
/// to rounding only.
const AT_THE_LIMIT: f64 = 1e-12;

impl<L: Level, R: StaticLimit> SpringContact<L, R> {
    pub(super) fn limit(&self, direction: Direction) -> f64 {
        let limit = self
            .static_limit
            .now(self.static_force.get(direction), self.level.kinetic(direction));
        // A static limit below the kinetic force is that force: what broke loose between them would
        // be stopped at once.
        limit.max(self.level.at(direction, 0.0).min(self.level.kinetic(direction)))
    }

    pub(super) fn reached(&self, direction: Direction, force: f64) -> bool {
        direction.sign() * force >= self.limit(direction) * (1.0 - AT_THE_LIMIT)
    }

    /// Holds on to where it is, with the force that there was.
    pub(super) fn stick(&mut self, force: f64) {
        let direction = Direction::of(force);
        self.static_limit.begin_at(
            self.static_force.get(direction),
            self.level.kinetic(direction),
            force.abs(),
        );
        let force = match self.reseat {
            Reseat::Continuous => force.abs().min(self.limit(direction)),
            Reseat::Slides => self.static_force.get(direction),
        };
        self.state = SpringState::Stuck {
            force: flush(direction.sign() * force),
        };
    }
}

impl<R: StaticLimit> StraightContact for SpringContact<Directional, R> {
    fn line(&self, direction: Direction) -> FrictionLine {
        let held = match self.state {
            SpringState::Stuck { force } if !self.reached(direction, force) => force,
            _ => {
                return FrictionLine {
                    force: self.level.get(direction),
                    stiffness: 0.0,
                    damping: self.viscous.get(direction),
                    kink: f64::INFINITY,
                };
            }
        };
        let along = direction.sign() * held;
        let stiffness = if along < 0.0 {
            self.stiffness.get(Direction::of(held))
        } else {
            self.stiffness.get(direction)
        };
        // Unloaded first, then loaded the other way, with another stiffness maybe.
        let to = if along < 0.0 && !self.stiffness.is_symmetric() {
            0.0
        } else {
            self.limit(direction)
        };
        FrictionLine {
            force: along,
            stiffness,
            damping: self.damping,
            kink: (to - along) / stiffness,
        }
    }
}

impl<L: Level, R: StaticLimit> LawContact for SpringContact<L, R> {
    fn force_at_rest(&self) -> f64 {
        match self.state {
            SpringState::Stuck { force } => force,
            SpringState::Sliding { direction, .. } => direction.sign() * self.level.at(direction, 0.0),
        }
    }

    fn recall(&mut self, memory: &ContactMemory, speed: f64) {
        self.static_limit.begin(memory.dwell_s);
        self.state = if let Some(direction) = memory.slide {
            memory.set_off(&mut self.level, direction, self.static_force.get(direction));
            SpringState::Sliding {
                direction,
                armed: speed > self.velocity_threshold,
            }
        } else {
            SpringState::Stuck {
                force: memory.held(|direction| self.limit(direction)),
            }
        };
    }

    fn memory(&self) -> ContactMemory {
        let memory = match self.state {
            SpringState::Stuck { .. } => ContactMemory::RESTED,
            SpringState::Sliding { direction, .. } => {
                ContactMemory::sliding(&self.level, direction, self.static_force.get(direction))
            }
        };
        ContactMemory {
            force: self.force_at_rest(),
            dwell_s: self.static_limit.dwell_s(),
            ..memory
        }
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        self.state.archive(archive);
        self.level.archive(archive);
        self.static_limit.archive(archive);
    }

    fn contact(&self, _direction: Direction, _speed: f64) -> Contact {
        match self.state {
            SpringState::Stuck { .. } => Contact::Stuck,
            SpringState::Sliding { direction, .. } => Contact::Sliding(direction),
        }
    }

    fn facing(&self) -> Direction {
        match self.state {
            SpringState::Stuck { force } => Direction::of(force),
            SpringState::Sliding { direction, .. } => direction,
        }
    }
}

impl<L: Level, R: StaticLimit> YieldingContact for SpringContact<L, R> {
    fn advance(&mut self, leg: &Leg) {
        let direction = leg.direction;
        if let SpringState::Sliding { direction: slid, .. } = self.state
            && slid != direction
        {
            // It turned round within the leg: the slide ends, and what follows unloads the
            // spring.
            self.stick(self.friction(0.0));
        }
        match &mut self.state {
            SpringState::Stuck { force } => {
                self.static_limit.rest(leg.duration_s);
                let sign = direction.sign();
                let mut along = sign * *force;
                let mut distance = leg.distance;
                if along < 0.0 {
                    let unloading = self.stiffness.get(Direction::of(*force));
                    let by = distance.min(-along / unloading);
                    along = (along + unloading * by).min(0.0);
                    distance -= by;
                }
                along += self.stiffness.get(direction) * distance;
                *force = flush(sign * along);
                let force = *force;
                if leg.distance > 0.0 && self.reached(direction, force) {
                    self.level.set_off(direction, self.limit(direction));
                    self.state = SpringState::Sliding {
                        direction,
                        armed: leg.to_speed > self.velocity_threshold,
                    };
                }
            }
            SpringState::Sliding { armed, .. } => *armed |= leg.to_speed > self.velocity_threshold,
        }
    }

    fn friction(&self, velocity: f64) -> f64 {
        match self.state {
            SpringState::Stuck { force } => force + self.damping * velocity,
            SpringState::Sliding { direction, .. } => {
                direction.sign() * self.level.at(direction, velocity.abs()) + self.viscous.get(direction) * velocity
            }
        }
    }

    fn stored_energy(&self) -> f64 {
        // A sliding spring stays deflected by the kinetic force: that much is there again when it
        // sticks.
        let force = self.force_at_rest();
        0.5 * force * force / self.stiffness.get(Direction::of(force))
    }

    fn fall_level(&self) -> (bool, f64) {
        match self.state {
            SpringState::Sliding { armed, .. } => (armed, self.velocity_threshold),
            SpringState::Stuck { .. } => (false, 0.0),
        }
    }

    fn fall(&mut self, _direction: Direction, speed: f64) {
        if let SpringState::Sliding { direction, .. } = self.state {
            self.stick(self.friction(direction.sign() * speed));
        }
    }

    fn sampled(&mut self, velocity: f64) {
        let SpringState::Sliding { direction, .. } = self.state else {
            return;
        };
        if velocity.abs() < self.velocity_threshold {
            // The friction of the slide that ends, also where the velocity has turned round
            // already.
            let speed = (direction.sign() * velocity).max(0.0);
            self.stick(self.friction(direction.sign() * speed));
        }
    }
}
