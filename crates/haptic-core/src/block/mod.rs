//! The block behind the virtual coupling: its state, and the schemes that move it on by one tick.
//!
//! [`exact`] solves Karnopp's law in closed form between two samples, [`yielding`] the laws whose contact gives way, piece by piece; [`linear`] is for a
//! block that nothing holds. [`literal`] is the paper's Euler step, for every law. One backward-Euler step a tick, the implicit scheme, is
//! part of the first two, which fall back on it when a tick has more in it than may be worked through.

pub mod exact;
mod fall;
pub mod linear;
pub mod literal;
mod load;
mod oscillator;
pub(crate) mod slide;
mod stribeck_slide;
pub mod yielding;

use crate::parameters::Direction;
use core::fmt::Debug;

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
    /// For how long the contact has rested, s, where the static limit depends on it; infinite where it does not.
    pub dwell_s: f64,
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
            dwell_s: 0.0,
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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rendered {
    /// Coupling force `F` on the block, N, or the friction itself where there is no block; the hand feels `-F`.
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

    /// Friction took an energy (J) out of the motion, beyond what the deflection of the contact holds and gives back; the viscous
    /// part may be left out, as it never helps. Where it is negative, friction has created energy.
    fn dissipated(&mut self, _energy_j: f64) {}

    /// Whether anybody listens: what is only to be heard need not be computed otherwise.
    fn listens(&self) -> bool {
        true
    }
}

impl EventSink for () {
    fn contact_changed(&mut self, _at_s: f64, _from: Contact, _to: Contact) {}

    fn listens(&self) -> bool {
        false
    }
}

impl<F: FnMut(f64, Contact, Contact)> EventSink for F {
    fn contact_changed(&mut self, at_s: f64, from: Contact, to: Contact) {
        self(at_s, from, to);
    }
}

/// What is moved on by the samples of a device: a block, or a surface on the device itself.
pub(crate) trait Moving: Clone + Debug + Send + Sync + 'static {
    /// Moves on by `elapsed_s` seconds, in which the device went to `position` (m) and `velocity` (m/s).
    fn advance(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut (impl EventSink + ?Sized),
    ) -> Rendered;

    /// The same in one backward-Euler step.
    fn advance_implicitly(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut (impl EventSink + ?Sized),
    ) -> Rendered {
        self.advance(elapsed_s, position, velocity, sink)
    }

    /// The block and the last sample. On the device itself the block is where the device is.
    fn state(&self) -> BlockState;

    /// Puts it somewhere, without a tick.
    fn set_state(&mut self, state: BlockState);

    /// The contact of something at rest: sliding where no friction can hold it.
    fn at_rest(&self) -> Contact;

    /// The force of the last sample, N: what [`Rendered::coupling_force`] was.
    fn felt(&self) -> f64;

    /// Friction at the last sample, N, signed.
    fn friction(&self) -> f64;

    /// Has the contact hold a friction (N, signed), or as much of it as it can.
    fn seat(&mut self, force: f64);
}
