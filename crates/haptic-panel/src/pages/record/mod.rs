//! The page of recordings: made and listed at the left, looked at on the right.

mod list;
mod making;
mod opened;

use crate::dialogs;
use crate::intent::{DialogPurpose, Intent};
use crate::model::Model;
use crate::plots;
use egui::{CentralPanel, Panel, Ui};

pub(crate) use making::take_marker_key;

/// Width of the list, points.
const LIST_WIDTH: f32 = 340.0;

pub(super) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    Panel::left("recordings")
        .resizable(false)
        .exact_size(LIST_WIDTH)
        .show(ui, |ui| {
            ui.add_space(4.0);
            making::show(ui, model, intents);
            ui.separator();
            list::show(ui, model, intents);
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
