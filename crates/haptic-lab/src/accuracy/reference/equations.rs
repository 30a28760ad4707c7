//! The laws as differential equations, written down once more from their papers, which the core's
//! closed forms and tangents are not.

use haptic_core::friction::Friction;
use haptic_core::scene::Coupling;
use haptic_core::{Direction, Directional};

/// Share of the shortest time in the equations that a step takes: the method's error is the fourth
/// power of it.
const STEP: f64 = 5e-3;
/// Block position, block velocity, and the state of the contact: a deflection (m), a force (N) or a
/// time at rest (s), as the law has it.
pub(super) type State = [f64; 3];

/// Kind of motion between two events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mode {
    /// Held still by a rigid contact.
    Rigid,
    /// Held by a spring.
    Spring,
    /// In motion in a direction. `armed`: it has been faster than the threshold, or, under Dahl's
    /// law, has come to its limit; `peak`: the friction that it began with, N.
    Moving {
        direction: Direction,
        armed: bool,
        peak: f64,
    },
}

pub(super) struct Problem<'a> {
    pub(super) mass: f64,
    pub(super) coupling: &'a Coupling,
    pub(super) law: &'a Friction,
}

/// `K p + B v` on a straight line between two samples.
#[derive(Clone, Copy)]
pub(super) struct Drive {
    pub(super) at_start: f64,
    pub(super) slope: f64,
}

