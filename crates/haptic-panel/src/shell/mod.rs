//! The panel as a whole: it owns the keys, the top bar, Stop, the messages and the connection, so that no page
//! can lose them. The page has what is left of the window.

mod close_question;
pub(crate) mod help;
mod note;
mod page_row;

use crate::daemon::{hand_strip, timing_panel, top_bar};
use crate::intent::Intent;
use crate::model::Model;
use crate::page::Page;
use crate::stop::button;
use crate::study::subject;
use crate::view::View;
use crate::{page, record, theme, tune};
use egui::{Panel, Ui, ViewportCommand};
use haptic_ipc::socket_path::label;
use std::time::Instant;

/// Draws the panel into the whole of `ui` and returns the user's intents, a stop always first.
///
/// `now` is of the same clock as in [`Model::due`]: the clock of the interface stands still while the window
/// is hidden. A parameter is sent at most 30 times a second; `ui` requests the frame in which the rest is
/// sent, and otherwise none.
#[must_use = "an intent that is not sent has no effect"]
pub fn ui(ui: &mut Ui, model: &mut Model, now: Instant) -> Vec<Intent> {
    let mut intents = Vec::new();
    show_title(ui, model);
    if let Some(wait) = model.expire_messages(now) {
        ui.ctx().request_repaint_after(wait);
    }
    let had_keyboard = ui.memory(egui::Memory::focused);
    // Before any widget: a focused button would be clicked by the space.
    let mut stop = button::take_keys(ui);
    let is_at_recording = model.is_at_recording();
    Panel::top("top bar").show(ui, |ui| {
        stop |= top_bar::show(ui, &model.daemon, is_at_recording, &mut intents);
    });
    if stop {
        // A half-typed number must not be set because the stop takes the focus from its field.
        model.press_stop(now);
        ui.memory_mut(egui::Memory::stop_text_input);
        // Elsewhere Escape closes a list.
        egui::Popup::close_all(ui.ctx());
        model.view.help_shown = false;
        // The next frame shows its outcome, with or without news.
        ui.ctx().request_repaint();
        intents.clear();
        intents.push(Intent::Stop);
    }
    page_row::take_keys(ui, model);
    if model.daemon.takes_commands() {
        tune::take_keys(ui, &model.daemon.mirror.scene, &model.view.tuning, &mut intents);
    }
    note::take_key(ui, model);
    record::take_marker_key(ui, model, &mut intents);
    help::take_keys(ui, &mut model.view.help_shown);
    note::show(ui, model, &mut intents);
    take_dropped_file(ui, &mut model.view, &mut intents);
    close_question::take_wish(ui, model);
    Panel::top("pages").show(ui, |ui| page_row::show(ui, model, &mut intents));
    let page_area = ui.available_rect_before_wrap();
    if model.daemon.is_rig_unknown() && !model.view.shows_recording(&model.tapes) {
        // What follows shows the rig as it was. It can still be used.
        ui.multiply_opacity(theme::STALE_OPACITY);
    }
    if model.daemon.was_connected {
        let Model { daemon, tapes, view } = &mut *model;
        Panel::bottom("timing").show(ui, |ui| {
            // The values of a daemon that has gone are dimmed and keep their place.
            ui.add_enabled_ui(daemon.is_connected(), |ui| {
                timing_panel::show(ui, daemon, tapes.clipping, &mut view.histograms_shown);
            });
        });
    }
    if model.daemon.takes_hand() {
        Panel::bottom("hand").show(ui, |ui| {
            ui.add_enabled_ui(model.daemon.takes_commands(), |ui| {
                hand_strip::show(ui, model, &mut intents);
            });
        });
    }
    page::show(model.view.page, ui, model, &mut intents);
    help::show(ui, page_area, &mut model.view.help_shown);
    subject::show(ui.ctx(), &model.view.study.screen);
    keep_keyboard(ui, had_keyboard);
    if model.daemon.silence().is_some() {
        // Whatever was open when the daemon fell silent.
        intents.retain(|intent| !intent.moves_rig());
    }
    model.view.tuning.note_sent(&intents);
    let (changes, wait) = model.due(now);
    intents.extend(changes);
    if let Some(wait) = wait {
        ui.ctx().request_repaint_after(wait);
    }
    intents
}

/// The title of the window names the rig first: two panels differ in it, also where it is cut.
fn show_title(ui: &Ui, model: &mut Model) {
    let path = model.daemon.link.path();
    let title = format!("{} - Haptic panel", label(path));
    if title != model.view.title && !path.as_os_str().is_empty() {
        ui.ctx().send_viewport_cmd(ViewportCommand::Title(title.clone()));
        model.view.title = title;
    }
}

/// A file that is dropped on the window is opened, or identified on that page.
fn take_dropped_file(ui: &Ui, view: &mut View, intents: &mut Vec<Intent>) {
    let dropped = ui.input(|input| input.raw.dropped_files.first().map(|file| file.path().to_path_buf()));
    match dropped {
        Some(path) if view.page == Page::Identify => view.fitting.choose_file(&path),
        dropped => intents.extend(dropped.map(|path| Intent::Open { path })),
    }
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
