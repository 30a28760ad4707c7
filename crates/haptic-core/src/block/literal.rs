//! The paper's own tick: one semi-implicit Euler step of Karnopp's model, kept as the baseline. With more than one step a tick
//! the device is taken linear between its samples.
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
use core::num::NonZeroU32;

/// The literal scheme for one scene.
#[derive(Clone, Copy, Debug)]
pub struct LiteralBlock {
    mass: f64,
    stiffness: f64,
    damping: f64,
    law: Karnopp,
    substeps: NonZeroU32,
    state: BlockState,
}

impl LiteralBlock {
    /// Compiles a scene that [`Scene::validate`] accepts.
    #[must_use]
    pub fn new(scene: &Scene, substeps: NonZeroU32, state: BlockState) -> Self {
        let Friction::Karnopp(law) = scene.friction;
        Self {
            mass: scene.block.mass,
            stiffness: scene.coupling.stiffness,
            damping: scene.coupling.damping,
            law,
            substeps,
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

    /// Takes the Euler steps over the `elapsed_s` seconds that ended with the device at `position` and `velocity`.
    pub fn tick(&mut self, elapsed_s: f64, position: f64, velocity: f64, sink: &mut impl EventSink) -> Rendered {
        let mut events = 0;
        if elapsed_s > 0.0 {
            let from = self.state;
            let count = f64::from(self.substeps.get());
            let step_s = elapsed_s / count;
            for k in 0..self.substeps.get() {
                // Euler's step looks forward from its start, so it knows the device as it was there.
                let share = f64::from(k) / count;
                self.state.device_position = from.device_position + share * (position - from.device_position);
                self.state.device_velocity = from.device_velocity + share * (velocity - from.device_velocity);
                let before = self.state.contact;
                self.step(step_s, sink);
                if before != self.state.contact {
                    events += 1;
                    sink.contact_changed(f64::from(k + 1) * step_s, before, self.state.contact);
                }
            }
        }
        self.state.device_position = position;
        self.state.device_velocity = velocity;
        if !(self.state.position.is_finite() && self.state.velocity.is_finite()) {
            self.state = BlockState::new(position, 0.0, position, velocity);
        }
        Rendered {
            coupling_force: self.coupling_force(),
            events,
            work_exhausted: false,
        }
    }

    fn coupling_force(&self) -> f64 {
        let s = &self.state;
        self.stiffness * (s.device_position - s.position) + self.damping * (s.device_velocity - s.velocity)
    }

    fn step(&mut self, elapsed_s: f64, sink: &mut impl EventSink) {
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
        let displacement = elapsed_s * self.state.velocity;
        sink.slid(friction, displacement);
        self.state.position += displacement;
        self.state.contact = Contact::Sliding(Direction::of(self.state.velocity));
    }
}
