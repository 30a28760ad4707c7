//! A real surface against its rendering: how far the two forces are apart where the motion is the
//! same.
//!
//! Both records hold the force that drives the moving mass, positive along the position. Where the
//! motions are the same but for their clocks, they are laid over one another in time, and the forces
//! compared sample by sample. Where they differ, force is compared at the same velocity.

mod align;
mod clocks;
mod levels;
mod plot;
mod signal;

pub use levels::{Level, Levels};
pub use plot::{page, summary, table};

use crate::gaps;
use crate::identify::{Interval, Record};
use crate::stats::mean::rms;
use align::Alignment;
use clocks::AlignedRecords;
use haptic_motion::median::median_period_s;
use serde::Serialize;
use signal::Signal;
use std::collections::BTreeMap;
use std::fmt;
use thiserror::Error;

/// Least agreement of the positions of one motion: their difference is a fifth of their extent. A rig
/// that replays a motion reaches 0.999.
const MIN_AGREEMENT: f64 = 0.98;

/// Which of the two records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The record of the real surface.
    Real,
    /// The record of the rendered one.
    Rendered,
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Real => "real",
            Self::Rendered => "rendered",
        })
    }
}

/// Why two records cannot be compared: one is too short or holds no motion, or their motions differ.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{0}")]
pub struct CompareError(String);

/// How two records are laid over one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AlignedBy {
    /// By time: the motions are the same but for a shift.
    Time,
    /// By velocity: the motions differ.
    Velocity,
}

/// What is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// Moving mass, kg, whose inertia is taken out of what the plots show, and of the forces that are
    /// compared at the same velocity.
    pub mass_kg: Option<f64>,
    /// How they are aligned; by time where the motions are the same, else by velocity, where absent.
    pub align: Option<AlignedBy>,
}

/// How far the forces are apart. Differences are those of rendered less real.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// How the records are laid over one another.
    pub aligned_by: AlignedBy,
    /// How much the clock of the rendered record is ahead in the middle, s: its time less that of the real one.
    pub shift_s: Option<f64>,
    /// How much faster that clock runs, parts in a million, where it is certain that it does; it is taken out.
    pub clock_drift_ppm: Option<f64>,
    /// 95 % intervals of the shift and the drift, by their names.
    pub intervals: BTreeMap<String, Interval>,
    /// Position of the rendered record less that of the real one, m.
    pub position_offset_m: Option<f64>,
    /// Agreement of the positions at the best shift: 1 for the same motion.
    pub position_agreement: f64,
    /// Time that was compared, s; by velocity, that of the shorter record.
    pub overlap_s: f64,
    /// Mass whose inertia was taken out of what the plots show, and by velocity of the forces, kg.
    pub mass_kg: Option<f64>,
    /// Root mean square of the difference of the forces, N.
    #[serde(rename = "force_rms_difference_N")]
    pub force_rms_difference_n: f64,
    /// Largest difference of the forces, N.
    #[serde(rename = "force_peak_difference_N")]
    pub force_peak_difference_n: f64,
    /// Root mean square of the real force, N.
    #[serde(rename = "force_rms_N")]
    pub force_rms_n: f64,
    /// Force while sliding, without inertia.
    #[serde(rename = "sliding_force_N")]
    pub sliding_force_n: Levels,
    /// Force at which a slow pull sets off.
    #[serde(rename = "breakaway_force_N")]
    pub breakaway_force_n: Levels,
    /// Remarks for people.
    pub notes: Vec<String>,
    /// What the plots show.
    #[serde(skip)]
    pub curves: Curves,
}

/// What the plots show of a comparison.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curves {
    /// Velocity (m/s), position (m) and force less inertia (N) of the real record, by sample.
    pub real: Vec<[f64; 3]>,
    /// The same of the rendered record.
    pub rendered: Vec<[f64; 3]>,
    /// Difference of the forces: over time (s), or over velocity (m/s).
    pub difference: Vec<[f64; 2]>,
}

