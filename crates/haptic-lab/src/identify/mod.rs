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
mod error;
mod grid;
mod karnopp;
mod options;
pub mod plan;
mod plot;
mod presliding;
pub mod record_file;
mod result;
pub mod rig_itself;
mod scene;
mod sensor;
pub mod study;
mod values;

pub use clocks::Clocks;
pub use error::IdentifyError;
pub use options::{Directions, Options, Record};
pub use plot::plots;
pub use result::{Identified, Interval, ModelKind, Refusal};
pub use scene::IdentifiedScene;
pub use values::{FoundValue, in_words};

use crate::two_clocks::Drift;
use clocks::without_drift;
use haptic_motion::median::median_period_s;
use options::Progress;
use std::ops::ControlFlow;

/// The record on an even grid and on one clock, and the force of the fit at each of its samples, N; NaN where the model
/// says nothing of it. Both forces are NaN in the record's gaps.
#[must_use]
pub fn fitted(record: &Record, found: &Identified) -> (Record, Vec<f64>) {
    let steady = found.clock_drift_ppm.map(|drift_ppm| without_drift(record, drift_ppm));
    let record = steady.as_ref().unwrap_or(record);
    let (mut even, mut force_n) = presliding::fitted(record, found).unwrap_or_else(|| karnopp::fitted(record, found));
    let mut after = 0;
    let longest_s = grid::GAP_PERIODS * median_period_s(even.t_s.iter().copied());
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
/// The record or an option is unusable. What a usable record cannot determine is not an error: it is in
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
        let mut found = identify_on_steady_clocks(record, options, progress)?;
        if options.clocks == Clocks::OneFile {
            found.notes.extend(other_shift(record, options, found.mass_kg));
        }
        return Ok(found);
    };
    let mut found = identify_on_steady_clocks(&without_drift(record, ppm), options, progress)?;
    found.clock_drift_ppm = Some(ppm);
    found.intervals.insert("clock_drift_ppm".to_owned(), interval);
    found.notes.push(format!(
        "the force's clock runs {ppm:.1} ppm faster than the position's, within [{:.1}, {:.1}] ppm: removed about \
         the middle of the record, where the shift is given",
        interval[0], interval[1]
    ));
    Ok(found)
}

/// What a shift of the clocks would change that fits better than none.
fn other_shift(record: &Record, options: &Options, mass_kg: Option<f64>) -> Option<String> {
    let shifted = karnopp::identify(
        record,
        &Options {
            clocks: Clocks::Delayed,
            model: ModelKind::Karnopp,
            ..options.clone()
        },
    );
    let [low, high] = *shifted.intervals.get("shift_s")?;
    let shift_s = Some(shifted.shift_s).filter(|shift_s| shift_s.abs() > high - low)?;
    let mass = match (mass_kg, shifted.mass_kg) {
        (Some(now), Some(then)) if options.mass_kg.is_none() => {
            format!(" (the mass would be {then:.4} kg for {now:.4})")
        }
        _ => String::new(),
    };
    Some(format!(
        "one file has one clock: no shift is taken. One of {:.2} ms, within [{:.2}, {:.2}] ms, would leave less{mass}; \
         where the force is filtered or comes late, --shift-ms auto fits it",
        1e3 * shift_s,
        1e3 * low,
        1e3 * high
    ))
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
