//! The equation of motion under test functions, so that no acceleration is ever computed: see `smoothing`.
//!
//! ```text
//! M sum phi'' x + sum phi friction = sum phi (F - offset)       one phi every `stride` samples
//! ```

use super::path::Path;
use crate::smoothing::{Window, weighted};

/// Half of a test function, in strides: neighbours overlap so far that nothing of the record is lost between them.
const HALF_STRIDES: f64 = 2.08;

/// The test functions of a record.
#[derive(Clone, Debug)]
pub(crate) struct TestFunctions {
    window: Window,
    /// Half of their length, s.
    half_s: f64,
    /// The middle sample of each.
    pub(crate) middles: Vec<usize>,
}

impl TestFunctions {
    /// One every `stride` samples, but where samples are missing.
    pub(crate) fn new(path: &Path, stride: usize) -> Self {
        let half_s = HALF_STRIDES * stride as f64 * path.period_s;
        let window = Window::new(half_s, path.period_s);
        let reach = window.reach;
        let middles = (reach..path.force_n.len().saturating_sub(reach))
            .step_by(stride)
            .filter(|&middle| {
                path.is_recorded[middle - reach..=middle + reach]
                    .iter()
                    .all(|recorded| *recorded)
            })
            .collect();
        Self {
            window,
            half_s,
            middles,
        }
    }

    /// Their length, s.
    pub(crate) fn window_s(&self) -> f64 {
        2.0 * self.half_s
    }

    /// The samples that a test function reaches over.
    pub(crate) fn samples(&self, row: usize) -> std::ops::RangeInclusive<usize> {
        let (middle, reach) = (self.middles[row], self.window.reach);
        middle - reach..=middle + reach
    }

    /// `sum phi force` for each.
    pub(crate) fn of_force(&self, force_n: &[f64]) -> Vec<f64> {
        let middles = self.middles.iter();
        middles
            .map(|&middle| weighted(&self.window.mean, force_n, middle, 0.0))
            .collect()
    }

    /// `sum phi'' x` for each: the acceleration as it sees it.
    pub(crate) fn of_position(&self, position_m: &[f64]) -> Vec<f64> {
        let middles = self.middles.iter();
        middles
            .map(|&middle| weighted(&self.window.curvature, position_m, middle, position_m[middle]))
            .collect()
    }
}
