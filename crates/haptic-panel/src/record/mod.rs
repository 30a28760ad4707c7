//! Recordings: written on a thread of their own, listed, read and looked at. The page has what is made and listed at
//! the left, and what is looked at on the right.

mod controls;
#[cfg(test)]
#[path = "../../tests/fixture/metadata.rs"]
pub(crate) mod fixture;
mod folder_list;
mod folder_reader;
mod loaded;
mod opened;
mod recorder;
mod recordings;
mod what_if;

use crate::dialogs;
use crate::intent::{DialogPurpose, Intent};
use crate::model::Model;
use crate::plots;
use egui::{CentralPanel, Panel, Ui};

pub(crate) use controls::take_marker_key;
pub(crate) use folder_reader::list;
pub use folder_reader::{About, Length, Listed};
pub use loaded::Loaded;
pub(crate) use loaded::Opened;
pub use recorder::RecordingNews;
pub(crate) use recorder::{Recorder, amount};
pub(crate) use recordings::Recordings;
pub use what_if::WhatIfTape;

/// Width of the list, points.
const LIST_WIDTH: f32 = 340.0;

pub(super) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    Panel::left("recordings")
        .resizable(false)
        .exact_size(LIST_WIDTH)
        .show(ui, |ui| {
            ui.add_space(4.0);
            controls::show(ui, model, intents);
            ui.separator();
            folder_list::show(ui, model, intents);
        });
    CentralPanel::default_margins().show(ui, |ui| {
        opened::show(ui, model, intents);
        if model.view.scope(&model.tapes).has_samples(&model.tapes) {
            plots::show(ui, model, intents);
        } else {
            ui.heading("Nothing to look at yet");
            ui.label("Open a recording, choose one in the list at the left, or drop its file on the window.");
            let asked = (DialogPurpose::Recording, model.view.folder.as_str());
            dialogs::browse_button(ui, "Open...", "open a recording", asked, intents);
        }
    });
}
