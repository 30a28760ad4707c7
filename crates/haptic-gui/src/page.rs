//! The pages of the panel.

use clap::ValueEnum;

/// A page: one task, drawn between the top bar and the timing of the loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Page {
    /// The scene, while a hand is on the rig.
    #[default]
    Tune,
    /// Recordings: made, listed and looked at.
    Record,
    /// From a record of force and motion to a scene.
    Identify,
}

impl Page {
    /// All of them, in the order of the row.
    pub const ALL: &[Self] = &[Self::Tune, Self::Record, Self::Identify];

    /// Name in the row.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tune => "Tune",
            Self::Record => "Record",
            Self::Identify => "Identify",
        }
    }

    /// What it is for.
    pub(crate) const fn hint(self) -> &'static str {
        match self {
            Self::Tune => "Change the scene and feel it",
            Self::Record => "Make recordings and look at them",
            Self::Identify => "Find the mass and friction of a real surface, and feel it",
        }
    }
}
