//! Rules between the static and the dynamic force that several laws share.

use super::law;
use crate::contact::{SUDDEN_FALL_MPS, Stribeck};
use crate::directional::{Direction, Directional};
use crate::parameters::{Parameter, SceneError};

/// Refuses a static force below the dynamic one.
pub(super) fn check_static_not_below(
    law: &'static str,
    static_force: Directional,
    dynamic_force: Directional,
) -> Result<(), SceneError> {
    for direction in Direction::BOTH {
        let (held, sliding) = (static_force.get(direction), dynamic_force.get(direction));
        if held < sliding {
            let same = static_force.is_symmetric() && dynamic_force.is_symmetric();
            return Err(SceneError::StaticBelowDynamic {
                param: if same {
                    Parameter::StaticForce.into()
                } else {
                    Parameter::StaticForce.in_direction(direction)
                },
                law,
                static_force: held,
                dynamic_force: sliding,
            });
        }
    }
    Ok(())
}

/// Raises a static force to the dynamic one.
pub(super) fn raise(static_force: &mut Directional, dynamic_force: Directional) {
    *static_force = static_force.zip(dynamic_force, f64::max);
}

/// Largest `Fs/Fd` of a bristle: its stiffness against its slide grows with it, and with it the work of
/// a tick.
pub const MAX_STICTION: f64 = 100.0;

/// Refuses a static force more than [`MAX_STICTION`] times the dynamic one.
pub(super) fn check_stiction(
    law: &'static str,
    static_force: Directional,
    dynamic_force: Directional,
) -> Result<(), SceneError> {
    for direction in Direction::BOTH {
        let (held, sliding) = (static_force.get(direction), dynamic_force.get(direction));
        let max = MAX_STICTION * sliding;
        if held > max {
            return Err(SceneError::TooMuchStiction {
                law,
                param: Parameter::StaticForce.in_direction(direction),
                static_force: held,
                dynamic_force: sliding,
                max,
                most_ratio: MAX_STICTION,
            });
        }
    }
    Ok(())
}

/// Lowers a static force to the greatest that is accepted.
pub(super) fn limit_stiction(static_force: &mut Directional, dynamic_force: Directional) {
    *static_force = static_force.zip(dynamic_force, |held, sliding| held.min(MAX_STICTION * sliding));
}

/// The forces of a bristle that falls from its static to its dynamic force over a velocity.
#[derive(Clone, Copy, Debug)]
pub(super) struct StribeckForces {
    /// `Fs`, N.
    pub(super) static_force: Directional,
    /// `Fd`, N.
    pub(super) dynamic_force: Directional,
    /// `ws`, m/s.
    pub(super) velocity: f64,
}

impl StribeckForces {
    /// Stribeck's curve; `None` where the two forces are equal.
    pub(super) fn curve(&self) -> Option<Stribeck> {
        (self.static_force != self.dynamic_force)
            .then(|| Stribeck::new(self.static_force, self.dynamic_force, self.velocity))
    }

    /// Friction of a steady slide without its viscous part, N.
    pub(super) fn at(&self, direction: Direction, speed: f64) -> f64 {
        use crate::contact::Level;
        self.curve()
            .map_or(self.dynamic_force.get(direction), |curve| curve.at(direction, speed))
    }

    /// Drag, N s/m, below which a bristle with such a damping (N s/m) can give out energy: one that
    /// was loaded at rest gives way at a speed, and its damping pushes by as much as it gives way
    /// (Barabanov and Ortega 2000). A bristle that flows later flows no less there.
    pub(super) fn passive_from(&self, direction: Direction, damping: f64) -> f64 {
        damping * (self.static_force.get(direction) / self.dynamic_force.get(direction) - 1.0)
    }

    /// Refuses a static force below the dynamic one or far above it, and a fall without a velocity to
    /// fall over.
    pub(super) fn check(&self, law: &'static str) -> Result<(), SceneError> {
        check_static_not_below(law, self.static_force, self.dynamic_force)?;
        check_stiction(law, self.static_force, self.dynamic_force)?;
        if self.static_force != self.dynamic_force && self.velocity < SUDDEN_FALL_MPS {
            return Err(SceneError::NoStribeckVelocity {
                law,
                velocity: self.velocity,
                least: SUDDEN_FALL_MPS,
            });
        }
        Ok(())
    }

    /// The nearest static force, N, and velocity, m/s, that [`check`](Self::check) accepts.
    pub(super) fn complied(mut self) -> (Directional, f64) {
        raise(&mut self.static_force, self.dynamic_force);
        limit_stiction(&mut self.static_force, self.dynamic_force);
        if self.velocity < SUDDEN_FALL_MPS {
            self.velocity = law::STRIBECK_VELOCITY_MPS;
        }
        (self.static_force, self.velocity)
    }
}
