//! Dahl's friction (Dahl 1968, "A solid friction model"): a spring that yields from the first
//! displacement on, with limits that may differ by direction.
//!
//! ```text
//! dF/dx = sigma |1 - u|^i sgn(1 - u),   u = s F/Fc,   s = direction of motion
//! ```
//!
//! Along one direction this is a function of the displacement alone, in closed form: with `r = 1 -
//! u` and `a = sigma |dx|/Fc`, `r+ = r e^-a` for `i = 1`, and otherwise `r+ = r (1 + (i - 1) a
//! r^(i-1))^(1/(1-i))`, the bracket kept from falling below zero. Whatever the displacement it is
//! stable, where the explicit step blows up for `|v| > 2 Fc/(sigma T)`.
//!
//! It has no stiction, and a load that shakes below the limit makes it creep: see
//! [`ElastoPlastic`](super::ElastoPlastic) for one that does not.

use super::law::{self, Law, LawKind};
use crate::block::{Piece, PiecewiseContact, Start, straight_piece};
use crate::contact::{
    BristleForce, Contact, ContactMemory, DeviceContact, EnergyMeter, FrictionLine, LawContact, Leg, PowerSeries,
    SETTLED_N, StraightContact, TowardsLimit, YieldingContact, by_elastic_share,
};
use crate::directional::{Direction, Directional};
use crate::math::{exp, exp_m1, flush, ln_1p, powf};
use crate::parameters::{Parameter, Slot};
use crate::render::{BlockSetup, DeviceSurface, Surface};
use crate::series::integral_of_product;
use crate::snapshot::Archive;
use alloc::boxed::Box;

/// What a series may leave out, N: under a slow hand the pieces of a light block add up.
const TOLERANCE_N: f64 = 6e-11;
/// So many times the distance on which its series converges takes a piece at most: the coefficients of a longer
/// one may be beyond all numbers, where a deflection of the other direction is a hundred times the limit.
const FEW_RADII: f64 = 16.0;

/// Dahl friction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Dahl {
    /// `Fd` (Dahl's `Fc`; `Dp` and `Dn` by direction), N: the force of a long slide.
    #[cfg_attr(feature = "serde", serde(alias = "Fd"))]
    pub dynamic_force: Directional,
    /// `sigma`, N/m: the slope at zero force.
    #[cfg_attr(feature = "serde", serde(alias = "Kp", alias = "sigma", alias = "sigma0"))]
    pub contact_stiffness: f64,
    /// `i`: 0 yields all at once, 1 is the usual exponential, more is rounder.
    #[cfg_attr(feature = "serde", serde(alias = "i", default = "exponential"))]
    pub exponent: f64,
    /// `b`, N s/m: viscous friction on top.
    #[cfg_attr(feature = "serde", serde(alias = "b", alias = "sigma2", default))]
    pub viscous: Directional,
}

#[cfg(feature = "serde")]
fn exponential() -> f64 {
    1.0
}

impl Dahl {
    fn contact(&self) -> DahlContact {
        DahlContact { law: *self, force: 0.0 }
    }
}

impl LawKind for Dahl {
    const NAME: &'static str = "dahl";
    const SUMMARY: &'static str = "A spring that yields from the first displacement on; no stiction (Dahl 1968)";

    fn defaults() -> Self {
        Self {
            dynamic_force: Directional::both(law::DYNAMIC_FORCE),
            contact_stiffness: law::DEFAULT_CONTACT_STIFFNESS,
            exponent: 1.0,
            viscous: Directional::both(0.0),
        }
    }
}

