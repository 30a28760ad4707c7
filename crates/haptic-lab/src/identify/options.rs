//! What an identification is asked for, and what is known beforehand.
//!
//! Beside them the record of motion and force, how far an identification is, and why nothing can be identified at all.

use super::result::ModelKind;
use crate::motion::{between, places};
use std::ops::ControlFlow;
use thiserror::Error;

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The law, or the choice of one.
    pub model: ModelKind,
    /// The mass, kg, where it is known and not to be identified.
    pub mass_kg: Option<f64>,
    /// The constant force, N, where it is known: 0 for a zeroed sensor on a level axis, or for a force that
    /// was computed.
    pub offset_n: Option<f64>,
    /// Whether friction may differ by direction.
    pub directions: Directions,
    /// The clocks of positions and forces.
    pub clocks: Clocks,
    /// Seed of the bootstrap.
    pub seed: u64,
}

impl Options {
    /// Asks for `model`, with nothing known beforehand.
    #[must_use]
    pub const fn new(model: ModelKind) -> Self {
        Self {
            model,
            mass_kg: None,
            offset_n: None,
            directions: Directions::Auto,
            clocks: Clocks::OneFile,
            seed: 1,
        }
    }

    pub(super) fn check(&self) -> Result<(), IdentifyError> {
        let shift_s = match self.clocks {
            Clocks::Shifted(shift_s) => Some(shift_s),
            _ => None,
        };
        for (name, value, accepted, range) in [
            ("mass", self.mass_kg, 1e-6..=1e4, "1e-6 to 1e4 kg"),
            ("offset", self.offset_n, -1e4..=1e4, "-1e4 to 1e4 N"),
            ("shift", shift_s, -10.0..=10.0, "-10 to 10 s"),
        ] {
            if let Some(value) = value.filter(|value| !accepted.contains(value)) {
                let why = format!("{name} = {value} is out of range: {range}");
                return Err(IdentifyError::Unusable(why));
            }
        }
        Ok(())
    }
}

/// Whether friction may differ by direction.
///
/// Sliding alone determines `Fd+ + offset` and `Fd- - offset`: a constant force and friction that
/// differs by direction look the same. An assumption, or a known offset, separates them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Directions {
    /// Alike, unless the record shows otherwise.
    #[default]
    Auto,
    /// Friction is the same in both directions; the offset takes up the difference. Without effect where
    /// the offset is known.
    Alike,
    /// Friction has its own values in each direction; an unknown offset is refused.
    Separate,
}

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
        let unusable = |why| Err(IdentifyError::Unusable(why));
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
                let values = values.len();
                return unusable(format!("the record has {times} times and {values} values of {column}"));
            }
            if let Some((index, value)) = values.iter().enumerate().find(|(_, value)| !value.is_finite()) {
                return unusable(format!("sample {index}: {column} = {value} is not a finite number"));
            }
        }
        if times < MIN_SAMPLES {
            return unusable(format!(
                "the record has {times} samples; at least {MIN_SAMPLES} are needed"
            ));
        }
        match self.t_s.array_windows().position(|[before, t]| t <= before) {
            Some(before) => unusable(format!(
                "sample {}: its time {} s does not come after {} s",
                before + 1,
                self.t_s[before + 1],
                self.t_s[before]
            )),
            None => Ok(()),
        }
    }
}

/// Reports the share that is done, from 0 to 1, over a part of the whole.
pub(super) struct Progress<'a> {
    report: &'a mut dyn FnMut(f64) -> ControlFlow<()>,
    from: f64,
    to: f64,
}

impl<'a> Progress<'a> {
    /// Of the whole identification.
    pub(super) fn new(report: &'a mut dyn FnMut(f64) -> ControlFlow<()>) -> Self {
        Self {
            report,
            from: 0.0,
            to: 1.0,
        }
    }

    /// Reports a share of this part.
    ///
    /// # Errors
    /// The caller cancels.
    pub(super) fn at(&mut self, share: f64) -> Result<(), IdentifyError> {
        match (self.report)(self.from + share * (self.to - self.from)) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(IdentifyError::Cancelled),
        }
    }

    /// The part of this one between two shares.
    pub(super) fn part(&mut self, from: f64, to: f64) -> Progress<'_> {
        let length = self.to - self.from;
        Progress {
            from: self.from + from * length,
            to: self.from + to * length,
            report: &mut *self.report,
        }
    }
}

/// The clocks of positions and forces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Clocks {
    /// One clock, as it is known.
    One,
    /// One clock, as one file has it: the shift is 0, and a note says where another would fit better.
    #[default]
    OneFile,
    /// One clock, and perhaps a delay of one of the columns, as by a filter: a shift is looked for.
    Delayed,
    /// Two recorders: a shift and a drift are looked for.
    Two,
    /// One clock, and forces that are commands. A command acts up to this time later, s. The delay is fitted; where the
    /// record does not determine it, the intervals hold for no delay and for the longest. With 0 it is as `One`.
    Commanded(f64),
    /// A shift that is known: how much the force's stamps are later than the position's for the same instant, s.
    Shifted(f64),
}

impl Clocks {
    /// Longest shift that is looked for, s.
    pub(super) const fn longest_shift_s(self) -> f64 {
        match self {
            Self::One | Self::OneFile | Self::Commanded(_) | Self::Shifted(_) => 0.0,
            Self::Delayed => 0.06,
            Self::Two => 0.5,
        }
    }
}

/// The record with forces stamped by a clock that runs as fast as the position's, and agrees in the middle of the
/// record with the one that was faster by the drift, parts in a million.
pub(super) fn without_drift(record: &Record, drift_ppm: f64) -> Record {
    let (t, last) = (&record.t_s, record.t_s.len() - 1);
    let middle_s = f64::midpoint(t[0], t[last]);
    let there = t.iter().map(|t_s| t_s + 1e-6 * drift_ppm * (t_s - middle_s));
    Record {
        force_n: places(t, there).map(|place| between(&record.force_n, place)).collect(),
        ..record.clone()
    }
}

/// Why nothing can be identified at all.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// The record or an option is unusable: why, with the value.
    #[error("{0}")]
    Unusable(String),
    /// The caller cancelled.
    #[error("the identification was cancelled")]
    Cancelled,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_follow_one_another_and_a_caller_cancels() {
        let mut shares = Vec::new();
        let mut report = |share: f64| {
            shares.push(share);
            if share < 0.7 {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        };
        let mut whole = Progress::new(&mut report);
        let mut second = whole.part(0.5, 1.0);
        assert!(second.at(0.0).is_ok());
        assert!(matches!(second.part(0.0, 0.5).at(1.0), Err(IdentifyError::Cancelled)));
        assert_eq!(shares, [0.5, 0.75]);
    }

    #[test]
    fn a_drift_is_taken_out_about_the_middle() {
        let t_s: Vec<f64> = (0..=1000).map(|k| 7.0 + 1e-2 * f64::from(k)).collect();
        // The force is 100 N/s times the true time since the middle; its clock runs 1000 ppm fast.
        let record = Record {
            force_n: t_s.iter().map(|t| 100.0 * (t - 12.0) / 1.001).collect(),
            position_m: t_s.clone(),
            t_s,
            ..Record::default()
        };
        let steady = without_drift(&record, 1000.0);
        for k in 10..=990 {
            let error = steady.force_n[k] - 100.0 * (steady.t_s[k] - 12.0);
            assert!(error.abs() < 1e-9, "{k}: {error}");
        }
    }
}
