//! A study's totals beside those of the paper.

use super::comparison::{Comparison, Measure};
use super::paper::TIMES;
use haptic_lab::stats::exact::fisher;
use serde::Serialize;

/// A study's totals of time beside the paper's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BesidePaper {
    /// Name of the resistance.
    pub resistance: String,
    /// Better and worse in the paper.
    pub paper: [u64; 2],
    /// Better and worse in this study.
    pub study: [u64; 2],
    /// Fisher's exact test of the two rows. It takes all counts as independent, which those of one subject are not: it
    /// is smaller than the truth.
    pub fisher_p: f64,
}

/// The totals of those resistances that the paper has.
pub(super) fn beside(comparisons: &[Comparison]) -> Vec<BesidePaper> {
    let Some(times) = comparisons.iter().find(|one| one.measure == Measure::Time) else {
        return Vec::new();
    };
    let of = |(name, paper): (&str, [u64; 2])| {
        let place = times.resistances.iter().position(|resistance| resistance == name)?;
        let study = [times.totals[place].better, times.totals[place].worse];
        Some(BesidePaper {
            resistance: name.to_owned(),
            paper,
            study,
            fisher_p: fisher(paper, study),
        })
    };
    TIMES.into_iter().filter_map(of).collect()
}
