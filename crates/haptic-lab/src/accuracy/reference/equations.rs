//! The laws as differential equations, written down once more from their papers, which the core's
//! closed forms and series are not.

use haptic_core::Direction;
use haptic_core::block::Contact;
use haptic_core::friction::Friction;

/// Kind of motion between two events. Within one the equations are smooth, and remain so a little
/// beyond its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mode {
    /// Held still by a rigid contact.
    Rigid,
    /// Held by a spring.
    Spring,
    /// In motion in a direction. `peak`: the friction that it began with, N.
    Moving {
        direction: Direction,
        regime: Regime,
        peak: f64,
    },
}

/// What a moving contact does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Regime {
    /// It slides, and has not been faster than the threshold.
    Slow,
    /// It has been faster than the threshold.
    Armed,
    /// It deflects without plastic flow.
    Elastic,
    /// It deflects and flows.
    Yielding,
    /// It flows as in a steady slide.
    Flowing,
}

/// Whether a contact under this law sticks and breaks away, and does not give way all the time:
/// then its changes of contact are events, and not a matter of definition.
#[must_use]
pub fn has_stuck_state(law: &Friction) -> bool {
    matches!(
        law,
        Friction::Karnopp(_) | Friction::ResetIntegrator(_) | Friction::SalcudeanVlaar(_)
    )
}

/// Where two regimes meet their laws differ by the square of the distance from there: so far, in
/// `u`, a regime lasts beyond its border, so that rounding does not lead to and fro.
const OVERLAP: f64 = 1e-9;

/// What the contact's own state `z` is depends on the law: a deflection (m), a force (N), a time at
/// rest (s), or for a yielding [`Dahl`](haptic_core::friction::Dahl) contact with `i < 1` the power
/// `(1 - u)^(1-i)`, whose rate has no root in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Law<'a>(pub(super) &'a Friction);

fn gauss(held: f64, sliding: f64, velocity: f64, w: f64) -> f64 {
    if velocity > 0.0 && held != sliding {
        sliding + (held - sliding) * (-(w / velocity).powi(2)).exp()
    } else {
        sliding
    }
}

