//! Contacts on the device itself: the hand's motion within a tick is given, so each law is solved
//! along it, and not in pieces of a tangent.

mod elasto_plastic;
mod lugre;
mod master_path;
mod path_bristle;
mod spring;
mod stribeck_flow;

pub(crate) use elasto_plastic::DeviceElastoPlastic;
pub(crate) use lugre::{DeviceLugre, FlowLevel};
#[cfg(test)]
pub(crate) use master_path::cells_and_error;
pub(crate) use master_path::{MasterLaw, ORDER, PathSeries, series_product};
pub(crate) use path_bristle::PathBristle;

use super::leg::Leg;
use super::state::LawContact;
use crate::directional::Direction;

/// The contact of a law on the device itself.
pub(crate) trait DeviceContact: LawContact {
    /// Moves on along a leg; reports to `meter` the energy that friction took out of the motion.
    /// Returns whether the bounded work ran out.
    fn advance<E: EnergyMeter>(&mut self, leg: &Leg, meter: &mut E) -> bool;

    /// Friction in motion with a velocity, N, signed: positive against positive motion.
    fn friction(&self, velocity: f64) -> f64;
}

/// A bristle that answers with a force `sigma0 z`.
pub(crate) trait DeviceBristle: DeviceContact {
    /// `z'/v`.
    fn share(&self, direction: Direction, speed: f64) -> f64;

    /// `sigma1` and `b`, N s/m.
    fn dampings(&self, direction: Direction) -> (f64, f64);

    /// Power over speed, N, that all of friction takes beyond what the deflection stores.
    fn power(&self, direction: Direction, speed: f64) -> f64 {
        let share = self.share(direction, speed);
        let (contact, viscous) = self.dampings(direction);
        let damping = contact * share + viscous;
        direction.sign() * self.force_at_rest() * (1.0 - share) + damping * speed
    }
}

/// Hears of the energy that friction takes out of the motion, beyond what the deflection of the
/// contact holds and gives back. Damping is left out where the law never creates energy.
pub(crate) trait EnergyMeter {
    /// Whether it listens: if not, energies need not be computed.
    const LISTENS: bool;

    /// Friction took `energy_j`, J; below zero it gave some.
    fn take(&mut self, energy_j: f64);
}

impl EnergyMeter for () {
    const LISTENS: bool = false;

    fn take(&mut self, _energy_j: f64) {}
}

/// The sum.
impl EnergyMeter for f64 {
    const LISTENS: bool = true;

    fn take(&mut self, energy_j: f64) {
        *self += energy_j;
    }
}
