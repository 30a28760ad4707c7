//! The block and its coupling, as a scene describes them.
//!
//! Beside it: its state between two ticks, and the interface of everything that moves from one
//! device sample to the next, and of its listeners.

use crate::contact::{Contact, ContactMemory};
use crate::directional::Direction;
use crate::math::flush;
use crate::snapshot::Archive;
use core::fmt::Debug;

/// The block that the hand drags.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Block {
    /// `M`, kg.
    #[cfg_attr(feature = "serde", serde(alias = "M"))]
    pub mass: f64,
}

/// The virtual coupling between device and block (Colgate, Stanley and Brown 1995).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Coupling {
    /// `K`, N/m.
    #[cfg_attr(feature = "serde", serde(alias = "K"))]
    pub stiffness: f64,
    /// `B`, N s/m.
    #[cfg_attr(feature = "serde", serde(alias = "B"))]
    pub damping: f64,
}

/// Up to this delay [`Coupling::CALM`] will do for a rig of 0.1 kg, s.
const CALM_UP_TO_S: f64 = 6e-3;

/// Delay at which it does with a factor to spare, s.
const CALM_WITH_ROOM_S: f64 = 4e-3;

/// Below that a grip is no longer felt, N/m.
const SOFTEST_N_PER_M: f64 = 20.0;

impl Coupling {
    /// One that light rigs and those behind a USB link can bear.
    pub const CALM: Self = Self {
        stiffness: 1000.0,
        damping: 10.0,
    };

    /// One for a light rig that gets the force for a sample so late, s, that [`Coupling::CALM`] would oscillate; `None`
    /// where that will do, or none would be felt. A mass on a spring and a damper that act late is similar to itself
    /// where `K` falls with the square of the delay and `B` with the delay.
    #[must_use]
    pub fn calm_behind(delay_s: f64) -> Option<Self> {
        let slower = delay_s / CALM_WITH_ROOM_S;
        let softer = Self {
            stiffness: Self::CALM.stiffness / (slower * slower),
            damping: Self::CALM.damping / slower,
        };
        (delay_s > CALM_UP_TO_S && softer.stiffness >= SOFTEST_N_PER_M).then_some(softer)
    }

    /// The force on a block, N: `K (p - x) + B (v - w)`.
    #[must_use]
    pub fn force(&self, state: &BlockState) -> f64 {
        self.stiffness * state.deflection() + self.damping * (state.device_velocity - state.velocity)
    }
}

/// `K p + B v` between two samples, less `K` times the block's position at the start of the tick:
/// the coupling force if the block stood still there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Load {
    /// At the start of the tick, N.
    pub(super) at_start: f64,
    /// N/s.
    pub(super) slope: f64,
}

impl Load {
    /// From the last sample, which `state` holds, to one of `position` (m) and `velocity` (m/s),
    /// `elapsed_s` later.
    pub(super) fn new(coupling: &Coupling, state: &BlockState, elapsed_s: f64, position: f64, velocity: f64) -> Self {
        let Coupling { stiffness, damping } = *coupling;
        // Differences, not K p: at a large offset the products would drown the deflection.
        Self {
            at_start: stiffness * state.deflection() + damping * state.device_velocity,
            slope: (stiffness * (position - state.device_position) + damping * (velocity - state.device_velocity))
                / elapsed_s,
        }
    }

    pub(super) fn at(&self, time: f64) -> f64 {
        self.at_start + self.slope * time
    }
}

/// Within this, N, a force on the block equals another: the rounding of `K p + B v` at the start of
/// a tick.
pub(super) fn rounding(coupling: &Coupling, state: &BlockState) -> f64 {
    f64::EPSILON
        * (2.0 * coupling.stiffness * state.position.abs() + 4.0 * (coupling.damping * state.device_velocity).abs())
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

/// Result of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rendered<V = f64> {
    /// Coupling force `F` on the block, N, or the friction itself where there is no block; the hand
    /// feels `-F`.
    pub coupling_force: V,
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

/// What the samples of a device move, as it is between two of them: a block, or a surface on the device itself.
pub(crate) trait Body: Debug + Send + Sync {
    /// The block and the last sample; what its contact remembers is for [`memory`](Self::memory) to
    /// say. On the device itself the block is where the device is.
    fn state(&self) -> BlockState;

    /// What the contact remembers: nothing, here.
    fn memory(&self) -> ContactMemory {
        ContactMemory::RESTED
    }

    /// Puts it somewhere, without a tick: it goes on from a state with the memory in it.
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

/// How it moves from one sample to the next.
pub(crate) trait Moving: Body + Clone + 'static {
    /// Moves on by `elapsed_s` seconds, in which the device went to `position` (m) and `velocity`
    /// (m/s).
    fn advance(&mut self, elapsed_s: f64, position: f64, velocity: f64, sink: &mut impl EventSink) -> Rendered;

    /// The same in one backward-Euler step.
    fn advance_implicitly(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut impl EventSink,
    ) -> Rendered {
        self.advance(elapsed_s, position, velocity, sink)
    }
}
