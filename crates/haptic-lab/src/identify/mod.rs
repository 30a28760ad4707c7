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
pub mod cogging;
mod grid;
mod karnopp;
mod options;
pub mod plan;
mod plot;
mod presliding;
pub mod record_file;
mod result;
pub mod rig_itself;
mod sensor;
pub mod study;

pub use options::{Clocks, Directions, IdentifyError, Options, Record};
pub(crate) use result::decimals;
pub use result::{FoundValue, Identified, IdentifiedScene, Interval, ModelKind, Refusal, in_words};

use grid::Even;
use options::{Progress, without_drift};
use presliding::Path;
use std::ops::ControlFlow;

/// What was found of a record, and the record as it was fitted, to be drawn.
#[derive(Debug)]
pub struct Identification {
    /// What was found.
    pub found: Identified,
    even: Even,
    left: Left,
}

/// What a fit leaves beside its values.
#[derive(Debug, Default)]
struct Left {
    /// The path along which a law that gives way was fitted.
    path: Option<Path>,
    /// The middle sample of each window, and the force under it that the fit does not explain, N. Their root mean
    /// square is [`Identified::residual_rms_n`]; none where nothing was fitted.
    residual: Vec<(usize, f64)>,
}

/// Identifies a record.
///
/// # Errors
/// The record or an option is unusable. What a usable record cannot determine is not an error: it is in
/// [`Identified::refused`].
pub fn identify(record: &Record, options: &Options) -> Result<Identified, IdentifyError> {
    identify_with_progress(record, options, &mut |_| ControlFlow::Continue(()))
        .map(|identification| identification.found)
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
) -> Result<Identification, IdentifyError> {
    record.check()?;
    options.check()?;
    let progress = &mut Progress::new(progress);
    let mut even = Even::new(record);
    let drift = match options.clocks {
        Clocks::Two => karnopp::clock_drift(&even, options),
        _ => None,
    };
    if let Some(drift) = &drift {
        even = Even::new(&without_drift(record, drift.ppm));
    }
    let (mut found, left) = identify_on_steady_clocks(&even, options, progress)?;
    if options.clocks == Clocks::OneFile {
        found.notes.extend(other_shift(&even, options, found.mass_kg));
    }
    if let Some(drift) = drift {
        found.clock_drift_ppm = Some(drift.ppm);
        found.intervals.insert("clock_drift_ppm".to_owned(), drift.interval);
        found.notes.push(format!(
            "beside the position's clock, the force's runs {drift}: removed about the middle of the record, where the \
             shift is given"
        ));
    }
    Ok(Identification { found, even, left })
}

/// What a shift of the clocks would change that fits better than none.
fn other_shift(even: &Even, options: &Options, mass_kg: Option<f64>) -> Option<String> {
    let (shift_s, [low, high], shifted_kg) = karnopp::best_shift(even, options)?;
    if shift_s.abs() <= high - low {
        return None;
    }
    let mass = match (mass_kg, shifted_kg) {
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
    even: &Even,
    options: &Options,
    progress: &mut Progress<'_>,
) -> Result<(Identified, Left), IdentifyError> {
    progress.at(0.0)?;
    match (options.model, options.clocks) {
        (ModelKind::Auto, clocks) => {
            // A delay would look like a surface that gives way.
            let aligned = Options {
                clocks: match clocks {
                    Clocks::Commanded(longest_delay_s) if longest_delay_s > 0.0 => Clocks::Delayed,
                    clocks => clocks,
                },
                ..options.clone()
            };
            let choice = choose::choose(even, &aligned, &mut progress.part(0.0, CHOICE_SHARE))?;
            let options = Options {
                model: choice.model,
                ..options.clone()
            };
            let (mut found, left) = identify_on_steady_clocks(even, &options, &mut progress.part(CHOICE_SHARE, 1.0))?;
            found.chosen_because = Some(choice.because);
            Ok((found, left))
        }
        (_, Clocks::Commanded(longest_delay_s)) if longest_delay_s > 0.0 => {
            identify_commanded(even, options, longest_delay_s, progress)
        }
        (ModelKind::Karnopp, _) => Ok(karnopp::identify(even, options)),
        (ModelKind::Dahl | ModelKind::Lugre, _) => presliding::identify(even, options, progress),
    }
}

/// Fits one law beside the delay of a force that was commanded. Where the record does not determine the delay, the
/// intervals hold those of no delay and of the longest, and what either refuses is refused.
fn identify_commanded(
    even: &Even,
    options: &Options,
    longest_delay_s: f64,
    progress: &mut Progress<'_>,
) -> Result<(Identified, Left), IdentifyError> {
    let mut with = |clocks, from, to| {
        let options = Options {
            clocks,
            ..options.clone()
        };
        identify_on_steady_clocks(even, &options, &mut progress.part(from, to))
    };
    // Only this fit has an interval of the delay.
    if options.model == ModelKind::Karnopp {
        let delayed = with(Clocks::Delayed, 0.0, 0.0)?;
        let found = &delayed.0;
        // The stamps of a force that acts later are too early.
        let is_delay = |[low_s, high_s]: &Interval| *high_s >= -longest_delay_s && *low_s <= 0.0;
        let has_mass = options.mass_kg.is_some() || found.mass_kg.is_some();
        if has_mass && found.intervals.get("shift_s").is_some_and(is_delay) {
            return Ok(delayed);
        }
    }
    let (mut at_once, left) = with(Clocks::One, 0.0, 0.5)?;
    let (late, _) = with(Clocks::Shifted(-longest_delay_s), 0.5, 1.0)?;
    for refusal in late.refused {
        at_once.refuse(refusal);
    }
    for (name, [least, most]) in &mut at_once.intervals {
        let Some([late_least, late_most]) = late.intervals.get(name) else {
            continue;
        };
        (*least, *most) = (least.min(*late_least), most.max(*late_most));
    }
    if !at_once.intervals.is_empty() {
        at_once.notes.push(format!(
            "the record does not determine by how much the force acts after its command: the intervals hold for 0 to \
             {:.1} ms",
            1e3 * longest_delay_s
        ));
    }
    Ok((at_once, left))
}