impl Law for Dahl {
    fn slot(&mut self, parameter: Parameter, _on_device: bool) -> Option<Slot<'_>> {
        match parameter {
            Parameter::DynamicForce => Some(Slot::Two(&mut self.dynamic_force)),
            Parameter::ContactStiffness => Some(Slot::One(&mut self.contact_stiffness)),
            Parameter::Exponent => Some(Slot::One(&mut self.exponent)),
            Parameter::Viscous => Some(Slot::Two(&mut self.viscous)),
            _ => None,
        }
    }

    fn holding_force(&self) -> Directional {
        self.dynamic_force
    }

    fn steady_friction(&self, direction: Direction, speed: f64) -> f64 {
        self.dynamic_force.get(direction) + self.viscous.get(direction) * speed
    }

    fn contact_stiffness(&self, _on_device: bool) -> f64 {
        self.contact_stiffness
    }

    fn damping_of_curve(&self) -> Option<f64> {
        (self.exponent > 0.0).then(|| self.viscous.greatest())
    }

    fn behind_block(&self, block: &BlockSetup) -> Box<dyn Surface> {
        self.yielding(block, self.contact())
    }

    fn on_device(&self) -> Box<dyn Surface> {
        Box::new(DeviceSurface::new(self.contact()))
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct DahlContact {
    law: Dahl,
    /// `F`, N, signed.
    force: f64,
}

#[expect(
    clippy::float_cmp,
    reason = "the exponents 0 and 1 themselves have closed forms of their own"
)]
impl DahlContact {
    /// `1 - u`, not negative.
    fn rest(&self, direction: Direction) -> f64 {
        let limit = self.law.dynamic_force.get(direction);
        if limit > 0.0 {
            (1.0 - direction.sign() * self.force / limit).max(0.0)
        } else {
            0.0
        }
    }

    /// `dF/dx / sigma`.
    fn share(&self, rest: f64) -> f64 {
        if rest == 0.0 {
            0.0
        } else if self.law.exponent == 1.0 {
            rest
        } else {
            powf(rest, self.law.exponent)
        }
    }
}

impl LawContact for DahlContact {
    fn force_at_rest(&self) -> f64 {
        self.force
    }

    fn recall(&mut self, memory: &ContactMemory, _speed: f64) {
        self.force = memory.held(|direction| self.law.dynamic_force.get(direction));
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("force_N", &mut self.force);
    }

    fn contact(&self, direction: Direction, _speed: f64) -> Contact {
        let holds = self.law.dynamic_force.get(direction) > direction.sign() * self.force;
        let share = if self.law.exponent == 0.0 {
            f64::from(u8::from(holds))
        } else {
            self.share(self.rest(direction))
        };
        by_elastic_share(share, direction)
    }
}

#[expect(
    clippy::float_cmp,
    reason = "the exponents 0 and 1 themselves have closed forms of their own"
)]
impl YieldingContact for DahlContact {
    fn advance(&mut self, leg: &Leg) {
        let limit = self.law.dynamic_force.get(leg.direction);
        if self.law.exponent == 0.0 {
            let along = leg.direction.sign() * self.force;
            let after = along + self.law.contact_stiffness * leg.distance;
            self.force = flush(leg.direction.sign() * after.min(limit.max(along)));
            return;
        }
        let rest = self.rest(leg.direction);
        let left = if limit <= 0.0 || rest == 0.0 {
            0.0
        } else {
            let a = self.law.contact_stiffness * leg.distance / limit;
            let i = self.law.exponent;
            if i == 1.0 {
                rest * flush(exp(-a))
            } else {
                let grown = (i - 1.0) * a * powf(rest, i - 1.0);
                if grown > -1.0 {
                    // The logarithm keeps its digits where i is near 1.
                    rest * flush(exp(ln_1p(grown) / (1.0 - i)))
                } else {
                    0.0
                }
            }
        };
        self.force = flush(leg.direction.sign() * limit * (1.0 - left));
    }

    fn friction(&self, velocity: f64) -> f64 {
        let direction = Direction::of(velocity);
        // Without a limit this way, whatever the spring held is gone at once.
        let held = if self.law.exponent == 0.0 || self.law.dynamic_force.get(direction) > 0.0 {
            self.force
        } else {
            0.0
        };
        held + self.law.viscous.get(direction) * velocity
    }

    fn stored_energy(&self) -> f64 {
        0.5 * self.force * self.force / self.law.contact_stiffness
    }
}

