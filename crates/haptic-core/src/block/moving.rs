//! The interface of everything that moves from one device sample to the next, and of its listeners.

use super::state::BlockState;
use crate::contact::{Contact, ContactMemory};
use crate::directional::Direction;
use crate::snapshot::Archive;
use core::fmt::Debug;

/// Result of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rendered {
    /// Coupling force `F` on the block, N, or the friction itself where there is no block; the hand
    /// feels `-F`.
    pub coupling_force: f64,
    /// Changes of contact within the tick.
    pub events: u32,
    /// Whether the bounded work of the exact tick ran out and implicit steps finished it.
    pub work_exhausted: bool,
}

/// Listener to the events within a tick. `()` ignores them, and costs nothing.
pub trait EventSink {
    /// The contact changed `at_s` seconds after the start of the tick.
    fn contact_changed(&mut self, at_s: f64, from: Contact, to: Contact);

    /// Friction took an energy (J) out of the motion, beyond what the deflection of the contact
    /// holds and gives back; the viscous part may be left out, as it never helps. Where it is
    /// negative, friction has created energy.
    fn dissipated(&mut self, _energy_j: f64) {}

    /// Whether the listener uses what it hears: if not, times and energies need not be computed.
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

/// Anything that the samples of a device move: a block, or a surface on the device itself.
pub(crate) trait Moving: Clone + Debug + Send + Sync + 'static {
    /// Moves on by `elapsed_s` seconds, in which the device went to `position` (m) and `velocity`
    /// (m/s).
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

    /// The block and the last sample; what its contact remembers is for [`memory`](Self::memory) to
    /// say. On the device itself the block is where the device is.
    fn state(&self) -> BlockState;

    /// What the contact remembers: nothing, here.
    fn memory(&self) -> ContactMemory {
        ContactMemory::RESTED
    }

    /// Puts it somewhere, without a tick.
    fn set_state(&mut self, state: BlockState);

    /// The contact of something at rest: sliding where no friction can hold it, as here.
    fn at_rest(&self) -> Contact {
        Contact::Sliding(Direction::Positive)
    }

    /// The force of the last sample, N, as [`Rendered::coupling_force`] had it.
    fn coupling_force(&self) -> f64;

    /// Saves or loads all that a tick keeps for the next one.
    fn archive(&mut self, archive: &mut Archive<'_>);
}
