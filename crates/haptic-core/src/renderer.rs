//! What a scene compiles to: the block of one scheme behind one interface.

use crate::block::exact::ExactBlock;
use crate::block::literal::LiteralBlock;
use crate::block::{BlockState, Contact, EventSink, Rendered};
use crate::friction::Friction;
use crate::math::sqrt;
use crate::parameters::Direction;
use crate::scene::{Coupling, Scene, SceneError};
use alloc::string::{String, ToString};
use core::fmt;
use core::num::NonZeroU32;
use core::str::FromStr;
use thiserror::Error;

/// How the block is moved on from one sample to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheme {
    /// Solved in closed form between the samples: see [`block::exact`](crate::block::exact).
    #[default]
    Exact,
    /// The paper's Euler step: see [`block::literal`](crate::block::literal).
    Literal {
        /// Steps a tick; the paper has one.
        substeps: NonZeroU32,
    },
}

impl Scheme {
    /// The paper's own: one Euler step a tick.
    pub const LITERAL: Self = Self::Literal {
        substeps: NonZeroU32::MIN,
    };
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exact => f.write_str("exact"),
            Self::Literal {
                substeps: NonZeroU32::MIN,
            } => f.write_str("literal"),
            Self::Literal { substeps } => write!(f, "literal:{substeps}"),
        }
    }
}

/// A text that names no scheme.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "there is no scheme `{0}`; there are exact, literal, and literal:N with N steps a tick, from 1 to {MAX_SUBSTEPS}"
)]
pub struct UnknownScheme(String);

/// Most Euler steps a tick: more takes longer than any tick lasts.
const MAX_SUBSTEPS: u32 = 10_000;

impl FromStr for Scheme {
    type Err = UnknownScheme;

    fn from_str(text: &str) -> Result<Self, UnknownScheme> {
        let unknown = || UnknownScheme(text.to_string());
        match text {
            "exact" => Ok(Self::Exact),
            "literal" => Ok(Self::LITERAL),
            _ => {
                let substeps: NonZeroU32 = text
                    .strip_prefix("literal:")
                    .and_then(|count| count.parse().ok())
                    .filter(|count: &NonZeroU32| count.get() <= MAX_SUBSTEPS)
                    .ok_or_else(unknown)?;
                Ok(Self::Literal { substeps })
            }
        }
    }
}

/// How far from the hand a block is put at most when its coupling changes, m: farther, a soft coupling would pull steadily wherever the hand went.
pub const FARTHEST_RESEAT_M: f64 = 0.02;

/// A scene, ready to be rendered.
#[derive(Clone, Copy, Debug)]
pub struct Renderer {
    compiled: Compiled,
    mass: f64,
    coupling: Coupling,
    /// The contact of a block at rest: sliding where no friction can hold it.
    at_rest: Contact,
}

#[derive(Clone, Copy, Debug)]
enum Compiled {
    Exact(ExactBlock),
    Literal(LiteralBlock),
}

impl Renderer {
    /// Compiles a scene for ticks of about `period_s` seconds. The block starts at rest at the origin; see
    /// [`start_at`](Self::start_at).
    ///
    /// # Errors
    /// What [`Scene::validate`] and [`Scene::validate_rate`] refuse.
    pub fn new(scene: &Scene, scheme: Scheme, period_s: f64) -> Result<Self, SceneError> {
        scene.validate()?;
        scene.validate_rate(period_s)?;
        let Friction::Karnopp(law) = &scene.friction;
        let limit = law.breakaway_force();
        let at_rest = if limit.positive == 0.0 && limit.negative == 0.0 {
            Contact::Sliding(Direction::Positive)
        } else {
            Contact::Stuck
        };
        let mut state = BlockState::new(0.0, 0.0, 0.0, 0.0);
        state.contact = at_rest;
        Ok(Self {
            compiled: match scheme {
                Scheme::Exact => Compiled::Exact(ExactBlock::new(scene, state)),
                Scheme::Literal { substeps } => Compiled::Literal(LiteralBlock::new(scene, substeps, state)),
            },
            mass: scene.block.mass,
            coupling: scene.coupling,
            at_rest,
        })
    }

    /// The block and the last device sample.
    #[must_use]
    pub fn state(&self) -> &BlockState {
        match &self.compiled {
            Compiled::Exact(block) => block.state(),
            Compiled::Literal(block) => block.state(),
        }
    }

    /// Puts the block somewhere, in motion or at rest, without a tick.
    pub fn set_state(&mut self, state: BlockState) {
        match &mut self.compiled {
            Compiled::Exact(block) => block.set_state(state),
            Compiled::Literal(block) => block.set_state(state),
        }
    }

    /// Puts the block at the device, moving with it, so that the coupling starts without force.
    pub fn start_at(&mut self, position: f64, velocity: f64) {
        let mut state = BlockState::new(position, velocity, position, velocity);
        if velocity == 0.0 {
            state.contact = self.at_rest;
        }
        self.set_state(state);
    }

    /// Moves the block on by `elapsed_s` seconds, in which the device went to `position` (m) and `velocity` (m/s).
    pub fn tick(&mut self, elapsed_s: f64, position: f64, velocity: f64) -> Rendered {
        self.tick_with_events(elapsed_s, position, velocity, &mut ())
    }

    /// Like [`tick`](Self::tick), and tells `sink` of each change of contact.
    pub fn tick_with_events(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut impl EventSink,
    ) -> Rendered {
        match &mut self.compiled {
            Compiled::Exact(block) => block.tick(elapsed_s, position, velocity, sink),
            Compiled::Literal(block) => block.tick(elapsed_s, position, velocity, sink),
        }
    }

    /// Takes over the motion of the renderer that this one replaces, so that the hand feels no jerk.
    ///
    /// The block keeps its position, velocity and contact, but for what a stiffer grip would make a kick of. Where the coupling itself changed, the block is re-seated so
    /// that the force in the coupling, which is what the hand feels, stays as it was. A coupling too soft for that within
    /// [`FARTHEST_RESEAT_M`] is re-seated so far; the force then steps by the value returned, N (the old coupling force less the new).
    pub fn take_over(&mut self, old: &Self) -> f64 {
        let mut state = *old.state();
        let (now, was) = (self.coupling, old.coupling);
        let mut step = 0.0;
        // In a stiffer grip, or with more mass, the same motion against the hand would swing to a larger force, |v - w| sqrt(K M): it is slowed to
        // what it would have come to. A stuck block does not move, and is pulled as the new grip pulls.
        let swing = (was.stiffness * old.mass) / (now.stiffness * self.mass);
        if matches!(state.contact, Contact::Sliding(_)) && swing < 1.0 {
            state.velocity = state.device_velocity + (state.velocity - state.device_velocity) * sqrt(swing);
        }
        if now != was || state.velocity != old.state().velocity {
            let force = was.stiffness * (state.device_position - state.position)
                + was.damping * (state.device_velocity - old.state().velocity);
            let damped = now.damping * (state.device_velocity - state.velocity);
            let deflection = if now.stiffness > 0.0 {
                ((force - damped) / now.stiffness).clamp(-FARTHEST_RESEAT_M, FARTHEST_RESEAT_M)
            } else {
                state.device_position - state.position
            };
            state.position = state.device_position - deflection;
            let stays = deflection.abs() < FARTHEST_RESEAT_M && now.stiffness > 0.0;
            step = if stays {
                0.0
            } else {
                force - damped - now.stiffness * deflection
            };
        }
        self.set_state(state);
        step
    }
}