impl Law<'_> {
    /// `g(w)` of the laws with a bristle that have one, N.
    fn level(self, direction: Direction, w: f64) -> f64 {
        let (held, sliding, velocity) = match self.0 {
            Friction::Lugre(law) => (law.static_force, law.dynamic_force, law.stribeck_velocity),
            Friction::ElastoPlastic(law) => (law.static_force, law.dynamic_force, law.stribeck_velocity),
            _ => return f64::INFINITY,
        };
        gauss(held.get(direction), sliding.get(direction), velocity, w)
    }

    /// The deflection of an elasto-plastic contact over that of a steady slide.
    fn ratio(self, direction: Direction, w: f64, z: f64) -> f64 {
        let stiffness = self.0.contact_stiffness(false);
        stiffness * direction.sign() * z / self.level(direction, w)
    }

    /// Friction, N, and the rate of the contact's own state, at a velocity, m/s.
    pub(super) fn friction(self, w: f64, z: f64, mode: Mode) -> (f64, f64) {
        let Mode::Moving {
            direction,
            regime,
            peak,
        } = mode
        else {
            return self.held(w, z, mode);
        };
        let s = direction.sign();
        match self.0 {
            Friction::Viscous(law) => (law.viscous.get(direction) * w, 0.0),
            Friction::Karnopp(law) => {
                let force = gauss(peak, law.dynamic_force.get(direction), law.stribeck_velocity, w);
                (s * force + law.viscous.get(direction) * w, 0.0)
            }
            Friction::Dahl(law) => {
                let (limit, viscous) = (law.dynamic_force.get(direction), law.viscous.get(direction) * w);
                match regime {
                    Regime::Flowing => (s * limit + viscous, 0.0),
                    _ if law.exponent < 1.0 => {
                        let rate = -(1.0 - law.exponent) * law.contact_stiffness / limit * s * w;
                        (s * limit * (1.0 - power(z, 1.0 / (1.0 - law.exponent))) + viscous, rate)
                    }
                    _ => {
                        let rest = (1.0 - s * z / limit).max(0.0);
                        (z + viscous, law.contact_stiffness * rest.powf(law.exponent) * w)
                    }
                }
            }
            Friction::HaywardArmstrong(law) => {
                let longest = law.dynamic_force.get(direction) / law.contact_stiffness;
                let (ratio, onset) = ((z / longest).powi(8), law.elastic_fraction.powi(8));
                let alpha = (1.0 + onset) / (1.0 + onset / ratio) / longest;
                (
                    law.contact_stiffness * z + law.viscous.get(direction) * w,
                    w - s * w * alpha * z,
                )
            }
            Friction::Lugre(law) => {
                let rate = w - law.contact_stiffness * s * w * z / self.level(direction, w);
                let force = law.contact_stiffness * z + law.contact_damping * rate + law.viscous.get(direction) * w;
                (force, rate)
            }
            Friction::ElastoPlastic(law) => {
                let ratio = self.ratio(direction, w, z);
                let alpha = match regime {
                    Regime::Elastic => 0.0,
                    Regime::Yielding => {
                        let middle = 0.5 * (1.0 + law.elastic_fraction);
                        0.5 + 0.5 * (std::f64::consts::PI * (ratio - middle) / (1.0 - law.elastic_fraction)).sin()
                    }
                    _ => 1.0,
                };
                let rate = w * (1.0 - alpha * ratio);
                let force = law.contact_stiffness * z + law.contact_damping * rate + law.viscous.get(direction) * w;
                (force, rate)
            }
            Friction::ResetIntegrator(law) => (
                s * law.dynamic_force.get(direction) + law.viscous.get(direction) * w,
                0.0,
            ),
            Friction::SalcudeanVlaar(law) => (law.viscous.get(direction) * w, 0.0),
            unknown => no_equations(unknown),
        }
    }

    /// The same while a contact holds.
    fn held(self, w: f64, z: f64, mode: Mode) -> (f64, f64) {
        match self.0 {
            // z is the bristle's deflection; (1 + a) sigma z holds.
            Friction::ResetIntegrator(law) => (self.spring(z) + law.contact_damping * w, w),
            _ if mode == Mode::Spring => (self.spring(z), w),
            _ => (0.0, 1.0),
        }
    }

    /// The contact that a state counts as: a law without a stuck state is stuck where deflection
    /// takes up half of a motion or more, as the core has it.
    pub(super) fn contact(self, w: f64, z: f64, mode: Mode) -> Contact {
        let Mode::Moving { direction, regime, .. } = mode else {
            return Contact::Stuck;
        };
        let elastic_share = match self.0 {
            Friction::Dahl(_) if regime == Regime::Flowing => 0.0,
            Friction::Dahl(law) if law.exponent < 1.0 => power(z, law.exponent / (1.0 - law.exponent)),
            Friction::Dahl(law) => self.friction(1.0, z, mode).1 / law.contact_stiffness,
            Friction::HaywardArmstrong(_) | Friction::Lugre(_) | Friction::ElastoPlastic(_) => {
                // At rest the share is that of a very slow motion.
                let w = if w == 0.0 { direction.sign() * 1e-12 } else { w };
                self.friction(w, z, mode).1 / w
            }
            _ => 0.0,
        };
        if elastic_share >= 0.5 {
            Contact::Stuck
        } else {
            Contact::Sliding(direction)
        }
    }

    /// The static limit in a direction after a rest, N.
    pub(super) fn limit(self, direction: Direction, rest_s: f64) -> f64 {
        match self.0 {
            Friction::Karnopp(law) => {
                let (held, sliding) = (law.static_force.get(direction), law.dynamic_force.get(direction));
                if law.rising_rate > 0.0 && held > sliding {
                    sliding + (held - sliding) * (1.0 - (-law.rising_rate * rest_s).exp())
                } else if law.stribeck_velocity > 0.0 {
                    held
                } else {
                    held.max(sliding)
                }
            }
            Friction::ResetIntegrator(law) => law.static_force.get(direction),
            Friction::SalcudeanVlaar(law) => law.static_force.get(direction),
            _ => f64::INFINITY,
        }
    }

    pub(super) fn threshold(self) -> f64 {
        match self.0 {
            Friction::Karnopp(law) => law.velocity_threshold,
            Friction::SalcudeanVlaar(law) => law.velocity_threshold,
            _ => 0.0,
        }
    }

    /// The spring's own force, N, without damping.
    pub(super) fn spring(self, z: f64) -> f64 {
        match self.0 {
            Friction::ResetIntegrator(law) => {
                let loaded = Direction::of(z);
                law.contact_stiffness * z * law.static_force.get(loaded) / law.dynamic_force.get(loaded)
            }
            // On the device itself.
            law => law.contact_stiffness(true) * z,
        }
    }

    /// The deflection at which the spring has a force.
    pub(super) fn deflection(self, force: f64) -> f64 {
        if force == 0.0 {
            0.0
        } else {
            force / (self.spring(force.signum()) / force.signum())
        }
    }

    /// Along a motion, what is not negative in a mode, by its index; `None` beyond the last.
    pub(super) fn margin(self, index: usize, w: f64, z: f64, mode: Mode) -> Option<f64> {
        let Mode::Moving { direction, regime, .. } = mode else {
            let toward = *[Direction::Positive, Direction::Negative].get(index)?;
            return (mode == Mode::Spring).then(|| self.limit(toward, 0.0) - toward.sign() * self.spring(z));
        };
        let speed = direction.sign() * w;
        match (self.0, regime, index) {
            (_, Regime::Armed, 0) => Some(speed - self.threshold()),
            (_, _, 0) => Some(speed),
            (_, Regime::Slow, 1) if self.threshold() > 0.0 => Some(self.threshold() - speed),
            (Friction::Dahl(law), Regime::Yielding, 1) if law.exponent < 1.0 => Some(z),
            (Friction::ElastoPlastic(law), _, 1 | 2) => {
                let ratio = self.ratio(direction, w, z);
                match (regime, index) {
                    (Regime::Elastic, 1) => Some(law.elastic_fraction + OVERLAP - ratio),
                    (Regime::Yielding, 1) => Some(1.0 + OVERLAP - ratio),
                    (Regime::Yielding, 2) => Some(ratio - law.elastic_fraction + OVERLAP),
                    (Regime::Flowing, 1) => Some(ratio - 1.0 + OVERLAP),
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// The mode of a contact that holds nothing back and moves one way, and its own state then.
    /// `force` is what it holds, N.
    pub(super) fn moving(self, direction: Direction, peak: f64, w: f64, force: f64) -> (Mode, f64) {
        let s = direction.sign();
        let stiffness = self.0.contact_stiffness(false);
        let (regime, z) = match self.0 {
            Friction::Dahl(law) if law.exponent < 1.0 => {
                let rest = (1.0 - s * force / law.dynamic_force.get(direction)).max(0.0);
                if rest > 0.0 {
                    (Regime::Yielding, rest.powf(1.0 - law.exponent))
                } else {
                    (Regime::Flowing, 0.0)
                }
            }
            Friction::Dahl(_) => (Regime::Yielding, force),
            Friction::ElastoPlastic(law) => {
                let z = force / stiffness;
                let ratio = self.ratio(direction, w, z);
                let regime = if ratio < law.elastic_fraction {
                    Regime::Elastic
                } else if ratio < 1.0 {
                    Regime::Yielding
                } else {
                    Regime::Flowing
                };
                (regime, z)
            }
            Friction::HaywardArmstrong(_) | Friction::Lugre(_) => (Regime::Yielding, force / stiffness),
            _ => (Regime::Slow, 0.0),
        };
        (
            Mode::Moving {
                direction,
                regime,
                peak,
            },
            z,
        )
    }

    /// The velocity, m/s, over which friction falls; `None` where it does not depend on velocity.
    pub(super) fn falls_over(self) -> Option<f64> {
        let (held, sliding, velocity) = match self.0 {
            Friction::Karnopp(law) => (law.static_force, law.dynamic_force, law.stribeck_velocity),
            Friction::Lugre(law) => (law.static_force, law.dynamic_force, law.stribeck_velocity),
            Friction::ElastoPlastic(law) => (law.static_force, law.dynamic_force, law.stribeck_velocity),
            _ => return None,
        };
        (velocity > 0.0 && held != sliding).then_some(velocity)
    }

    /// Newtons for one unit of the contact's own state, at a velocity: `sigma1` feels its rate.
    pub(super) fn size_of_state(self, w: f64) -> f64 {
        let by_rate = |damping: f64, steady: f64| 1.0 + damping * w.abs() / steady;
        match self.0 {
            Friction::Lugre(law) => law.contact_stiffness * by_rate(law.contact_damping, law.dynamic_force.least()),
            Friction::ElastoPlastic(law) => {
                law.contact_stiffness * by_rate(law.contact_damping, 0.2 * law.dynamic_force.least())
            }
            Friction::Dahl(law) if law.exponent < 1.0 => law.dynamic_force.greatest(),
            Friction::Dahl(_) => 1.0,
            law => law.contact_stiffness(false),
        }
    }
}

/// A power whose whole exponents are smooth through zero.
fn power(z: f64, exponent: f64) -> f64 {
    if exponent.fract() == 0.0 && exponent < 16.0 {
        z.powi(exponent as i32)
    } else {
        z.max(0.0).powf(exponent)
    }
}

/// A law is judged here once its equations are written down above.
fn no_equations(law: &Friction) -> ! {
    panic!("the reference solver has no equations of the law {}", law.law());
}
