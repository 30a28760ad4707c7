//! The block behind the virtual coupling: its state, and the two schemes that move it on by one tick.

pub mod exact;
pub mod literal;
mod oscillator;

use crate::parameters::Direction;

/// How the block touches the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// At rest; friction holds it.
    Stuck,
    /// Sliding in a direction.
    Sliding(Direction),
}

impl Contact {
    /// `0` stuck, `+1` and `-1` sliding: the number used in files and on the wire.
    #[must_use]
    pub const fn as_number(self) -> i8 {
        match self {
            Self::Stuck => 0,
            Self::Sliding(Direction::Positive) => 1,
            Self::Sliding(Direction::Negative) => -1,
        }
    }
}

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
}

impl BlockState {
    /// A block at `position` with `velocity`, held by a device at `device_position` with `device_velocity`.
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
        }
    }

    /// The same state with a contact that fits the velocity: what moves slides, and slides the way it moves.
    pub(crate) fn consistent(mut self) -> Self {
        if self.velocity != 0.0 {
            self.contact = Contact::Sliding(Direction::of(self.velocity));
        }
        self
    }
}

/// What one tick gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rendered {
    /// Coupling force `F` on the block, N; the hand feels `-F`.
    pub coupling_force: f64,
    /// Changes of contact within the tick.
    pub events: u32,
    /// Whether the bounded work of the exact tick ran out and an implicit step finished it.
    pub work_exhausted: bool,
}

/// Hears what happens within a tick. `()` hears nothing, and costs nothing.
pub trait EventSink {
    /// The contact changed `at_s` seconds after the start of the tick.
    fn contact_changed(&mut self, at_s: f64, from: Contact, to: Contact);

    /// The block slid by a displacement (m) against a friction (N, positive when it opposes positive motion; the viscous
    /// part may be left out, as it never helps). Where their product is negative, friction has created energy.
    fn slid(&mut self, _force: f64, _displacement: f64) {}
}

impl EventSink for () {
    fn contact_changed(&mut self, _at_s: f64, _from: Contact, _to: Contact) {}
}

impl<F: FnMut(f64, Contact, Contact)> EventSink for F {
    fn contact_changed(&mut self, at_s: f64, from: Contact, to: Contact) {
        self(at_s, from, to);
    }
}
