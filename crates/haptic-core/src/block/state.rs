//! The block's state between two ticks.

use crate::contact::{Contact, ContactMemory};
use crate::directional::Direction;
use crate::flush::flush;
use crate::snapshot::Archive;

/// The block and the last device sample that moved it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockState {
    /// Block position `x`, m.
    pub position: f64,
    /// Block velocity `w`, m/s.
    pub velocity: f64,
    /// Contact with the surface.
    pub contact: Contact,
    /// Whether the slide has been faster than the velocity threshold DV.
    pub armed: bool,
    /// Device position at the last tick, m.
    pub device_position: f64,
    /// Device velocity at the last tick, m/s.
    pub device_velocity: f64,
    /// What the contact goes by from here.
    pub memory: ContactMemory,
    /// What the position leaves out of the place, below its last digit, m: it would add up over the ticks far
    /// from the origin.
    pub(crate) residue: f64,
}

impl BlockState {
    /// A block at `position` with `velocity`, held by a device at `device_position` with
    /// `device_velocity`.
    ///
    /// A block that moves slides; one at rest is stuck.
    #[must_use]
    pub fn new(position: f64, velocity: f64, device_position: f64, device_velocity: f64) -> Self {
        Self {
            position,
            velocity,
            contact: if velocity == 0.0 {
                Contact::Stuck
            } else {
                Contact::Sliding(Direction::of(velocity))
            },
            armed: false,
            device_position,
            device_velocity,
            memory: ContactMemory {
                slide: (velocity != 0.0).then(|| Direction::of(velocity)),
                dwell_s: 0.0,
                ..ContactMemory::RESTED
            },
            residue: 0.0,
        }
    }

    /// Saves or loads it; the contact's own state is saved with the contact.
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("position_m", &mut self.position);
        archive.number("residue_m", &mut self.residue);
        archive.number("velocity_mps", &mut self.velocity);
        self.contact.archive(archive);
        archive.flag("armed", &mut self.armed);
        archive.number("device_position_m", &mut self.device_position);
        archive.number("device_velocity_mps", &mut self.device_velocity);
    }

    /// Moves on by a distance, m.
    #[inline(always)]
    pub(super) fn advance(&mut self, by: f64) {
        let by = by + self.residue;
        let position = self.position + by;
        self.residue = (self.position - position) + by;
        self.position = position;
    }

    /// The device's position less the block's, m.
    #[inline(always)]
    pub(crate) fn deflection(&self) -> f64 {
        (self.device_position - self.position) - self.residue
    }

    /// The same state without motion that is next to nothing.
    pub(super) fn flushed(self) -> Self {
        Self {
            position: flush(self.position),
            velocity: flush(self.velocity),
            ..self
        }
    }

    /// Whether the block is somewhere.
    pub(super) fn is_finite(&self) -> bool {
        // Only of finite numbers is the product with zero zero.
        0.0 * self.position + 0.0 * self.velocity == 0.0
    }

    /// The same state with a contact that fits the velocity: what moves slides, and slides the way
    /// it moves.
    pub(super) fn consistent(mut self) -> Self {
        if self.velocity != 0.0 {
            self.contact = Contact::Sliding(Direction::of(self.velocity));
        }
        self
    }
}
