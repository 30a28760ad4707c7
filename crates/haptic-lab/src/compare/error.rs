//! Why two records cannot be compared, and which of the two it is.

use thiserror::Error;

/// Least agreement of the positions of one motion: their difference is a fifth of their extent. A rig
/// that replays a motion reaches 0.999.
pub(super) const MIN_AGREEMENT: f64 = 0.98;

/// Which of the two records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The record of the real surface.
    Real,
    /// The record of the rendered one.
    Rendered,
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Real => "real",
            Self::Rendered => "rendered",
        })
    }
}

/// Why two records cannot be compared: one is too short or holds no motion, or their motions differ.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{0}")]
pub struct CompareError(pub(super) String);
