//! Validation of a scene, and notes for its user.

use super::change::Scene;
use crate::block::MAX_PHASE_PER_TICK_RAD;
use crate::directional::Direction;
use crate::math::sqrt;
use crate::parameters::{Note, Parameter, SceneError, TABLE, check_range};
use alloc::vec::Vec;

impl Scene {
    /// Whether the scene can be rendered.
    ///
    /// # Errors
    /// The first value that is not finite or out of range, or a missing coupling.
    pub fn validate(&self) -> Result<(), SceneError> {
        self.check_ranges()?;
        self.check_parts()
    }

    /// Whether each value is within its range: between two scenes of which that is true each value is, too.
    pub(crate) fn check_ranges(&self) -> Result<(), SceneError> {
        for row in &TABLE {
            let Some(value) = self.value(row.parameter) else {
                continue;
            };
            if value.is_symmetric() || !row.directional {
                check_range(row.parameter.into(), value.positive)?;
            } else {
                for direction in Direction::BOTH {
                    check_range(row.parameter.in_direction(direction), value.get(direction))?;
                }
            }
        }
        Ok(())
    }

    /// Whether parts and values that are within their ranges go together.
    pub(crate) fn check_parts(&self) -> Result<(), SceneError> {
        match (&self.block, &self.coupling) {
            (Some(_), None) => return Err(SceneError::BlockWithoutCoupling),
            (None, Some(_)) => return Err(SceneError::CouplingWithoutBlock),
            (Some(_), Some(held)) if held.stiffness == 0.0 && held.damping == 0.0 => {
                return Err(SceneError::NoCoupling);
            }
            _ => {}
        }
        let (law, on_device) = (self.friction.as_law(), self.is_on_device());
        if let Some(misplaced) = law.misplaced(on_device) {
            return Err(self.not_applicable(misplaced.into()));
        }
        law.validate(on_device)
    }

    /// Whether the scene can be rendered with ticks of `period_s` seconds.
    ///
    /// # Errors
    /// [`SceneError::NoPeriod`] where that is not above 0, [`SceneError::TooFast`] where the block oscillates more than
    /// [`MAX_PHASE_PER_TICK_RAD`] in a tick, and [`SceneError::TooDamped`] where under a curved law, which is followed
    /// by series, as many of its time constants `M/(B + b + sigma1)` lie in one.
    pub fn validate_rate(&self, period_s: f64) -> Result<(), SceneError> {
        if !(period_s.is_finite() && period_s > 0.0) {
            return Err(SceneError::NoPeriod { period_s });
        }
        let (Some(block), Some(held)) = (&self.block, &self.coupling) else {
            return Ok(());
        };
        let law = self.friction.as_law();
        if let Some(of_law) = law.damping_of_curve() {
            let (mass, damping) = (block.mass, held.damping + of_law);
            let decays = damping / mass * period_s;
            if decays > MAX_PHASE_PER_TICK_RAD {
                return Err(SceneError::TooDamped {
                    law: self.friction.law(),
                    mass,
                    damping,
                    period_us: period_s * 1e6,
                    decays,
                    limit: MAX_PHASE_PER_TICK_RAD,
                    mass_needed: damping * period_s / MAX_PHASE_PER_TICK_RAD,
                    damping_allowed: MAX_PHASE_PER_TICK_RAD * mass / period_s,
                });
            }
        }
        let contact_stiffness = self.friction.contact_stiffness(false);
        let (mass, stiffness) = (block.mass, held.stiffness + contact_stiffness);
        // A contact that gives way is damped by its own law at times only.
        let viscous = match self.value(Parameter::Viscous) {
            Some(viscous) if contact_stiffness == 0.0 => viscous.least(),
            _ => 0.0,
        };
        let sigma = (held.damping + viscous) / (2.0 * mass);
        let omega_d_squared = stiffness / mass - sigma * sigma;
        let radians = sqrt(omega_d_squared.max(0.0)) * period_s;
        if radians <= MAX_PHASE_PER_TICK_RAD {
            return Ok(());
        }
        // Undamped, so that the advice holds whatever the damping.
        let omega_squared_allowed = (MAX_PHASE_PER_TICK_RAD / period_s) * (MAX_PHASE_PER_TICK_RAD / period_s);
        Err(SceneError::TooFast {
            mass,
            stiffness,
            period_us: period_s * 1e6,
            radians,
            limit: MAX_PHASE_PER_TICK_RAD,
            mass_needed: stiffness / omega_squared_allowed,
            stiffness_allowed: mass * omega_squared_allowed,
        })
    }

    /// Consequences of this scene that its user may not expect.
    #[must_use]
    pub fn notes(&self) -> Vec<Note> {
        self.friction.as_law().notes()
    }
}
