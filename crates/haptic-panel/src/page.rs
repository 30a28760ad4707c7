//! The pages of the panel.

use crate::intent::Intent;
use crate::model::Model;
use crate::{identify, plots, record, study, tune};
use clap::ValueEnum;
use egui::Ui;
use haptic_studies::plan::Task;

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
    /// A study of targets, with a person.
    Task,
    /// A study of perception, with a person.
    Perception,
    /// Hand, block and force of a rig of two axes.
    Plane,
}

impl Page {
    /// All of them, in the order of the row.
    pub const ALL: &[Self] = &[
        Self::Tune,
        Self::Record,
        Self::Identify,
        Self::Task,
        Self::Perception,
        Self::Plane,
    ];

    /// Name in the row.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tune => "Tune",
            Self::Record => "Record",
            Self::Identify => "Identify",
            Self::Task => "Task",
            Self::Perception => "Perception",
            Self::Plane => "Plane",
        }
    }

    /// The page of a study.
    pub(crate) const fn of(task: Task) -> Self {
        match task {
            Task::Fitts => Self::Task,
            Task::Perception => Self::Perception,
        }
    }

    /// Whether studies are done there.
    pub(crate) const fn is_of_studies(self) -> bool {
        matches!(self, Self::Task | Self::Perception)
    }

    pub(crate) const fn hint(self) -> &'static str {
        match self {
            Self::Tune => "Change the scene and feel it",
            Self::Record => "Make recordings and look at them",
            Self::Identify => "Find the mass and friction of a real surface, and feel it",
            Self::Task => "Have a subject click on targets under several resistances",
            Self::Perception => "Have a subject tell surfaces apart",
            Self::Plane => "See hand, block and force of a rig of two axes",
        }
    }
}

/// Draws a page into the whole of `ui`. The shell has taken the keys that stop before.
pub(crate) fn show(page: Page, ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    match page {
        Page::Tune => tune::show(ui, model, intents),
        Page::Record => record::show(ui, model, intents),
        Page::Identify => identify::show(ui, model, intents),
        Page::Task => study::show(ui, model, Task::Fitts, intents),
        Page::Perception => study::show(ui, model, Task::Perception, intents),
        Page::Plane => plots::plane::show(ui, model, intents),
    }
}
