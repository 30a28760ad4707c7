//! The paper's own tick: one semi-implicit Euler step of Karnopp's model, kept as the baseline.
//!
//! ```text
//! stuck while |w| < DV and -Fs- <= F <= Fs+:  w = 0
//! otherwise:  w += T (F - friction)/M;  x += T w
//! ```
//!
//! It is what the slides print, and what most rigs run. It has a limit cycle of velocity amplitude
//! `V = 2 Fd T / (4 M - K T^2 - 2 (B + b) T)`, diverges below `M = K T^2/4 + (B + b) T/2`, and creates energy in
//! friction; the [exact](super::exact) scheme has none of these.

use super::{BlockState, Contact, EventSink, Rendered};
use crate::friction::{Friction, Karnopp};
use crate::parameters::Direction;
use crate::scene::Scene;

/// The literal scheme for one scene.
#[derive(Clone, Copy, Debug)]
pub struct LiteralBlock {
    mass: f64,
    stiffness: f64,
    damping: f64,
    law: Karnopp,
    state: BlockState,
}

impl LiteralBlock {
    /// Compiles a scene that [`Scene::validate`] accepts.
    #[must_use]
    pub fn new(scene: &Scene, state: BlockState) -> Self {
        let Friction::Karnopp(law) = scene.friction;
        Self {
            mass: scene.block.mass,
            stiffness: scene.coupling.stiffness,
            damping: scene.coupling.damping,
            law,
            state,
        }
    }

    /// The block and the last device sample.
    #[must_use]
    pub fn state(&self) -> &BlockState {
        &self.state
    }

    pub(crate) fn set_state(&mut self, state: BlockState) {
        self.state = state.consistent();
    }

    /// Takes one Euler step over the `elapsed_s` seconds that ended with the device at `position` and `velocity`.
    pub fn tick(&mut self, elapsed_s: f64, position: f64, velocity: f64, sink: &mut impl EventSink) -> Rendered {
        let before = self.state.contact;
        if elapsed_s > 0.0 {
            // Euler's step looks forward from the start of the interval, so it knows the sample measured there.
            self.step(elapsed_s);
        }
        self.state.device_position = position;
        self.state.device_velocity = velocity;
        if !(self.state.position.is_finite() && self.state.velocity.is_finite()) {
            self.state = BlockState::new(position, 0.0, position, velocity);
        }
        let after = self.state.contact;
        if before != after {
            sink.contact_changed(elapsed_s, before, after);
        }
        Rendered {
            coupling_force: self.coupling_force(),
            events: u32::from(before != after),
            work_exhausted: false,
        }
    }

    fn coupling_force(&self) -> f64 {
        let s = &self.state;
        self.stiffness * (s.device_position - s.position) + self.damping * (s.device_velocity - s.velocity)
    }

    fn step(&mut self, elapsed_s: f64) {
        let slow = self.state.velocity.abs() < self.law.velocity_threshold || self.state.velocity == 0.0;
        if slow {
            self.state.velocity = 0.0;
            self.state.contact = Contact::Stuck;
        }
        let force = self.coupling_force();
        let direction = if slow {
            let pulled = Direction::of(force);
            if force.abs() <= self.law.breakaway_force().get(pulled) {
                return;
            }
            pulled
        } else {
            Direction::of(self.state.velocity)
        };
        let friction = direction.sign() * self.law.dynamic_force.get(direction)
            + self.law.viscous.get(direction) * self.state.velocity;
        self.state.velocity += elapsed_s * (force - friction) / self.mass;
        self.state.position += elapsed_s * self.state.velocity;
        self.state.contact = Contact::Sliding(Direction::of(self.state.velocity));
    }
}
