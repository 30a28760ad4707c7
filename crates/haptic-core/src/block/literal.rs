//! The paper's own tick: one semi-implicit Euler step of Karnopp's model, kept as the baseline, and
//! the same step for the other laws. With more than one step a tick the device is taken linear
//! between its samples.
//!
//! ```text
//! stuck while |w| < DV and -Fs- <= F <= Fs+:  w = 0
//! otherwise:  w += T (F - friction)/M;  x += T w
//! ```
//!
//! The slides print it, and most rigs run it. It has a limit cycle of velocity amplitude
//! `V = 2 Fd T / (4 M - K T^2 - 2 (B + b) T)`, diverges below `M = K T^2/4 + (B + b) T/2`, and
//! creates energy in friction; the [exact](super::exact) scheme has none of these.

use super::body::{BlockState, Body, Coupling, EventSink, Moving, Rendered};
use crate::contact::{Contact, ContactMemory, Leg, Level, StaticLimit, YieldingContact};
use crate::directional::{Direction, Directional};
use crate::snapshot::Archive;
use core::fmt::Debug;
use core::num::NonZeroU32;

/// The literal scheme for one scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LiteralBlock<L> {
    mass: f64,
    coupling: Coupling,
    law: L,
    substeps: NonZeroU32,
    state: BlockState,
}

/// Friction as one Euler step sees it.
pub(crate) trait SteppedLaw: Clone + Debug + Send + Sync + 'static {
    /// The velocity from which the step sets off; `None` where the block is held still. `pull` is
    /// the coupling force on a block at rest.
    fn set_off(&mut self, velocity: f64, pull: f64, step_s: f64) -> Option<f64>;
    /// Friction in motion, N, signed; from rest in the direction of `pull`.
    fn friction(&self, velocity: f64, pull: f64) -> f64;
    /// After the step.
    fn moved(&mut self, _displacement: f64, _from: f64, _to: f64, _step_s: f64) {}
    /// The contact.
    fn contact(&self, velocity: f64) -> Contact;
    /// The contact of a block at rest.
    fn at_rest(&self) -> Contact;
    /// Saves or loads its state.
    fn archive(&mut self, archive: &mut Archive<'_>);
    /// Energy that the deflection holds, J.
    fn stored_energy(&self) -> f64 {
        0.0
    }
    /// Goes on from what a contact remembers, at a speed, m/s.
    fn recall(&mut self, memory: &ContactMemory, speed: f64);
    /// What it remembers, at a velocity, m/s, under the coupling force `pull`, N.
    fn memory(&self, velocity: f64, pull: f64) -> ContactMemory;
}

/// Karnopp's law, rigid when stuck.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RigidLaw<L, R> {
    /// The static limit after a long rest, N.
    pub(crate) static_force: Directional,
    pub(crate) static_limit: R,
    pub(crate) level: L,
    /// `b`, N s/m.
    pub(crate) viscous: Directional,
    /// `DV`, m/s.
    pub(crate) velocity_threshold: f64,
    pub(crate) stuck: bool,
}

impl<L: Level, R: StaticLimit> SteppedLaw for RigidLaw<L, R> {
    fn set_off(&mut self, velocity: f64, pull: f64, step_s: f64) -> Option<f64> {
        let slow = velocity.abs() < self.velocity_threshold || velocity == 0.0;
        if !slow {
            self.stuck = false;
            return Some(velocity);
        }
        if self.stuck {
            self.static_limit.rest(step_s);
        } else {
            let slid = Direction::of(velocity);
            self.static_limit.begin_at(
                self.static_force.get(slid),
                self.level.kinetic(slid),
                self.level.at(slid, 0.0),
            );
        }
        let pulled = Direction::of(pull);
        let limit = self
            .static_limit
            .now(self.static_force.get(pulled), self.level.kinetic(pulled));
        self.stuck = pull.abs() <= limit;
        if self.stuck {
            return None;
        }
        self.level.set_off(pulled, limit);
        Some(0.0)
    }

    fn friction(&self, velocity: f64, pull: f64) -> f64 {
        let direction = Direction::of(if velocity == 0.0 { pull } else { velocity });
        direction.sign() * self.level.at(direction, velocity.abs()) + self.viscous.get(direction) * velocity
    }

    fn contact(&self, velocity: f64) -> Contact {
        if self.stuck {
            Contact::Stuck
        } else {
            Contact::Sliding(Direction::of(velocity))
        }
    }

    fn at_rest(&self) -> Contact {
        if self.static_force == Directional::both(0.0) {
            Contact::Sliding(Direction::Positive)
        } else {
            Contact::Stuck
        }
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.flag("stuck", &mut self.stuck);
        self.level.archive(archive);
        self.static_limit.archive(archive);
    }

    fn recall(&mut self, memory: &ContactMemory, _speed: f64) {
        self.static_limit.begin(memory.dwell_s);
        self.stuck = memory.slide.is_none();
        if let Some(direction) = memory.slide {
            memory.set_off(&mut self.level, direction, self.static_force.get(direction));
        }
    }

