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

/// Why two records cannot be compared.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// A record is too short.
    #[error("the {side} record holds {length_s:.2} s; at least {least_s} s are needed")]
    TooShort {
        /// Which one.
        side: Side,
        /// Its length, s.
        length_s: f64,
        /// Shortest that is taken, s.
        least_s: f64,
    },
    /// A record holds no motion.
    #[error(
        "the {side} record holds no motion: its positions span {span_um:.1} um, its encoder's step is {step_um:.1} um"
    )]
    NoMotion {
        /// Which one.
        side: Side,
        /// Extent of its positions, um.
        span_um: f64,
        /// Step of its encoder, um.
        step_um: f64,
    },
    /// Alignment by time was asked for, and the motions differ.
    #[error(
        "the motions are not the same: at the best shift, {shift_s:.3} s, they overlap for {overlap_s:.1} s and their \
         positions agree by {agreement:.3}, less than {MIN_AGREEMENT}; --align velocity compares force at the same \
         velocity"
    )]
    OtherMotion {
        /// The best shift, s.
        shift_s: f64,
        /// Time that both hold then, s.
        overlap_s: f64,
        /// Agreement of the positions.
        agreement: f64,
    },
    /// Alignment by time was asked for, and the motions do not determine the shift.
    #[error(
        "the motions do not determine the shift between the clocks: at any shift the positions agree equally well, as \
         those of one steady speed do. Record strokes of 0.5 to 3 Hz; --align velocity compares force at the same \
         velocity"
    )]
    AnyShift,
    /// There is no velocity at which both slide.
    #[error(
        "the records have no motion in common: the real one slides at {real} mm/s, the rendered one at {rendered} \
         mm/s; record the rendered surface under a motion like the real one's"
    )]
    NoCommonMotion {
        /// Velocities of the real record, mm/s.
        real: String,
        /// Velocities of the rendered record, mm/s.
        rendered: String,
    },
}
