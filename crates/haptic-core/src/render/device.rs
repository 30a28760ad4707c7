//! Friction on the device itself, without a block: the hand's own motion moves the contact, and the
//! force is its friction.

use super::legs::TickMotion;
use crate::block::{BlockState, Body, EventSink, Moving, Rendered};
use crate::contact::{Contact, ContactMemory, DeviceContact, EnergyMeter};
use crate::directional::{Direction, Directional};
use crate::snapshot::Archive;

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
    fn advance(&mut self, _elapsed_s: f64, position: f64, velocity: f64, _sink: &mut impl EventSink) -> Rendered {
        (self.position, self.velocity) = (position, velocity);
        Rendered {
            coupling_force: self.coupling_force(),
            ..Rendered::default()
        }
    }
}

impl Body for ViscousSurface {
    fn state(&self) -> BlockState {
        let mut state = BlockState::new(self.position, self.velocity, self.position, self.velocity);
        state.contact = Contact::Sliding(Direction::of(self.velocity));
        state
    }

    /// What follows begins with this force, and not with a slide.
    fn memory(&self) -> ContactMemory {
        ContactMemory {
            force: self.coupling_force(),
            ..ContactMemory::RESTED
        }
    }

    fn set_state(&mut self, state: BlockState) {
        (self.position, self.velocity) = (state.device_position, state.device_velocity);
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("device_position_m", &mut self.position);
        archive.number("device_velocity_mps", &mut self.velocity);
    }

    fn coupling_force(&self) -> f64 {
        self.viscous.get(Direction::of(self.velocity)) * self.velocity
    }
}

/// The contact of a law under the device.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DeviceSurface<C> {
    law: C,
    position: f64,
    velocity: f64,
    contact: Contact,
}

impl<C: DeviceContact> DeviceSurface<C> {
    pub(crate) fn new(law: C) -> Self {
        let contact = law.contact_at(0.0);
        Self {
            law,
            position: 0.0,
            velocity: 0.0,
            contact,
        }
    }

    /// Moves the contact on by a tick; returns whether the bounded work ran out.
    #[inline]
    fn follow(&mut self, motion: &TickMotion, meter: &mut impl EnergyMeter) -> bool {
        if let Some(leg) = motion.leg(|| self.law.facing()) {
            return self.law.advance(&leg, meter);
        }
        self.follow_turn(motion, meter)
    }

    /// The same, and the energy that friction took, J.
    #[inline(never)]
    fn follow_with_meter(&mut self, motion: &TickMotion) -> (bool, f64) {
        let mut energy_j = 0.0;
        (self.follow(motion, &mut energy_j), energy_j)
    }

    #[cold]
    fn follow_turn(&mut self, motion: &TickMotion, meter: &mut impl EnergyMeter) -> bool {
        let (to_turn, last) = motion.turn(|| self.law.facing());
        let ran_out = to_turn.is_some_and(|leg| self.law.advance(&leg, meter));
        self.law.advance(&last, meter) || ran_out
    }
}

impl<C: DeviceContact> Moving for DeviceSurface<C> {
    fn advance(&mut self, elapsed_s: f64, position: f64, velocity: f64, sink: &mut impl EventSink) -> Rendered {
        let (mut events, mut work_exhausted) = (0, false);
        if elapsed_s > 0.0 {
            let motion = TickMotion {
                by: position - self.position,
                from_velocity: self.velocity,
                to_velocity: velocity,
                elapsed_s,
            };
            if sink.listens() {
                let energy_j;
                (work_exhausted, energy_j) = self.follow_with_meter(&motion);
                sink.dissipated(energy_j);
            } else {
                work_exhausted = self.follow(&motion, &mut ());
            }
            let contact = self.law.contact(motion.direction(|| self.law.facing()), velocity.abs());
            if contact != self.contact {
                events = 1;
                sink.contact_changed(elapsed_s, self.contact, contact);
                self.contact = contact;
            }
        }
        (self.position, self.velocity) = (position, velocity);
        Rendered {
            coupling_force: self.coupling_force(),
            events,
            work_exhausted,
        }
    }
}

impl<C: DeviceContact> Body for DeviceSurface<C> {
    fn state(&self) -> BlockState {
        let mut state = BlockState::new(self.position, self.velocity, self.position, self.velocity);
        state.contact = self.contact;
        state
    }

    fn memory(&self) -> ContactMemory {
        self.law.memory()
    }

    fn set_state(&mut self, state: BlockState) {
        (self.position, self.velocity) = (state.device_position, state.device_velocity);
        self.law.recall(&state.memory, self.velocity.abs());
        self.contact = self.law.contact_at(self.velocity);
    }

    fn at_rest(&self) -> Contact {
        self.law.contact_at(0.0)
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("device_position_m", &mut self.position);
        archive.number("device_velocity_mps", &mut self.velocity);
        self.contact.archive(archive);
        self.law.archive(archive);
    }

    fn coupling_force(&self) -> f64 {
        if self.velocity == 0.0 {
            self.law.force_at_rest()
        } else {
            self.law.friction(self.velocity)
        }
    }
}
