//! A contact that gives way before it slides, as the laws with a memory of their own have it.
//!
//! Such a contact is moved on by a displacement, and answers with its friction. One whose law is
//! made of straight lines also says how that will change: with that a block is solved in closed
//! form from one kink to the next, see [`block::yielding`](crate::block).

use super::leg::Leg;
use super::state::{Contact, LawContact};
use crate::directional::Direction;

/// Friction from the present state to the next kink, for motion on in one direction: `force +
/// stiffness d + damping w` after a displacement `d` with speed `w`, all positive against that
/// motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrictionLine {
    /// N.
    pub(crate) force: f64,
    /// N/m, not negative.
    pub(crate) stiffness: f64,
    /// N s/m, not negative, the viscous part included.
    pub(crate) damping: f64,
    /// Distance to the kink, m; infinity where there is none.
    pub(crate) kink: f64,
}

/// The contact of a friction law with a memory of its own.
pub(crate) trait YieldingContact: LawContact {
    /// Moves on.
    fn advance(&mut self, leg: &Leg);

    /// Friction in motion with a velocity, N, signed: positive against positive motion.
    fn friction(&self, velocity: f64) -> f64;

    /// Energy that the deflection holds, J.
    fn stored_energy(&self) -> f64;

    /// The speed to which a slide must fall to end, and whether it has been faster. Laws without a
    /// stuck state end at zero.
    fn fall_level(&self) -> (bool, f64) {
        (false, 0.0)
    }

    /// The slide has fallen to that speed.
    fn fall(&mut self, _direction: Direction, _speed: f64) {}

    /// A sample of a device that the contact is on, with its velocity.
    fn sampled(&mut self, _velocity: f64) {}
}

/// The contact of a law that is made of straight lines.
pub(crate) trait StraightContact: YieldingContact {
    /// Friction from here on.
    fn line(&self, direction: Direction) -> FrictionLine;
}

/// A direction's elastic share of the motion as a contact.
pub(crate) fn by_elastic_share(share: f64, direction: Direction) -> Contact {
    if share >= 0.5 {
        Contact::Stuck
    } else {
        Contact::Sliding(direction)
    }
}
