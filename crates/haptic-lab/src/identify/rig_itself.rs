//! The rig itself, from a record of its own motor's force and a sweep to and fro: cogging from the
//! sweep, and mass and friction from all of the record without it.

use super::cogging::{FoundCogging, SweepSample, cogging};
use super::identify;
use super::options::{Clocks, Directions, IdentifyError, Options, Record};
use super::result::{Identified, ModelKind, Refusal, at_least_zero};
use haptic_core::Directional;
use haptic_core::rig_friction::{Cogging, RigFriction, RigUncertainty};

/// What was found of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct RigItself {
    /// Mass and friction, and what was refused.
    pub identified: Identified,
    /// Cogging, where there is any.
    pub cogging: Option<FoundCogging>,
}

/// Measures a rig whose motor's force acts within `longest_delay_s`, s, of the command that the record has.
///
/// # Errors
/// The record is unusable.
pub fn measure(record: &Record, sweep: &[SweepSample], longest_delay_s: f64) -> Result<RigItself, IdentifyError> {
    let identified_beside = |record: &Record, found| identified_beside(record, found, longest_delay_s);
    let roughly = identified_beside(record, cogging(sweep, 0.0))?;
    // What the mass takes of the sweep is known only now.
    match roughly.identified.mass_kg {
        Some(mass_kg) if roughly.cogging.is_some() => identified_beside(record, cogging(sweep, mass_kg)),
        _ => Ok(roughly),
    }
}

/// Mass and friction beside cogging, or beside the reason why there is none.
fn identified_beside(
    record: &Record,
    found: Result<FoundCogging, String>,
    longest_delay_s: f64,
) -> Result<RigItself, IdentifyError> {
    let mut record = record.clone();
    if let Ok(found) = &found {
        without_cogging(&mut record, &found.cogging);
    }
    let options = Options {
        // The force is the motor's command: it has no zero to be off.
        offset_n: Some(0.0),
        directions: Directions::Separate,
        clocks: Clocks::Commanded(longest_delay_s),
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
            viscous: at_least_zero(viscous),
            cogging: self.cogging.as_ref().map(|found| found.cogging),
            uncertainty: self.uncertainty(),
        })
    }

    fn uncertainty(&self) -> Option<RigUncertainty> {
        let identified = &self.identified;
        let half = |name: &str| identified.intervals.get(name).map(|[low, high]| (high - low) / 2.0);
        let both = |name: &str| {
            Some(Directional {
                positive: half(&format!("{name}.positive"))?,
                negative: half(&format!("{name}.negative"))?,
            })
        };
        Some(RigUncertainty {
            mass: half("mass_kg")?,
            dynamic_force: both("dynamic_force_N")?,
            viscous: both("viscous_Ns_per_m")?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::Interval;
    use crate::identify::study::{Experiment, Sensors, Truth};
    use haptic_core::friction::{Friction, Karnopp};
    use haptic_core::rig_friction::{COGGING_HARMONICS, Harmonic};

    /// The intervals of a rig's mass and dynamic friction, from a chirp whose force acts so many samples of 1 ms after
    /// its command.
    fn intervals(mass_kg: f64, friction_n: f64, delay: usize, longest_delay_s: f64) -> [Interval; 2] {
        let experiment = Experiment {
            sensors: Sensors {
                force_noise_n: 0.005,
                ..Sensors::USUAL
            },
            ..Experiment::thorough(Truth {
                mass_kg,
                friction: Friction::Karnopp(Karnopp::new(1.1 * friction_n, friction_n)),
                offset_n: 0.0,
            })
        };
        let mut record = experiment.record(7 + delay as u64).expect("a valid scene");
        record.force_n.rotate_left(delay);
        let found = measure(&record, &[], longest_delay_s)
            .expect("a usable record")
            .identified;
        ["mass_kg", "dynamic_force_N.positive"].map(|name| found.intervals[name])
    }

    #[test]
    fn intervals_hold_whatever_the_delay_of_the_force() {
        for (mass_kg, friction_n) in [(0.05, 0.2), (0.5, 1.0)] {
            for delay in [0, 1, 3, 6, 10] {
                let found = intervals(mass_kg, friction_n, delay, 0.015);
                for (truth, [least, most]) in [mass_kg, friction_n].into_iter().zip(found) {
                    assert!(
                        least <= truth && truth <= most,
                        "{truth} by {delay} ms: {least} to {most}"
                    );
                }
            }
        }
    }

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