/// With the exponent 0 the spring is straight up to its limit.
impl StraightContact for DahlContact {
    fn line(&self, direction: Direction) -> FrictionLine {
        let limit = self.law.dynamic_force.get(direction);
        let along = direction.sign() * self.force;
        let stiffness = self.law.contact_stiffness;
        let holds = along < limit;
        FrictionLine {
            force: along,
            stiffness: if holds { stiffness } else { 0.0 },
            damping: self.law.viscous.get(direction),
            kink: if holds {
                (limit - along) / stiffness
            } else {
                f64::INFINITY
            },
        }
    }
}

impl DahlContact {
    /// A piece at the limit.
    fn slide(&mut self, start: &Start) -> Piece {
        let limit = self.law.dynamic_force.get(start.direction);
        self.force = start.direction.sign() * limit;
        start.slide(limit, self.law.viscous.get(start.direction), 0.0).0
    }

    /// A piece on the exponential that `i = 1` has.
    fn yield_exponentially(&mut self, start: &Start) -> Piece {
        let (limit, sign) = (self.law.dynamic_force.get(start.direction), start.direction.sign());
        let bristle = BristleForce::<false>::new(start.remaining_s, self.law.contact_stiffness, 0.0, sign * self.force);
        let mut series = TowardsLimit::new(bristle, limit, TOLERANCE_N);
        let mut expansion = start.expand(self.law.viscous.get(start.direction), &mut series);
        let speed = expansion.falls_to(0.0).then_some(0.0);
        let bristle = &series.bristle;
        self.force = flush(sign * bristle.at(expansion.end));
        let dissipated = if start.listens {
            bristle.dissipated(&expansion.path, expansion.end)
        } else {
            0.0
        };
        expansion.piece(speed, dissipated)
    }

    /// A piece on the power of the distance that any other exponent has.
    fn yield_by_power(&mut self, start: &Start, rest: f64) -> Piece {
        let (limit, sign) = (self.law.dynamic_force.get(start.direction), start.direction.sign());
        let mut series = PowerSeries::new(self.law.exponent, self.law.contact_stiffness, limit, rest);
        let start = &Start {
            remaining_s: start
                .remaining_s
                .min(FEW_RADII * start.time_for(series.radius(), limit * (1.0 - rest))),
            ..*start
        };
        let mut expansion = start.expand(self.law.viscous.get(start.direction), &mut series);
        let mut speed = expansion.falls_to(0.0).then_some(0.0);
        // Below an exponent of 1 the limit is reached in a finite displacement.
        let reaches = self.law.exponent < 1.0 && expansion.until(|_, n| series.line(n));
        let mut piece = expansion.piece(speed.take_if(|_| !reaches), 0.0);
        let left = if reaches {
            piece.distance = series.distance_to_limit();
            0.0
        } else {
            series.rest_at(piece.distance)
        };
        let before = self.stored_energy();
        self.force = flush(sign * limit * (1.0 - left));
        if start.listens {
            let resisted = integral_of_product(
                |n| series.force(n),
                |n| expansion.path.speed.get(n),
                expansion.end,
                expansion.last_of_law(),
            );
            piece.dissipated = expansion.path.duration_s * resisted - (self.stored_energy() - before);
        }
        piece
    }
}

impl PiecewiseContact for DahlContact {
    #[expect(
        clippy::float_cmp,
        reason = "the exponents 0 and 1 themselves have ways of their own"
    )]
    fn piece(&mut self, start: &Start) -> Piece {
        if self.law.exponent == 0.0 {
            return straight_piece(self, start);
        }
        let limit = self.law.dynamic_force.get(start.direction);
        if limit == 0.0 && self.force != 0.0 {
            // Without a limit this way, whatever the spring held is gone at once, and the block may
            // go the other way.
            let dissipated = self.stored_energy();
            self.force = 0.0;
            return start.no_distance(dissipated);
        }
        let rest = self.rest(start.direction);
        if limit * rest < SETTLED_N {
            self.slide(start)
        } else if self.law.exponent == 1.0 {
            self.yield_exponentially(start)
        } else {
            self.yield_by_power(start, rest)
        }
    }
}