    fn memory(&self, velocity: f64, pull: f64) -> ContactMemory {
        let dwell_s = self.static_limit.dwell_s();
        // What nothing can hold has no slide to go on with.
        if self.stuck || self.at_rest() != Contact::Stuck {
            return ContactMemory {
                force: pull,
                dwell_s,
                ..ContactMemory::RESTED
            };
        }
        let direction = Direction::of(if velocity == 0.0 { pull } else { velocity });
        ContactMemory {
            force: direction.sign() * self.level.at(direction, velocity.abs()),
            dwell_s,
            ..ContactMemory::sliding(&self.level, direction, self.static_force.get(direction))
        }
    }
}

/// A law whose contact gives way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Yielding<C>(pub(crate) C);

impl<C: YieldingContact> SteppedLaw for Yielding<C> {
    fn set_off(&mut self, velocity: f64, _pull: f64, _step_s: f64) -> Option<f64> {
        Some(velocity)
    }

    fn friction(&self, velocity: f64, _pull: f64) -> f64 {
        if velocity == 0.0 {
            self.0.force_at_rest()
        } else {
            self.0.friction(velocity)
        }
    }

    fn moved(&mut self, displacement: f64, from: f64, to: f64, step_s: f64) {
        if !displacement.is_finite() {
            // The scheme has blown up: the tick starts over.
            return;
        }
        let direction = Direction::of(displacement);
        self.0.advance(&Leg {
            direction,
            distance: displacement.abs(),
            from_speed: from.abs(),
            to_speed: to.abs(),
            duration_s: step_s,
        });
        self.0.sampled(to);
    }

    fn contact(&self, velocity: f64) -> Contact {
        self.0.contact_at(velocity)
    }

    fn at_rest(&self) -> Contact {
        self.0.contact_at(0.0)
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        self.0.archive(archive);
    }

    fn stored_energy(&self) -> f64 {
        self.0.stored_energy()
    }

    fn recall(&mut self, memory: &ContactMemory, speed: f64) {
        self.0.recall(memory, speed);
    }

    fn memory(&self, _velocity: f64, _pull: f64) -> ContactMemory {
        self.0.memory()
    }
}

impl<L: SteppedLaw> LiteralBlock<L> {
    pub(crate) fn new(mass: f64, coupling: Coupling, law: L, substeps: NonZeroU32) -> Self {
        let mut state = BlockState::new(0.0, 0.0, 0.0, 0.0);
        state.contact = law.at_rest();
        Self {
            mass,
            coupling,
            law,
            substeps,
            state,
        }
    }

    fn step(&mut self, step_s: f64, sink: &mut impl EventSink) {
        // A block that is slow enough to stick is pulled as one at rest.
        let still = BlockState {
            velocity: 0.0,
            ..self.state
        };
        let Some(from) = self
            .law
            .set_off(self.state.velocity, self.coupling.force(&still), step_s)
        else {
            self.state.velocity = 0.0;
            self.state.contact = Contact::Stuck;
            return;
        };
        self.state.velocity = from;
        let before = self.law.stored_energy();
        let pull = self.coupling.force(&self.state);
        let friction = self.law.friction(from, pull);
        self.state.velocity += step_s * (pull - friction) / self.mass;
        let displacement = step_s * self.state.velocity;
        self.state.position += displacement;
        self.law.moved(displacement, from, self.state.velocity, step_s);
        sink.dissipated(friction * displacement - (self.law.stored_energy() - before));
        self.state.contact = self.law.contact(self.state.velocity);
    }
}

impl<L: SteppedLaw> Moving for LiteralBlock<L> {
    /// Takes the Euler steps over the `elapsed_s` seconds that ended with the device at `position`
    /// and `velocity`.
    fn advance(&mut self, elapsed_s: f64, position: f64, velocity: f64, sink: &mut impl EventSink) -> Rendered {
        let mut events = 0;
        if elapsed_s > 0.0 {
            let from = self.state;
            let count = f64::from(self.substeps.get());
            let step_s = elapsed_s / count;
            for k in 0..self.substeps.get() {
                // Euler's step looks forward from its start, so it knows the device as it was
                // there.
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
        self.state = self.state.flushed();
        self.state.device_position = position;
        self.state.device_velocity = velocity;
        if !self.state.is_finite() {
            self.set_state(BlockState::new(position, 0.0, position, velocity));
        }
        Rendered {
            coupling_force: self.coupling_force(),
            events,
            work_exhausted: false,
        }
    }
}

impl<L: SteppedLaw> Body for LiteralBlock<L> {
    fn state(&self) -> BlockState {
        self.state
    }

    fn memory(&self) -> ContactMemory {
        self.law.memory(self.state.velocity, self.coupling_force())
    }

    fn set_state(&mut self, state: BlockState) {
        self.law.recall(&state.memory, state.velocity.abs());
        self.state = state.consistent();
    }

    fn at_rest(&self) -> Contact {
        self.law.at_rest()
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        self.state.archive(archive);
        self.law.archive(archive);
    }

    fn coupling_force(&self) -> f64 {
        self.coupling.force(&self.state)
    }
}