/// Compares the record of a rendered surface with that of the real one.
///
/// # Errors
/// A record is too short or holds no motion, or they have none in common.
pub fn compare(real: &Record, rendered: &Record, options: &Options) -> Result<Comparison, CompareError> {
    let period_s = median_period_s(real.t_s.iter().copied()).max(median_period_s(rendered.t_s.iter().copied()));
    let own = Signal::new(real, period_s, options.mass_kg, Side::Real)?;
    let aligned = AlignedRecords::new(&own, rendered, period_s, options.mass_kg)?;
    let AlignedRecords {
        second: other,
        alignment,
        ..
    } = &aligned;
    let is_same = alignment.agreement >= MIN_AGREEMENT;
    let is_by_time = is_same && !aligned.is_any_shift_alike;
    let aligned_by = options.align.unwrap_or(if is_by_time {
        AlignedBy::Time
    } else {
        AlignedBy::Velocity
    });
    let mut comparison = match aligned_by {
        AlignedBy::Time if !is_same => {
            let Alignment {
                shift_s,
                agreement,
                overlap_s,
                ..
            } = alignment;
            return Err(CompareError(format!(
                "the motions are not the same: at the best shift, {shift_s:.3} s, they overlap for {overlap_s:.1} s and \
                 their positions agree by {agreement:.3}, less than {MIN_AGREEMENT}; --align velocity compares force at \
                 the same velocity"
            )));
        }
        AlignedBy::Time if !is_by_time => {
            let why = "the motions do not determine the shift between the clocks: at any shift the positions agree equally \
                       well, as those of one steady speed do. Record strokes of 0.5 to 3 Hz; --align velocity compares \
                       force at the same velocity";
            return Err(CompareError(why.to_owned()));
        }
        AlignedBy::Time => by_time(&own, other, alignment),
        AlignedBy::Velocity => by_velocity(&own, other, alignment)?,
    };
    // What levels lack comes last.
    let lacking = std::mem::take(&mut comparison.notes);
    if aligned_by == AlignedBy::Time {
        note_clocks(&mut comparison, &aligned);
    }
    comparison.mass_kg = options.mass_kg;
    for (side, record) in [(Side::Real, real), (Side::Rendered, rendered)] {
        comparison.notes.extend(note_on_gaps(side, record));
    }
    if options.align.is_none() && !is_same {
        comparison.notes.push(format!(
            "the motions differ (their positions agree by {:.3} at best), so force is compared at the same velocity",
            alignment.agreement
        ));
    } else if options.align.is_none() && !is_by_time {
        comparison.notes.push(
            "the motions are steady, so that any shift between the clocks fits: force is compared at the same velocity"
                .to_owned(),
        );
    }
    let sliding = &comparison.sliding_force_n;
    for (name, level) in [("positive", &sliding.positive), ("negative", &sliding.negative)] {
        if level.is_none() {
            comparison.notes.push(format!(
                "no sliding level in {name} direction: both records have to slide that way for 50 ms or longer"
            ));
        }
    }
    comparison.notes.extend(lacking);
    Ok(comparison)
}

/// Stores the shift's interval and the clocks' drift in the result.
fn note_clocks(comparison: &mut Comparison, aligned: &AlignedRecords) {
    if let Some(shift) = aligned.shift {
        comparison.intervals.insert("shift_s".to_owned(), shift.interval());
    }
    let Some(drift) = aligned.drift else { return };
    comparison.clock_drift_ppm = Some(drift.ppm);
    comparison
        .intervals
        .insert("clock_drift_ppm".to_owned(), drift.interval);
    comparison.notes.push(format!(
        "beside the clock of the real record, the rendered one's runs {drift}: removed about the middle, where the \
         shift is given"
    ));
}

