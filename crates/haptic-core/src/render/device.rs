//! Friction on the device itself, without a block: the hand's own motion moves the contact, and the
//! force is its friction.

use crate::block::{BlockState, EventSink, Moving, Rendered};
use crate::contact::{Contact, Stroke, YieldingContact};
use crate::direction::Direction;
use crate::directional::Directional;

/// Drag: one multiplication.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ViscousSurface {
    viscous: Directional,
    position: f64,
    velocity: f64,
}

impl ViscousSurface {
    /// `viscous` is `b`, N s/m.
    pub(crate) fn new(viscous: Directional) -> Self {
        Self {
            viscous,
            position: 0.0,
            velocity: 0.0,
        }
    }
}

impl Moving for ViscousSurface {
    fn advance(
        &mut self,
        _elapsed_s: f64,
        position: f64,
        velocity: f64,
        _sink: &mut (impl EventSink + ?Sized),
    ) -> Rendered {
        (self.position, self.velocity) = (position, velocity);
        Rendered {
            coupling_force: self.felt(),
            ..Rendered::default()
        }
    }

    fn state(&self) -> BlockState {
        let mut state = BlockState::new(self.position, self.velocity, self.position, self.velocity);
        state.contact = Contact::Sliding(Direction::of(self.velocity));
        state
    }

    fn set_state(&mut self, state: BlockState) {
        (self.position, self.velocity) = (state.device_position, state.device_velocity);
    }

    fn at_rest(&self) -> Contact {
        Contact::Sliding(Direction::Positive)
    }

    fn felt(&self) -> f64 {
        self.viscous.get(Direction::of(self.velocity)) * self.velocity
    }

    fn friction(&self) -> f64 {
        self.felt()
    }

    fn seat(&mut self, _force: f64) {
        // Drag holds nothing.
    }
}

/// The contact of a law under the device.
#[derive(Clone, Copy, Debug)]
pub(crate) struct YieldingSurface<C> {
    law: C,
    position: f64,
    velocity: f64,
    contact: Contact,
}

impl<C: YieldingContact> YieldingSurface<C> {
    pub(crate) fn new(law: C) -> Self {
        let contact = law.contact(0.0);
        Self {
            law,
            position: 0.0,
            velocity: 0.0,
            contact,
        }
    }
}

impl<C: YieldingContact> Moving for YieldingSurface<C> {
    fn advance(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut (impl EventSink + ?Sized),
    ) -> Rendered {
        let mut events = 0;
        if elapsed_s > 0.0 {
            let by = position - self.position;
            // Which way it went is for the positions to say: the velocity is an estimate, and late.
            let direction = Direction::of(if by == 0.0 { velocity } else { by });
            let (before, held) = (self.law.stored_energy(), self.law.force_at_rest());
            self.law.advance(&Stroke {
                direction,
                distance: by.abs(),
                from_speed: self.velocity.abs(),
                to_speed: velocity.abs(),
                elapsed_s,
            });
            self.law.sampled(velocity);
            if sink.listens() {
                let work = 0.5 * (held + self.law.force_at_rest()) * by;
                sink.dissipated(work - (self.law.stored_energy() - before));
            }
            let speed = velocity.abs();
            let contact = self.law.contact(direction.sign() * speed);
            if contact != self.contact {
                events = 1;
                sink.contact_changed(elapsed_s, self.contact, contact);
                self.contact = contact;
            }
        }
        (self.position, self.velocity) = (position, velocity);
        Rendered {
            coupling_force: self.felt(),
            events,
            work_exhausted: false,
        }
    }

    fn state(&self) -> BlockState {
        let mut state = BlockState::new(self.position, self.velocity, self.position, self.velocity);
        state.contact = self.contact;
        state
    }

    fn set_state(&mut self, state: BlockState) {
        (self.position, self.velocity) = (state.device_position, state.device_velocity);
        self.law.seat(0.0);
        self.contact = self.law.contact(self.velocity);
    }

    fn at_rest(&self) -> Contact {
        self.law.contact(0.0)
    }

    fn felt(&self) -> f64 {
        if self.velocity == 0.0 {
            self.law.force_at_rest()
        } else {
            self.law.friction(self.velocity)
        }
    }

    fn friction(&self) -> f64 {
        self.felt()
    }

    fn seat(&mut self, force: f64) {
        self.law.seat(force);
        self.contact = self.law.contact(self.velocity);
    }
}
