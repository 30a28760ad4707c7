//! The rig itself, from a record of its own motor's force and a sweep to and fro: cogging from the
//! sweep, and mass and friction from all of the record without it.

use super::cogging::{FoundCogging, SweepSample, cogging};
use super::identify;
use super::options::{Directions, IdentifyError, Options, Record};
use super::result::{Identified, ModelKind, Refusal};
use haptic_core::Directional;
use haptic_core::rig_friction::{Cogging, RigFriction};

/// What was found of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct RigItself {
    /// Mass and friction, and what was refused.
    pub identified: Identified,
    /// Cogging, where there is any.
    pub cogging: Option<FoundCogging>,
}

/// Measures a rig.
///
/// # Errors
/// The record is unusable.
pub fn measure(record: &Record, sweep: &[SweepSample]) -> Result<RigItself, IdentifyError> {
    let roughly = identified_beside(record, cogging(sweep, 0.0))?;
    // What the mass takes of the sweep is known only now.
    match roughly.identified.mass_kg {
        Some(mass_kg) if roughly.cogging.is_some() => identified_beside(record, cogging(sweep, mass_kg)),
        _ => Ok(roughly),
    }
}

/// Mass and friction beside cogging, or beside the reason why there is none.
fn identified_beside(record: &Record, found: Result<FoundCogging, String>) -> Result<RigItself, IdentifyError> {
    let mut record = record.clone();
    if let Ok(found) = &found {
        without_cogging(&mut record, &found.cogging);
    }
    let options = Options {
        // The force is the motor's command: it has no zero to be off.
        offset_n: Some(0.0),
        directions: Directions::Separate,
        ..Options::new(ModelKind::Karnopp)
    };
    let mut identified = identify(&record, &options)?;
    if let Err(why) = &found {
        let instead = "a sweep over more travel, if the poles of the motor are farther apart";
        identified.refuse(Refusal::new("cogging", why, instead));
    }
    Ok(RigItself {
        identified,
        cogging: found.ok(),
    })
}

/// Takes cogging out of the forces of a record.
pub fn without_cogging(record: &mut Record, cogging: &Cogging) {
    for (force_n, position_m) in record.force_n.iter_mut().zip(&record.position_m) {
        *force_n -= cogging.force(*position_m);
    }
}

impl RigItself {
    /// What is kept of it, where mass, dynamic and viscous friction were all found.
    #[must_use]
    pub fn friction(&self) -> Option<RigFriction> {
        let viscous = self.identified.viscous_ns_per_m?;
        Some(RigFriction {
            mass: self.identified.mass_kg?,
            dynamic_force: self.identified.dynamic_force_n?,
            // A viscous term within its own error of zero is none.
            viscous: Directional {
                positive: viscous.positive.max(0.0),
                negative: viscous.negative.max(0.0),
            },
            cogging: self.cogging.as_ref().map(|found| found.cogging),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::rig_friction::{COGGING_HARMONICS, Harmonic};

    #[test]
    fn cogging_is_taken_out_by_the_position() {
        let mut harmonics = [Harmonic::default(); COGGING_HARMONICS];
        harmonics[0].cosine = 0.3;
        let cogging = Cogging {
            period_m: 0.01,
            absolute_position: false,
            harmonics,
        };
        let mut record = Record {
            t_s: vec![0.0, 1.0],
            position_m: vec![0.0, 0.005],
            force_n: vec![1.0, 1.0],
            ..Record::default()
        };
        without_cogging(&mut record, &cogging);
        assert!((record.force_n[0] - 0.7).abs() < 1e-12 && (record.force_n[1] - 1.3).abs() < 1e-12);
    }
}