/// Says where samples are missing.
fn note_on_gaps(side: Side, record: &Record) -> Option<String> {
    let gaps = gaps::gaps(&record.t_s).count();
    (gaps > 0).then(|| format!("gaps in the {side} record: {gaps}, bridged for the alignment alone"))
}

fn by_time(real: &Signal, rendered: &Signal, alignment: &Alignment) -> Comparison {
    let (real, rendered) = alignment.common(real, rendered);
    let gaps = real.is_in_gap.iter().zip(&rendered.is_in_gap);
    let is_in_gap: Vec<bool> = gaps.map(|(own, other)| *own || *other).collect();
    let outside = || (0..real.len()).filter(|index| !is_in_gap[*index]);
    let differences: Vec<f64> = outside()
        .map(|index| rendered.force_n[index] - real.force_n[index])
        .collect();
    let limits = levels::SlidingLimits::of([&real, &rendered]);
    let sliding = levels::sliding_together(&real, &rendered, &limits);
    let (breakaway, notes) = levels::breakaway(&real, &rendered);
    Comparison {
        aligned_by: AlignedBy::Time,
        shift_s: Some(alignment.shift_s),
        clock_drift_ppm: None,
        intervals: BTreeMap::new(),
        position_offset_m: Some(alignment.position_offset_m),
        position_agreement: alignment.agreement,
        overlap_s: real.length_s(),
        mass_kg: None,
        force_rms_difference_n: rms(differences.iter().copied()),
        force_peak_difference_n: peak(&differences),
        force_rms_n: rms(outside().map(|index| real.force_n[index])),
        sliding_force_n: sliding,
        breakaway_force_n: breakaway,
        notes,
        curves: Curves {
            difference: outside()
                .map(|index| real.time_s(index))
                .zip(differences)
                .map(|(t, d)| [t, d])
                .collect(),
            real: real.course(&is_in_gap),
            rendered: rendered.course(&is_in_gap),
        },
    }
}

fn by_velocity(real: &Signal, rendered: &Signal, alignment: &Alignment) -> Result<Comparison, CompareError> {
    let limits = levels::SlidingLimits::of([real, rendered]);
    let curve = levels::by_velocity(real, rendered, &limits);
    if curve.is_empty() {
        let speeds = |signal: &Signal| {
            let (low, high) = signal.velocities();
            format!("{:.1} to {:.1}", low * 1e3, high * 1e3)
        };
        return Err(CompareError(format!(
            "the records have no motion in common: the real one slides at {} mm/s, the rendered one at {} mm/s; record \
             the rendered surface under a motion like the real one's",
            speeds(real),
            speeds(rendered)
        )));
    }
    let differences: Vec<f64> = curve.iter().map(|bin| bin.rendered_n - bin.real_n).collect();
    let (breakaway_force_n, notes) = levels::breakaway(real, rendered);
    Ok(Comparison {
        aligned_by: AlignedBy::Velocity,
        shift_s: None,
        clock_drift_ppm: None,
        intervals: BTreeMap::new(),
        position_offset_m: None,
        position_agreement: alignment.agreement,
        overlap_s: real.length_s().min(rendered.length_s()),
        mass_kg: None,
        force_rms_difference_n: rms(differences.iter().copied()),
        force_peak_difference_n: peak(&differences),
        force_rms_n: rms(real.outside_gaps(&real.force_n)),
        sliding_force_n: levels::sliding_at_common_speeds(&curve),
        breakaway_force_n,
        notes,
        curves: Curves {
            difference: curve
                .iter()
                .zip(differences)
                .map(|(bin, d)| [bin.velocity_mps, d])
                .collect(),
            real: real.course(&real.is_in_gap),
            rendered: rendered.course(&rendered.is_in_gap),
        },
    })
}

/// The value of the largest size, with its sign.
fn peak(values: &[f64]) -> f64 {
    values
        .iter()
        .copied()
        .max_by(|a, b| a.abs().total_cmp(&b.abs()))
        .unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
