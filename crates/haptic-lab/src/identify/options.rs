//! What an identification is asked for, and what is known beforehand.

use super::clocks::{Clocks, MAX_SHIFT_S};
use super::error::IdentifyError;
use super::result::ModelKind;

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
            && !(-MAX_SHIFT_S..=MAX_SHIFT_S).contains(&shift_s)
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
