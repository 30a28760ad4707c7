//! LuGre's bristle on the device itself.

use super::stribeck_flow::{Curve, TWELVE, follow, follow_constant};
use super::{DeviceBristle, DeviceContact, EnergyMeter};
use crate::contact::leg::Leg;
use crate::contact::level::{Level, Stribeck};
use crate::contact::state::{Contact, ContactMemory, LawContact};
use crate::contact::yielding::by_elastic_share;
use crate::directional::{Direction, Directional};
use crate::math::{exp_m1, flush};
use crate::snapshot::Archive;

/// The steady force of a bristle, and the flow towards it.
pub(crate) trait FlowLevel: Level {
    /// The force along the motion after a leg, N, and whether the bounded work ran out.
    fn follow(&self, force: f64, stiffness: f64, leg: &Leg) -> (f64, bool);

    /// The energy that friction takes on the leg.
    fn dissipated(&self, force: f64, stiffness: f64, leg: &Leg) -> Energy;
}

/// The energy of a leg.
pub(crate) enum Energy {
    /// J, without the damping, which creates none here.
    Closed(f64),
    /// Along a curve, with all damping.
    Along(Curve),
}

impl FlowLevel for Directional {
    fn follow(&self, force: f64, stiffness: f64, leg: &Leg) -> (f64, bool) {
        let level = self.get(leg.direction);
        (follow_constant(force, level, stiffness, leg.distance), false)
    }

    fn dissipated(&self, force: f64, stiffness: f64, leg: &Leg) -> Energy {
        let level = self.get(leg.direction);
        if level <= 0.0 {
            return Energy::Closed(0.5 * force * force / stiffness);
        }
        // The integral of F^2/g.
        let exponent = stiffness * leg.distance / level;
        let missing = (force - level) / level;
        let grown = exponent - 2.0 * missing * exp_m1(-exponent) - 0.5 * missing * missing * exp_m1(-2.0 * exponent);
        Energy::Closed(level * level / stiffness * grown)
    }
}

impl FlowLevel for Stribeck {
    fn follow(&self, force: f64, stiffness: f64, leg: &Leg) -> (f64, bool) {
        let curve = Curve::new(self, leg.direction);
        let [first, second] = curve.parts(leg);
        let (force, ran_out) = follow(force, &curve, stiffness, &first);
        if second.distance == 0.0 {
            return (force, ran_out);
        }
        let (force, also) = follow(force, &curve, stiffness, &second);
        (force, ran_out || also)
    }

    fn dissipated(&self, _force: f64, _stiffness: f64, leg: &Leg) -> Energy {
        Energy::Along(Curve::new(self, leg.direction))
    }
}

/// The contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DeviceLugre<L> {
    /// `g`, N.
    pub(crate) level: L,
    /// `sigma0`, N/m.
    pub(crate) stiffness: f64,
    /// `sigma1`, N s/m.
    pub(crate) damping: f64,
    /// `b`, N s/m.
    pub(crate) viscous: Directional,
    /// `sigma0 z`, N, signed.
    pub(crate) force: f64,
}

impl<L: FlowLevel> DeviceBristle for DeviceLugre<L> {
    fn share(&self, direction: Direction, speed: f64) -> f64 {
        let level = self.level.at(direction, speed);
        if level > 0.0 {
            1.0 - direction.sign() * self.force / level
        } else {
            0.0
        }
    }

    fn dampings(&self, direction: Direction) -> (f64, f64) {
        (self.damping, self.viscous.get(direction))
    }
}

impl<L: FlowLevel> LawContact for DeviceLugre<L> {
    fn force_at_rest(&self) -> f64 {
        self.force
    }

    fn recall(&mut self, memory: &ContactMemory, _speed: f64) {
        self.force = memory.held(|direction| self.level.at(direction, 0.0));
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("force_N", &mut self.force);
    }

    fn contact(&self, direction: Direction, speed: f64) -> Contact {
        by_elastic_share(self.share(direction, speed), direction)
    }
}

impl<L: FlowLevel> DeviceContact for DeviceLugre<L> {
    fn advance<E: EnergyMeter>(&mut self, leg: &Leg, meter: &mut E) -> bool {
        let sign = leg.direction.sign();
        let along = sign * self.force;
        if E::LISTENS {
            meter.take(match self.level.dissipated(along, self.stiffness, leg) {
                Energy::Closed(energy_j) => energy_j,
                Energy::Along(curve) => dissipated_by_nodes(self, leg, &curve, self.stiffness),
            });
        }
        let (after, ran_out) = self.level.follow(along, self.stiffness, leg);
        self.force = flush(sign * after);
        ran_out
    }

    fn friction(&self, velocity: f64) -> f64 {
        let direction = Direction::of(velocity);
        let level = self.level.at(direction, velocity.abs());
        let viscous = self.viscous.get(direction) * velocity;
        if level > 0.0 {
            let share = 1.0 - direction.sign() * self.force / level;
            self.force + self.damping * share * velocity + viscous
        } else {
            // Nothing holds this way: whatever the bristle held is gone at once.
            viscous
        }
    }
}

/// Fewest and most panels that an energy is summed over.
const PANELS: (f64, f64) = (4.0, 64.0);

/// The energy, J, that a bristle on Stribeck's curve takes on a leg, as the contact goes along. `sigma1`
/// may create some where the curve falls, so all of the friction counts, the drag as well.
pub(super) fn dissipated_by_nodes(contact: &impl DeviceBristle, leg: &Leg, curve: &Curve, stiffness: f64) -> f64 {
    let (fewest, most) = PANELS;
    let [first, second] = curve.parts(leg);
    let mut contact = contact.clone();
    let (mut sum, mut begun, mut at, mut left) = (0.0, 0.0, 0.0, *leg);
    for part in [first, second] {
        let end = (begun + part.distance).min(leg.distance);
        let exponent = stiffness * part.distance / curve.at(part.from.max(part.to));
        let extent = if part.is_fallen() {
            0.0
        } else {
            (part.to - part.from).abs()
        };
        let width = part.distance / (0.5 * exponent.max(extent)).clamp(fewest, most);
        while begun < end {
            let panel = width.min(end - begun);
            for &(node, weight) in &TWELVE {
                let to = begun + node * panel;
                let (step, rest) = left.split(to - at);
                contact.advance(&step, &mut ());
                (at, left) = (to, rest);
                sum += panel * weight * contact.power(leg.direction, step.to_speed);
            }
            begun += panel;
        }
    }
    sum
}
