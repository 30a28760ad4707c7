//! What a scene compiles to: the block of one scheme behind one interface.

use crate::block::exact::ExactBlock;
use crate::block::literal::LiteralBlock;
use crate::block::{BlockState, Contact, EventSink, Rendered};
use crate::friction::Friction;
use crate::parameters::Direction;
use crate::scene::{Coupling, Scene, SceneError};

/// How the block is moved on from one sample to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheme {
    /// Solved in closed form between the samples: see [`block::exact`](crate::block::exact).
    #[default]
    Exact,
    /// The paper's Euler step: see [`block::literal`](crate::block::literal).
    Literal,
}

/// A scene, ready to be rendered.
#[derive(Clone, Copy, Debug)]
pub struct Renderer {
    compiled: Compiled,
    coupling: Coupling,
    /// The contact of a block at rest: sliding where no friction can hold it.
    at_rest: Contact,
}

#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is one at a time; a box would be an indirection in every tick"
)]
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
                Scheme::Literal => Compiled::Literal(LiteralBlock::new(scene, state)),
            },
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
    /// The block keeps its position, velocity and contact. Where the coupling itself changed, the block is re-seated so
    /// that the force in the coupling, which is what the hand feels, stays as it was. Without stiffness there is
    /// nothing to re-seat; the force then steps by the value returned, N (the old coupling force less the new).
    pub fn take_over(&mut self, old: &Self) -> f64 {
        let mut state = *old.state();
        let (now, was) = (self.coupling, old.coupling);
        let mut step = 0.0;
        if now != was {
            let force = was.stiffness * (state.device_position - state.position)
                + was.damping * (state.device_velocity - state.velocity);
            let damped = now.damping * (state.device_velocity - state.velocity);
            if now.stiffness > 0.0 {
                state.position = state.device_position - (force - damped) / now.stiffness;
            } else {
                step = force - damped;
            }
        }
        self.set_state(state);
        step
    }
}
