//! The panel as a whole: it owns the keys, the top bar, Stop and the places of everything else.

use crate::intent::Intent;
use crate::model::Model;
use crate::{plots, readouts, scene, stop_button, timing_panel, top_bar};
use egui::{CentralPanel, Panel, Ui};
use std::time::Instant;

/// Draws the panel into the whole of `ui` and returns the user's intents, a stop always first.
///
/// `now` is of the same clock as in [`Model::due`]: the clock of the interface stands still while the window
/// is hidden. A parameter is sent at most 30 times a second; `ui` requests the frame in which the rest is
/// sent, and otherwise none.
#[must_use = "an intent that is not sent has no effect"]
pub fn ui(ui: &mut Ui, model: &mut Model, now: Instant) -> Vec<Intent> {
    let mut intents = Vec::new();
    if let Some(wait) = model.expire_messages(now) {
        ui.ctx().request_repaint_after(wait);
    }
    let had_keyboard = ui.memory(egui::Memory::focused);
    // Before any widget: a text field would take the space, and a focused button would be clicked by it.
    let mut stop = stop_button::take_keys(ui);
    Panel::top("top bar").show(ui, |ui| stop |= top_bar::show(ui, &model.daemon, &mut intents));
    if stop {
        // A half-typed number must not be set because the stop takes the focus from its field.
        model.view.tuning.discard_typing();
        ui.memory_mut(egui::Memory::stop_text_input);
        // Elsewhere Escape closes a list.
        egui::Popup::close_all(ui.ctx());
        model.daemon.stop.press(now, model.daemon.is_connected());
        // The next frame shows its outcome, with or without news.
        ui.ctx().request_repaint();
        intents.clear();
        intents.push(Intent::Stop);
    }
    scene::take_keys(ui, &model.daemon.scene, &model.view.tuning, &mut intents);
    if model.is_connected() {
        let Model { daemon, tapes, view } = &mut *model;
        Panel::bottom("timing").show(ui, |ui| {
            timing_panel::show(ui, daemon, tapes.clipping(), &mut view.histograms_shown);
        });
        Panel::left("scene")
            .resizable(false)
            .exact_size(scene::WIDTH)
            .show(ui, |ui| scene::show(ui, &daemon.scene, &mut view.tuning, &mut intents));
    }
    CentralPanel::default_margins().show(ui, |ui| {
        let has_samples = model.view.scope.has_samples(&model.tapes);
        if !model.is_connected() && model.tapes.opened().is_none() {
            top_bar::explain_no_daemon(ui, &model.daemon, has_samples);
        }
        if model.is_connected() || has_samples {
            readouts::show(ui, &model.daemon, &model.tapes);
            plots::show(ui, model, &mut intents);
        } else {
            ui.add_space(12.0);
            ui.horizontal(|ui| plots::recordings::show(ui, model, &mut intents));
            plots::recordings::show_news(ui, &model.tapes, &mut model.view.file_notice);
        }
    });
    keep_keyboard(ui, had_keyboard);
    model.view.tuning.note_sent(&intents);
    let (changes, wait) = model.due(now);
    intents.extend(changes);
    if let Some(wait) = wait {
        ui.ctx().request_repaint_after(wait);
    }
    intents
}

/// Enter ends the typing in a field. The focus stays there: otherwise the next Tab would begin at the top of
/// the window.
fn keep_keyboard(ui: &Ui, had_keyboard: Option<egui::Id>) {
    let is_entered = ui.input(|input| input.key_pressed(egui::Key::Enter));
    if let Some(field) = had_keyboard.filter(|_| is_entered) {
        ui.memory_mut(|memory| {
            if memory.focused().is_none() {
                memory.request_focus(field);
            }
        });
    }
}
