//! The rig's own friction: what its guide, motor and transmission take from every motion, as it was
//! identified with its own motor.
//!
//! ```text
//! mass a = motor + hand - dynamic sgn(v) - viscous v - cogging(x)
//! ```

use crate::bound_error::BoundError;
use crate::directional::Directional;
use crate::math::{floor, sin_cos};
use crate::passivity::RigLosses;
use core::f64::consts::TAU;

/// Harmonics of a rig's cogging.
pub const COGGING_HARMONICS: usize = 4;

/// What was identified of a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RigFriction {
    /// Mass of the moving part, kg.
    #[cfg_attr(feature = "serde", serde(rename = "mass_kg"))]
    pub mass: f64,
    /// Dynamic friction by direction, N.
    #[cfg_attr(feature = "serde", serde(rename = "dynamic_force_N"))]
    pub dynamic_force: Directional,
    /// Viscous damping by direction, N s/m.
    #[cfg_attr(feature = "serde", serde(rename = "viscous_Ns_per_m"))]
    pub viscous: Directional,
    /// Force that depends on the position.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub cogging: Option<Cogging>,
    /// How far the truth may lie from these values, with 95 % certainty.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub uncertainty: Option<RigUncertainty>,
}

/// Half of each value's 95 % interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RigUncertainty {
    /// Of the mass, kg.
    #[cfg_attr(feature = "serde", serde(rename = "mass_kg"))]
    pub mass: f64,
    /// Of the dynamic friction by direction, N.
    #[cfg_attr(feature = "serde", serde(rename = "dynamic_force_N"))]
    pub dynamic_force: Directional,
    /// Of the viscous damping by direction, N s/m.
    #[cfg_attr(feature = "serde", serde(rename = "viscous_Ns_per_m"))]
    pub viscous: Directional,
}

/// A force against the positive axis that repeats itself along the path: the sum of
/// `cosine cos(k p) + sine sin(k p)` over the harmonics `k = 1, 2, ...`, with
/// `p = 2 pi position / period`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Cogging {
    /// Distance after which it repeats, m.
    pub period_m: f64,
    /// Whether the device's positions are the same after every start: only then cogging is compensated.
    pub absolute_position: bool,
    /// The harmonics, from the first on.
    pub harmonics: [Harmonic; COGGING_HARMONICS],
}

/// One harmonic of the cogging.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Harmonic {
    /// Amplitude of the cosine, N.
    #[cfg_attr(feature = "serde", serde(rename = "cosine_N"))]
    pub cosine: f64,
    /// Amplitude of the sine, N.
    #[cfg_attr(feature = "serde", serde(rename = "sine_N"))]
    pub sine: f64,
}

impl RigFriction {
    /// Whether every value is one that a rig can have.
    ///
    /// # Errors
    /// The first field that is out of range or NaN.
    pub fn validate(&self) -> Result<(), BoundError> {
        let within = BoundError::check;
        let (dynamic, viscous) = (self.dynamic_force, self.viscous);
        within("mass_kg", self.mass, 1e-3, 1000.0, "kg")?;
        within("dynamic_force_N.positive", dynamic.positive, 0.0, 1000.0, "N")?;
        within("dynamic_force_N.negative", dynamic.negative, 0.0, 1000.0, "N")?;
        within("viscous_Ns_per_m.positive", viscous.positive, 0.0, 1e4, "N s/m")?;
        within("viscous_Ns_per_m.negative", viscous.negative, 0.0, 1e4, "N s/m")?;
        if let Some(half) = self.uncertainty {
            within("uncertainty.mass_kg", half.mass, 0.0, 1000.0, "kg")?;
            for force in [half.dynamic_force.positive, half.dynamic_force.negative] {
                within("uncertainty.dynamic_force_N", force, 0.0, 1000.0, "N")?;
            }
            for damping in [half.viscous.positive, half.viscous.negative] {
                within("uncertainty.viscous_Ns_per_m", damping, 0.0, 1e4, "N s/m")?;
            }
        }
        let Some(cogging) = self.cogging else { return Ok(()) };
        within("cogging.period_m", cogging.period_m, 1e-5, 10.0, "m")?;
        for harmonic in cogging.harmonics {
            within("cogging.harmonics.cosine_N", harmonic.cosine, -1000.0, 1000.0, "N")?;
            within("cogging.harmonics.sine_N", harmonic.sine, -1000.0, 1000.0, "N")?;
        }
        Ok(())
    }

