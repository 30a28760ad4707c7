//! The tasks that there are.

use serde::{Deserialize, Serialize};

/// The task of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Task {
    /// Targets to be clicked.
    Fitts,
    /// Surfaces to distinguish.
    Perception,
}

impl Task {
    /// All tasks.
    pub const ALL: [Self; 2] = [Self::Fitts, Self::Perception];

    /// Its name, in plans and in names of files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fitts => "fitts",
            Self::Perception => "perception",
        }
    }

    /// The plan that every program has for it, as TOML.
    #[must_use]
    pub const fn built_in_plan(self) -> &'static str {
        match self {
            Self::Fitts => include_str!("../../../../studies/fitts.toml"),
            Self::Perception => include_str!("../../../../studies/perception.toml"),
        }
    }
}
