//! The live tuning panel of hapticd: parameters on the left, what the hand feels on the right, and a stop button that is
//! always there.
//!
//! The panel is a function: [`ui`] draws a [`Model`] and returns what the user asked for as [`Intent`]s. It knows no
//! window, socket or clock of its own, so the tests drive it without a display. [`connection`] keeps the daemon at the
//! other end of two channels; the binary ties both to a window:
//!
//! ```text
//! daemon -> Connection -> Update -> Model::apply -> ui -> Intent -> Connection -> daemon
//! ```
//!
//! The thread of the window waits for nothing: what reads or writes does so on a thread of its own, and [`App`] ties it all together.

mod app;
mod beat;
pub mod connection;
mod drop_down;
pub mod export;
mod files;
mod histogram;
mod intent;
mod model;
mod news;
mod notice;
mod plots;
mod readouts;
mod recording;
mod scene;
mod scope;
mod stop_button;
mod stop_path;
pub mod theme;
mod timing_panel;
mod top_bar;
mod update;

pub use app::App;
pub use files::Files;
pub use intent::{Format, Intent, Target};
pub use model::Model;
pub use recording::{Loaded, RecordingNews};
pub use stop_button::is_stop_key;
pub use update::{Answer, StopNews, Update};

use egui::{CentralPanel, Panel, Ui};
use std::time::Instant;

/// Draws the panel into the whole of `ui` and returns what the user asked for, a stop always first.
///
/// `now` is by the same clock as in [`Model::due`]: that of the interface stands still while the window is hidden.
///
/// Changes of parameters are held back so that each goes out at most 30 times a second; `ui` then asks
/// for the repaint in which the rest goes out, and otherwise for none.
#[must_use = "an intent that is not sent is a button without effect"]
pub fn ui(ui: &mut Ui, model: &mut Model, now: Instant) -> Vec<Intent> {
    let mut intents = Vec::new();
    if let Some(wait) = model.let_go(now) {
        ui.ctx().request_repaint_after(wait);
    }
    let had_keyboard = ui.memory(egui::Memory::focused);
    // Before any widget sees them: a text field would take the space, a focused button would be clicked by it.
    let mut stop = stop_button::take_keys(ui);
    Panel::top("top bar").show(ui, |ui| stop |= top_bar::show(ui, model, &mut intents));
    if stop {
        // Half-typed numbers must not become changes because the stop took the focus from their field.
        model.scene_mut().discard_typing();
        ui.memory_mut(egui::Memory::stop_text_input);
        // The key that stops is the one that closes a list everywhere else.
        egui::Popup::close_all(ui.ctx());
        model.stop_asked(now);
        // What becomes of it is said next, whether or not there is news.
        ui.ctx().request_repaint();
        intents.clear();
        intents.push(Intent::Stop);
    }
    scene::take_keys(ui, model.scene(), &mut intents);
    if model.is_connected() {
        Panel::bottom("timing").show(ui, |ui| timing_panel::show(ui, model));
        Panel::left("scene")
            .resizable(false)
            .exact_size(scene::WIDTH)
            .show(ui, |ui| scene::show(ui, model.scene_mut(), &mut intents));
    }
    CentralPanel::default_margins().show(ui, |ui| {
        if !model.is_connected() && !model.scope().is_of_recording() {
            top_bar::explain_no_daemon(ui, model);
        }
        if model.is_connected() || !model.scope().is_empty() {
            readouts::show(ui, model);
            plots::show(ui, model, &mut intents);
        } else {
            ui.add_space(12.0);
            ui.horizontal(|ui| plots::recordings::show(ui, model, &mut intents));
            plots::recordings::show_news(ui, model);
        }
    });
    keep_keyboard(ui, had_keyboard);
    model.scene_mut().asked(&intents);
    let (changes, wait) = model.due(now);
    intents.extend(changes);
    if let Some(wait) = wait {
        ui.ctx().request_repaint_after(wait);
    }
    intents
}

/// Enter ends the typing in a field. The keyboard stays there, for else the next Tab would begin at the top of the window.
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
