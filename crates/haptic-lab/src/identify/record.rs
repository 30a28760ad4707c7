//! A record of motion and force, and what makes one unusable.

use super::error::IdentifyError;

/// Fewest samples of a record.
const MIN_SAMPLES: usize = 64;

/// A record to identify from: samples of one clock, with the force that drives the moving mass.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// Times of the samples, s; they grow.
    pub t_s: Vec<f64>,
    /// Position, m.
    pub position_m: Vec<f64>,
    /// Velocity, m/s, where it was measured.
    pub velocity_mps: Option<Vec<f64>>,
    /// Force that drives the moving mass, N, positive along the position.
    pub force_n: Vec<f64>,
    /// Step of the position's encoder, m, where it is known; else it is estimated from the positions.
    pub resolution_m: Option<f64>,
}

impl Record {
    /// Checks lengths, times and values.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self) -> Result<(), IdentifyError> {
        let times = self.t_s.len();
        let columns = [
            ("t_s", Some(&self.t_s)),
            ("position_m", Some(&self.position_m)),
            ("force_N", Some(&self.force_n)),
            ("velocity_mps", self.velocity_mps.as_ref()),
        ];
        for (column, values) in columns {
            let Some(values) = values else { continue };
            if values.len() != times {
                return Err(IdentifyError::Length {
                    column,
                    times,
                    values: values.len(),
                });
            }
            if let Some((index, &value)) = values.iter().enumerate().find(|(_, value)| !value.is_finite()) {
                return Err(IdentifyError::NotFinite { column, index, value });
            }
        }
        if times < MIN_SAMPLES {
            return Err(IdentifyError::TooShort {
                samples: times,
                least: MIN_SAMPLES,
            });
        }
        match self.t_s.windows(2).position(|pair| pair[1] <= pair[0]) {
            Some(before) => Err(IdentifyError::TimeNotIncreasing {
                index: before + 1,
                t_s: self.t_s[before + 1],
                before_s: self.t_s[before],
            }),
            None => Ok(()),
        }
    }
}
