//! Smooth Coulomb friction, `F = Fd tanh(w/ws)`: a law for tests alone. It shows that a law is its
//! file and its entry in the list.

use super::law::{Law, LawKind};
use crate::block::{Piece, PiecewiseContact, Start};
use crate::contact::{Contact, ContactMemory, DeviceContact, EnergyMeter, LawContact, Leg, Stroke, YieldingContact};
use crate::directional::{Direction, Directional};
use crate::math::exp_m1;
use crate::parameters::{Parameter, Slot};
use crate::render::{BlockSetup, DeviceSurface, Surface};
use crate::series::{Newest, Path, Products, RECIPROCAL, Recurrence};
use crate::snapshot::Archive;
use alloc::boxed::Box;

/// Smooth Coulomb friction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SmoothCoulomb {
    /// `Fd`, N: the force of a fast slide.
    pub dynamic_force: Directional,
    /// `ws`, m/s: the velocity over which the force rises.
    pub stribeck_velocity: f64,
}

impl SmoothCoulomb {
    /// Force, N, at a speed.
    fn at(&self, direction: Direction, speed: f64) -> f64 {
        let limit = self.dynamic_force.get(direction);
        let grown = exp_m1(2.0 * (speed / self.stribeck_velocity).min(300.0));
        limit * grown / (grown + 2.0)
    }
}

impl LawKind for SmoothCoulomb {
    const NAME: &'static str = "smooth-coulomb";
    const SUMMARY: &'static str = "Friction that grows smoothly with speed up to the dynamic force";

    fn defaults() -> Self {
        Self {
            dynamic_force: Directional::both(3.5),
            stribeck_velocity: 0.01,
        }
    }
}

impl Law for SmoothCoulomb {
    fn slot(&mut self, parameter: Parameter, _on_device: bool) -> Option<Slot<'_>> {
        match parameter {
            Parameter::DynamicForce => Some(Slot::Two(&mut self.dynamic_force)),
            Parameter::StribeckVelocity => Some(Slot::One(&mut self.stribeck_velocity)),
            _ => None,
        }
    }

    fn comply(&mut self) {
        if self.stribeck_velocity < 1e-3 {
            self.stribeck_velocity = Self::defaults().stribeck_velocity;
        }
    }

    fn holding_force(&self) -> Directional {
        self.dynamic_force
    }

    fn steady_friction(&self, direction: Direction, speed: f64) -> f64 {
        self.at(direction, speed)
    }

    fn contact_stiffness(&self, _on_device: bool) -> f64 {
        0.0
    }

    fn behind_block(&self, block: &BlockSetup) -> Box<dyn Surface> {
        self.yielding(block, *self)
    }

    fn on_device(&self) -> Box<dyn Surface> {
        Box::new(DeviceSurface::new(*self))
    }
}

impl LawContact for SmoothCoulomb {
    fn force_at_rest(&self) -> f64 {
        0.0
    }

    fn recall(&mut self, _memory: &ContactMemory, _speed: f64) {}

    fn archive(&mut self, _archive: &mut Archive<'_>) {}

    fn contact(&self, direction: Direction, _speed: f64) -> Contact {
        Contact::Sliding(direction)
    }
}

impl YieldingContact for SmoothCoulomb {
    fn advance(&mut self, _stroke: &Stroke) {}

    fn friction(&self, velocity: f64) -> f64 {
        let direction = Direction::of(velocity);
        direction.sign() * self.at(direction, velocity.abs())
    }

    fn stored_energy(&self) -> f64 {
        0.0
    }
}

/// `tanh q`, `q = w/ws`: its slope over `q` is `1 - tanh^2`.
struct TanhSeries {
    limit: f64,
    per_speed: f64,
    /// At the start.
    tanh: f64,
    /// `tanh` by itself, and `n q[n]` by its slope.
    products: Products,
    next_size: f64,
}

impl Recurrence for TanhSeries {
    const LOOK_BACK: usize = 2;
    const MIN_ORDERS: usize = 8;

    fn friction<const N: usize>(&mut self, _path: &Path, newest: Newest) -> f64 {
        let slope_at_start = 1.0 - self.tanh * self.tanh;
        let (mut tanh, mut slope, mut weighted) = (self.tanh, slope_at_start, 0.0);
        if N > 0 {
            let [squares, sloped] = self.products.inner::<N>();
            weighted = N as f64 * self.per_speed * newest.speed;
            tanh = RECIPROCAL[N] * (sloped + weighted * slope_at_start);
            slope = -(squares + 2.0 * self.tanh * tanh);
        }
        self.products.set(N, [tanh, weighted], [tanh, slope]);
        self.next_size = self.limit * tanh.abs();
        self.limit * tanh
    }

    fn next_size(&self) -> f64 {
        self.next_size
    }
}

impl PiecewiseContact for SmoothCoulomb {
    fn piece(&mut self, start: &Start) -> Piece {
        let limit = self.dynamic_force.get(start.direction);
        let mut series = TanhSeries {
            limit,
            per_speed: 1.0 / self.stribeck_velocity,
            tanh: self.at(start.direction, start.speed) / limit,
            products: Products::ZERO,
            next_size: 0.0,
        };
        let mut expansion = start.expand(0.0, &mut series);
        let speed = expansion.falls_to(0.0).then_some(0.0);
        expansion.piece(speed, 0.0)
    }
}

impl DeviceContact for SmoothCoulomb {
    fn advance<E: EnergyMeter>(&mut self, _leg: &Leg, _meter: &mut E) -> bool {
        false
    }

    fn friction(&self, velocity: f64) -> f64 {
        let direction = Direction::of(velocity);
        direction.sign() * self.at(direction, velocity.abs())
    }
}
