//! What each page shows. The shell has taken the keys that stop before a page is drawn.

mod identify;
mod record;
mod study;
mod tune;

use crate::intent::Intent;
use crate::model::Model;
use crate::page::Page;
use egui::Ui;

pub(crate) use record::take_marker_key;

/// Draws a page into the whole of `ui`.
pub(crate) fn show(page: Page, ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let show = match page {
        Page::Tune => tune::show,
        Page::Record => record::show,
        Page::Identify => identify::show,
        Page::Task => study::show_task,
        Page::Perception => study::show_perception,
    };
    show(ui, model, intents);
}