impl Problem<'_> {
    pub(super) fn load(&self, drive: Drive, t: f64, state: &State) -> f64 {
        drive.at_start + drive.slope * t - self.coupling.stiffness * state[0]
    }

    /// Friction and the rate of the contact's own state.
    pub(super) fn friction(&self, state: &State, mode: Mode) -> (f64, f64) {
        let [_, w, z] = *state;
        let direction = match mode {
            Mode::Moving { direction, .. } => direction,
            Mode::Rigid | Mode::Spring => Direction::of(w),
        };
        let s = direction.sign();
        let gauss = |held: f64, sliding: f64, velocity: f64| {
            if velocity > 0.0 {
                sliding + (held - sliding) * (-(w / velocity).powi(2)).exp()
            } else {
                sliding
            }
        };
        match self.law {
            Friction::Viscous(law) => (law.viscous.get(direction) * w, 0.0),
            Friction::Karnopp(law) => {
                let Mode::Moving { peak, .. } = mode else {
                    return (0.0, 0.0);
                };
                let force = gauss(peak, law.dynamic_force.get(direction), law.stribeck_velocity);
                (s * force + law.viscous.get(direction) * w, 0.0)
            }
            Friction::Dahl(law) => {
                // z is the force itself.
                let rest = 1.0 - s * z / law.dynamic_force.get(direction);
                let slope = law.contact_stiffness * rest.max(0.0).powf(law.exponent);
                let saturated = matches!(mode, Mode::Moving { armed: true, .. });
                let slope = if saturated { 0.0 } else { slope };
                (z + law.viscous.get(direction) * w, slope * w)
            }
            Friction::HaywardArmstrong(law) => {
                let longest = law.dynamic_force.get(direction) / law.contact_stiffness;
                let (ratio, onset) = ((z / longest).powi(8), law.elastic_fraction.powi(8));
                let alpha = if ratio > 0.0 {
                    (1.0 + onset) * ratio / (onset + ratio) / longest
                } else {
                    0.0
                };
                (
                    law.contact_stiffness * z + law.viscous.get(direction) * w,
                    w - w.abs() * alpha * z,
                )
            }
            Friction::Lugre(law) => {
                let g = gauss(
                    law.static_force.get(direction),
                    law.dynamic_force.get(direction),
                    law.stribeck_velocity,
                );
                let rate = w - law.contact_stiffness * w.abs() * z / g;
                let force = law.contact_stiffness * z + law.contact_damping * rate + law.viscous.get(direction) * w;
                (force, rate)
            }
            Friction::ElastoPlastic(law) => {
                let g = gauss(
                    law.static_force.get(direction),
                    law.dynamic_force.get(direction),
                    law.stribeck_velocity,
                );
                let ratio = law.contact_stiffness * s * z / g;
                let alpha = match ratio {
                    r if r <= law.elastic_fraction => 0.0,
                    r if r >= 1.0 => 1.0,
                    r => {
                        let middle = 0.5 * (1.0 + law.elastic_fraction);
                        0.5 + 0.5 * (std::f64::consts::PI * (r - middle) / (1.0 - law.elastic_fraction)).sin()
                    }
                };
                let rate = w * (1.0 - alpha * ratio);
                let force = law.contact_stiffness * z + law.contact_damping * rate + law.viscous.get(direction) * w;
                (force, rate)
            }
            Friction::ResetIntegrator(law) => match mode {
                // z is the bristle's deflection; (1 + a) sigma z holds.
                Mode::Moving { .. } => (
                    s * law.dynamic_force.get(direction) + law.viscous.get(direction) * w,
                    0.0,
                ),
                Mode::Rigid | Mode::Spring => {
                    let loaded = Direction::of(z);
                    let gain = law.static_force.get(loaded) / law.dynamic_force.get(loaded);
                    (gain * law.contact_stiffness * z + law.contact_damping * w, w)
                }
            },
            Friction::SalcudeanVlaar(law) => match mode {
                Mode::Moving { .. } => (law.viscous.get(direction) * w, 0.0),
                Mode::Rigid | Mode::Spring => (law.contact_stiffness * z, w),
            },
            unknown => no_equations(unknown),
        }
    }

    /// The static limit in a direction after a rest, N.
    pub(super) fn limit(&self, direction: Direction, rest_s: f64) -> f64 {
        match self.law {
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

    pub(super) fn threshold(&self) -> f64 {
        match self.law {
            Friction::Karnopp(law) => law.velocity_threshold,
            Friction::SalcudeanVlaar(law) => law.velocity_threshold,
            _ => 0.0,
        }
    }

    /// The spring's own force, without damping.
    pub(super) fn spring(&self, z: f64) -> f64 {
        match self.law {
            Friction::ResetIntegrator(law) => {
                let loaded = Direction::of(z);
                law.contact_stiffness * z * law.static_force.get(loaded) / law.dynamic_force.get(loaded)
            }
            Friction::SalcudeanVlaar(law) => law.contact_stiffness * z,
            _ => 0.0,
        }
    }

    /// The deflection at which the spring has a force.
    pub(super) fn deflection(&self, force: f64) -> f64 {
        force / (self.spring(force.signum()) / force.signum())
    }

    /// Whether a force under Dahl's law has come to its limit, which it does in a finite
    /// displacement where the exponent is below 1.
    pub(super) fn is_saturated(&self, state: &State, direction: Direction) -> bool {
        match self.law {
            Friction::Dahl(law) if law.exponent < 1.0 => {
                direction.sign() * state[2] >= law.dynamic_force.get(direction)
            }
            _ => false,
        }
    }

    /// The longest step, s, where the block is no faster than `speed`, m/s.
    pub(super) fn longest_step(&self, speed: f64) -> f64 {
        let contact = self.law.contact_stiffness(false);
        let least = |force: Directional| force.least().max(1e-3);
        let (damping, yielding) = match self.law {
            Friction::Karnopp(law) => {
                let fall = if law.stribeck_velocity > 0.0 {
                    (law.static_force.greatest() - law.dynamic_force.least()).abs() / law.stribeck_velocity
                } else {
                    0.0
                };
                (law.viscous.greatest() + fall, 0.0)
            }
            Friction::Viscous(law) => (law.viscous.greatest(), 0.0),
            Friction::Dahl(law) => (
                law.viscous.greatest(),
                contact * law.exponent / least(law.dynamic_force),
            ),
            Friction::HaywardArmstrong(law) => (law.viscous.greatest(), 8.0 * contact / least(law.dynamic_force)),
            Friction::ResetIntegrator(law) => (law.viscous.greatest() + law.contact_damping, 0.0),
            Friction::Lugre(law) => (
                law.viscous.greatest() + law.contact_damping,
                contact / least(law.dynamic_force),
            ),
            Friction::ElastoPlastic(law) => (
                law.viscous.greatest() + law.contact_damping,
                8.0 * contact / least(law.dynamic_force),
            ),
            Friction::SalcudeanVlaar(law) => (law.viscous.greatest(), 0.0),
            unknown => no_equations(unknown),
        };
        let fastest = ((self.coupling.stiffness + contact) / self.mass)
            .sqrt()
            .max((self.coupling.damping + damping) / self.mass)
            .max(yielding * speed);
        STEP / fastest
    }
}

/// A law is judged here once its equations are written down above.
fn no_equations(law: &Friction) -> ! {
    panic!("the reference solver has no equations of the law {}", law.law());
}
