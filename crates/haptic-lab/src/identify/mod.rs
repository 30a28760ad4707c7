//! From a record of motion and force to a scene: mass, friction and their honest intervals.
//!
//! ```text
//! M a + friction(v, deflection) + offset = F
//! ```
//!
//! `F` is the force that drives the moving mass, positive along the position. Friction is that of a
//! law of `haptic_core::friction`. What a record cannot determine is refused by name, with the reason
//! and what to record instead.

mod bootstrap;
mod choose;
mod clocks;
pub mod cogging;
mod grid;
mod karnopp;
pub mod plan;
mod plot;
mod presliding;
mod progress;
pub mod record_file;
mod result;
pub mod rig_itself;
mod scene;
mod sensor;
pub mod study;
mod values;

pub use clocks::Clocks;
pub use plot::plots;
pub use result::{Identified, Interval, ModelKind, Refusal};
pub use scene::IdentifiedScene;

use crate::median::usual_period_s;
use crate::two_clocks::Drift;
use clocks::{LARGEST_SHIFT_S, without_drift};
use progress::Progress;
use std::ops::ControlFlow;
use thiserror::Error;
pub use values::{FoundValue, in_words};

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
            clocks: Clocks::Delayed,
            seed: 1,
        }
    }

    fn check(&self) -> Result<(), IdentifyError> {
        if let Some(mass) = self.mass_kg.filter(|mass| !(1e-6..=1e4).contains(mass)) {
            return Err(IdentifyError::Option {
                name: "mass",
                value: mass,
                range: "1e-6 to 1e4 kg",
            });
        }
        if let Some(offset) = self.offset_n.filter(|offset| !(-1e4..=1e4).contains(offset)) {
            return Err(IdentifyError::Option {
                name: "offset",
                value: offset,
                range: "-1e4 to 1e4 N",
            });
        }
        if let Clocks::Shifted(shift_s) = self.clocks
            && !(-LARGEST_SHIFT_S..=LARGEST_SHIFT_S).contains(&shift_s)
        {
            return Err(IdentifyError::Option {
                name: "shift",
                value: shift_s,
                range: "-10 to 10 s",
            });
        }
        Ok(())
    }
}

/// Whether friction may differ by direction.
///
/// Sliding alone determines `Fd+ + offset` and `Fd- - offset`: a constant force and friction that
/// differs by direction look the same. An assumption, or a known offset, tells them apart.
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

/// Why nothing can be identified at all.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// A column has another length than the times.
    #[error("the record has {times} times and {values} values of {column}")]
    Length {
        /// The column.
        column: &'static str,
        /// Samples of the time.
        times: usize,
        /// Samples of the column.
        values: usize,
    },
    /// The record is too short for anything.
    #[error("the record has {samples} samples; at least {least} are needed")]
    TooShort {
        /// Samples.
        samples: usize,
        /// Fewest that are accepted.
        least: usize,
    },
    /// A value is not finite.
    #[error("sample {index}: {column} = {value} is not a finite number")]
    NotFinite {
        /// The column.
        column: &'static str,
        /// Index of the sample, from 0.
        index: usize,
        /// The value.
        value: f64,
    },
    /// Time does not grow.
    #[error("sample {index}: its time {t_s} s does not come after {before_s} s")]
    TimeNotIncreasing {
        /// Index of the sample, from 0.
        index: usize,
        /// Its time, s.
        t_s: f64,
        /// Time of the sample before, s.
        before_s: f64,
    },
    /// A value that was given as known cannot be.
    #[error("{name} = {value} is out of range: {range}")]
    Option {
        /// What was given.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is accepted.
        range: &'static str,
    },
    /// The caller cancelled.
    #[error("the identification was cancelled")]
    Cancelled,
}

/// Fewest samples of a record.
const FEWEST_SAMPLES: usize = 64;

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
        if times < FEWEST_SAMPLES {
            return Err(IdentifyError::TooShort {
                samples: times,
                least: FEWEST_SAMPLES,
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

/// The record on an even grid and on one clock, and the force of the fit at each of its samples, N; NaN where the model
/// says nothing of it. Both forces are NaN in the record's gaps.
#[must_use]
pub fn fitted(record: &Record, found: &Identified) -> (Record, Vec<f64>) {
    let steady = found.clock_drift_ppm.map(|drift_ppm| without_drift(record, drift_ppm));
    let record = steady.as_ref().unwrap_or(record);
    let (mut even, mut force_n) = presliding::fitted(record, found).unwrap_or_else(|| karnopp::fitted(record, found));
    let mut after = 0;
    let longest_s = grid::GAP_PERIODS * usual_period_s(even.t_s.iter().copied());
    for (at, t_s) in even.t_s.iter().enumerate() {
        while after + 1 < record.t_s.len() && record.t_s[after] < *t_s {
            after += 1;
        }
        if after > 0 && record.t_s[after] - record.t_s[after - 1] > longest_s {
            (even.force_n[at], force_n[at]) = (f64::NAN, f64::NAN);
        }
    }
    (even, force_n)
}

/// Identifies a record.
///
/// # Errors
/// The record or an option is unusable. What a usable record cannot determine is no error: it is in
/// [`Identified::refused`].
pub fn identify(record: &Record, options: &Options) -> Result<Identified, IdentifyError> {
    identify_with_progress(record, options, &mut |_| ControlFlow::Continue(()))
}

/// Identifies a record, and calls `progress` with the share that is done, from 0 to 1, several times a second. `Break`
/// cancels.
///
/// # Errors
/// As [`identify`], and [`IdentifyError::Cancelled`].
pub fn identify_with_progress(
    record: &Record,
    options: &Options,
    progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Identified, IdentifyError> {
    record.check()?;
    options.check()?;
    let progress = &mut Progress::new(progress);
    let drift = match options.clocks {
        Clocks::Two => karnopp::clock_drift(record, options),
        _ => None,
    };
    let Some(Drift { ppm, interval }) = drift else {
        return identify_on_steady_clocks(record, options, progress);
    };
    let mut found = identify_on_steady_clocks(&without_drift(record, ppm), options, progress)?;
    found.clock_drift_ppm = Some(ppm);
    found.intervals.insert("clock_drift_ppm".to_owned(), interval);
    found.notes.push(format!(
        "the force's clock runs {ppm:.1} ppm faster than the position's, within [{:.1}, {:.1}] ppm: taken out about \
         the middle of the record, of which the shift is told",
        interval[0], interval[1]
    ));
    Ok(found)
}

/// Share of the time of `auto` in which the model is chosen.
const CHOICE_SHARE: f64 = 0.4;

fn identify_on_steady_clocks(
    record: &Record,
    options: &Options,
    progress: &mut Progress<'_>,
) -> Result<Identified, IdentifyError> {
    progress.at(0.0)?;
    match options.model {
        ModelKind::Karnopp => Ok(karnopp::identify(record, options)),
        ModelKind::Dahl | ModelKind::Lugre => presliding::identify(record, options, progress),
        ModelKind::Auto => {
            let choice = choose::choose(record, options, &mut progress.part(0.0, CHOICE_SHARE))?;
            let options = Options {
                model: choice.model,
                ..options.clone()
            };
            Ok(Identified {
                chosen_because: Some(choice.because),
                ..identify_on_steady_clocks(record, &options, &mut progress.part(CHOICE_SHARE, 1.0))?
            })
        }
    }
}