    /// What the rig takes up whichever way it moves: the smaller value of both directions. Cogging
    /// takes nothing up; it gives back what it takes.
    #[must_use]
    pub fn losses(&self) -> RigLosses {
        RigLosses {
            damping: self.viscous.least(),
            friction: self.dynamic_force.least(),
        }
    }
}

impl Cogging {
    /// The force against the positive axis at a position (m), N.
    #[must_use]
    pub fn force(&self, position: f64) -> f64 {
        let turns = position / self.period_m;
        // The whole turns go first: far from zero the phase would lose its digits.
        let (sine, cosine) = sin_cos(TAU * (turns - floor(turns)));
        let (mut sine_k, mut cosine_k, mut force) = (0.0, 1.0, 0.0);
        for harmonic in self.harmonics {
            (sine_k, cosine_k) = (sine_k * cosine + cosine_k * sine, cosine_k * cosine - sine_k * sine);
            force += harmonic.cosine * cosine_k + harmonic.sine * sine_k;
        }
        force
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString;

    const RIG: RigFriction = RigFriction {
        mass: 1.4,
        dynamic_force: Directional::new(0.8, 0.7),
        viscous: Directional::new(1.5, 2.0),
        cogging: None,
        uncertainty: None,
    };

    const fn harmonic(cosine: f64, sine: f64) -> Harmonic {
        Harmonic { cosine, sine }
    }

    const COGGING: Cogging = Cogging {
        period_m: 0.02,
        absolute_position: true,
        harmonics: [
            harmonic(0.1, -0.2),
            harmonic(0.0, 0.05),
            harmonic(0.01, 0.0),
            harmonic(0.0, -0.02),
        ],
    };

    #[test]
    fn impossible_rig_value_is_refused_with_field_and_limits() {
        let rig = |change: fn(&mut RigFriction, &mut Cogging)| {
            let (mut rig, mut cogging) = (RIG, COGGING);
            change(&mut rig, &mut cogging);
            rig.cogging = Some(cogging);
            rig
        };
        assert_eq!(RIG.validate(), Ok(()));
        for (wrong, parts) in [
            (
                rig(|rig, _| rig.mass = 0.0),
                ["mass_kg = 0 kg", "from 0.001 to 1000 kg"],
            ),
            (
                rig(|rig, _| rig.dynamic_force.negative = -0.1),
                ["dynamic_force_N.negative = -0.1 N", "from 0 to 1000 N"],
            ),
            (
                rig(|rig, _| rig.viscous.positive = f64::NAN),
                ["viscous_Ns_per_m.positive = NaN N s/m", "from 0 to 10000 N s/m"],
            ),
            (
                rig(|_, cogging| cogging.period_m = 0.0),
                ["cogging.period_m = 0 m", "from 0.00001 to 10 m"],
            ),
            (
                rig(|_, cogging| cogging.harmonics[3].sine = f64::INFINITY),
                ["cogging.harmonics.sine_N = inf N", "from -1000 to 1000 N"],
            ),
        ] {
            let message = wrong.validate().expect_err("no rig has it").to_string();
            for part in parts {
                assert!(message.contains(part), "{message} lacks {part}");
            }
        }
    }

    #[test]
    fn cogging_is_the_sum_of_its_harmonics_and_repeats_itself() {
        for position in [-0.013, 0.0, 0.0042, 0.0199] {
            let phase = TAU * position / COGGING.period_m;
            let mut sum = 0.0;
            for (k, harmonic) in (1_u32..).zip(COGGING.harmonics) {
                let (sine, cosine) = sin_cos(f64::from(k) * phase);
                sum += harmonic.cosine * cosine + harmonic.sine * sine;
            }
            for periods in [0.0, 5.0, -300.0] {
                let force = COGGING.force(position + periods * COGGING.period_m);
                assert!((force - sum).abs() < 1e-12, "{force} N, {sum} N at {position} m");
            }
        }
    }
}