impl DahlContact {
    /// The energy, J, that friction took over a distance, m, that ended at a force (N) along
    /// the motion: `(Fc^2/sigma) integral (1 - r)(r^-i - 1) dr` from `r` at the end to `r` at the
    /// start, and `Fc` beyond where `r` is zero.
    fn dissipated(&self, from: f64, to: f64, limit: f64, distance: f64) -> f64 {
        let stiffness = self.law.contact_stiffness;
        if limit <= 0.0 {
            return 0.5 * from * from / stiffness;
        }
        // The work is the integral of the force over the path, and `r` is most of what is left of it:
        // `integral r dx = (Fc/sigma) integral r^(1 - i) dr`.
        let (before, after) = ((1.0 - from / limit).max(0.0), (1.0 - to / limit).max(0.0));
        let i = self.law.exponent;
        let power = 2.0 - i;
        let missing = if before == 0.0 {
            0.0
        } else if after == 0.0 {
            // Only an exponent below 1 comes here, or rounding.
            powf(before, power) / power
        } else {
            let fallen = ln_1p((before - after) / after);
            if (power * fallen).abs() < 1e-9 {
                fallen
            } else {
                powf(before, power) * -exp_m1(-power * fallen) / power
            }
        };
        let stored = 0.5 * (before - after) * (2.0 - before - after);
        limit * distance - limit * limit / stiffness * (missing + stored)
    }
}

impl DeviceContact for DahlContact {
    fn advance<E: EnergyMeter>(&mut self, leg: &Leg, meter: &mut E) -> bool {
        let from = self.force;
        YieldingContact::advance(self, leg);
        if E::LISTENS {
            let sign = leg.direction.sign();
            let limit = self.law.dynamic_force.get(leg.direction);
            meter.take(self.dissipated(sign * from, sign * self.force, limit, leg.distance));
        }
        false
    }

    fn friction(&self, velocity: f64) -> f64 {
        let direction = Direction::of(velocity);
        // Without a limit this way, whatever the spring held is gone at once.
        let held = if self.law.dynamic_force.get(direction) > 0.0 {
            self.force
        } else {
            0.0
        };
        held + self.law.viscous.get(direction) * velocity
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// The closed form rises as the equation says, through a reversal, whatever the exponent: between two places
        /// by a slope that lies between those at both, as the slope falls along a direction.
        #[test]
        fn the_closed_form_is_the_solution(
            exponent in prop_oneof![Just(0.0), Just(1.0), Just(0.5), 0.0..4.0f64, 0.9999..1.0001f64],
            positive in 0.5..10.0f64, negative in 0.5..10.0f64, distance in 1e-6..2e-4f64,
        ) {
            let law = Dahl {
                dynamic_force: Directional { positive, negative },
                contact_stiffness: 1e5,
                exponent,
                viscous: Directional::both(0.0),
            };
            let mut contact = law.contact();
            for direction in [Direction::Positive, Direction::Negative, Direction::Positive] {
                let (from_speed, to_speed, duration_s) = (0.0, 0.0, 1e-3);
                let (sign, limit, step) = (direction.sign(), law.dynamic_force.get(direction), distance / 1000.0);
                let slope = |along: f64| {
                    let rest = (1.0 - along / limit).max(0.0);
                    if rest > 0.0 { 1e5 * rest.powf(exponent) } else { 0.0 }
                };
                for _ in 0..1000 {
                    let before = sign * contact.force;
                    let leg = Leg { direction, distance: step, from_speed, to_speed, duration_s };
                    YieldingContact::advance(&mut contact, &leg);
                    let after = sign * contact.force;
                    let (most, least) = (slope(before) * step, slope(after) * step);
                    let rise = after - before;
                    prop_assert!(rise >= least - 1e-12 && rise <= most + 1e-12, "{rise} N, from {least} to {most} N");
                }
            }
        }
    }
}
