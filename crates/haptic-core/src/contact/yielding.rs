//! A contact that gives way before it slides, as the laws with a memory of their own have it.
//!
//! Such a contact is moved on by a displacement, and answers with its friction, and with how that
//! will change: with that a block is solved in closed form from one piece to the next, see
//! [`block::yielding`](crate::block).

use super::state::Contact;
use crate::direction::Direction;
use core::fmt::Debug;

/// Friction near the present state, for motion on in one direction: `force + stiffness d + damping
/// w` after a small displacement `d` with speed `w`, all positive against that motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tangent {
    /// N, without the part that `damping` gives.
    pub(crate) force: f64,
    /// N/m; negative where friction falls along the way.
    pub(crate) stiffness: f64,
    /// N s/m; negative where friction falls with speed.
    pub(crate) damping: f64,
    /// Whether this is the law itself up to the kink, and not its tangent only.
    pub(crate) linear: bool,
    /// The displacement, m, at which the law has a kink; infinity where it is smooth.
    pub(crate) kink: f64,
}

impl Tangent {
    /// Friction at a speed, N.
    pub(crate) fn friction(&self, speed: f64) -> f64 {
        self.force + self.damping * speed
    }
}

/// A displacement in one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stroke {
    pub(crate) direction: Direction,
    /// m, not negative.
    pub(crate) distance: f64,
    /// Speed along the direction at the start, m/s.
    pub(crate) from_speed: f64,
    /// The same at the end.
    pub(crate) to_speed: f64,
    /// Time that it took, s.
    pub(crate) elapsed_s: f64,
}

/// Cost of an advance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AdvanceCost {
    /// How much the force of the contact may be off by now, N: 0 where the law is closed-form.
    pub(crate) uncertain: f64,
    /// The work that it was, in units of which a tick may do a bounded number.
    pub(crate) work: u32,
}

impl AdvanceCost {
    /// In closed form.
    pub(crate) const EXACT: Self = Self {
        uncertain: 0.0,
        work: 1,
    };
}

/// The contact of a friction law with a memory of its own.
pub(crate) trait YieldingContact: Clone + Debug + Send + Sync + 'static {
    /// Friction from here on.
    fn tangent(&self, direction: Direction, speed: f64) -> Tangent;

    /// Moves on.
    fn advance(&mut self, stroke: &Stroke) -> AdvanceCost;

    /// Friction at rest, N, signed: it balances a load of the same sign and size.
    fn force_at_rest(&self) -> f64;

    /// Friction in motion with a velocity, N, signed: positive against positive motion.
    fn friction(&self, velocity: f64) -> f64 {
        let direction = Direction::of(velocity);
        let speed = velocity.abs();
        direction.sign() * self.tangent(direction, speed).friction(speed)
    }

    /// Deflects the contact until it holds `force`, N, or as much of it as it can.
    fn seat(&mut self, force: f64);

    /// Energy that the deflection holds, J.
    fn stored_energy(&self) -> f64;

    /// How it counts at a velocity: stuck where more than half of the motion is taken up by
    /// deflection.
    fn contact(&self, velocity: f64) -> Contact;

    /// The speed to which a slide must fall to end, and whether it has been faster. Laws without a
    /// stuck state end at zero.
    fn fall_level(&self) -> (bool, f64) {
        (false, 0.0)
    }

    /// The slide has fallen to that speed.
    fn fall(&mut self, _direction: Direction, _speed: f64) {}

    /// Begins with a slide, where the law has a sliding state.
    fn slide(&mut self, _direction: Direction, _speed: f64) {}

    /// A sample of a device that the contact is on, with its velocity.
    fn sampled(&mut self, _velocity: f64) {}
}

/// A direction's elastic share of the motion as a contact.
pub(crate) fn by_elastic_share(share: f64, direction: Direction) -> Contact {
    if share >= 0.5 {
        Contact::Stuck
    } else {
        Contact::Sliding(direction)
    }
}
