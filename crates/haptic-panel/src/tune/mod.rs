//! The page that changes the scene: parameters at the left, what the hand feels at the right.

mod advice_lines;
mod edit;
mod journal;
mod library;
mod panel;
mod parameter_row;
pub(crate) mod saving;
pub(crate) mod scene_edits;
mod tools;
mod trial;

use crate::daemon::{readouts, top_bar};
use crate::intent::Intent;
use crate::model::Model;
use crate::plots;
use egui::{CentralPanel, Panel, Ui};

pub(crate) use tools::take_keys;
pub(crate) use trial::TRIAL;

pub(crate) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    if model.daemon.was_connected {
        let Model { daemon, view, .. } = &mut *model;
        Panel::left("scene")
            .resizable(false)
            .exact_size(panel::WIDTH)
            .show(ui, |ui| {
                // The scene of a daemon that has gone, or hangs, is dimmed and keeps its place.
                ui.add_enabled_ui(daemon.takes_commands(), |ui| {
                    panel::show(ui, daemon, &mut view.tuning, intents);
                });
            });
    }
    CentralPanel::default_margins().show(ui, |ui| {
        if !model.daemon.was_connected {
            top_bar::explain_no_daemon(ui, &model.daemon, model.is_at_recording(), intents);
        }
        top_bar::offer_others(ui, &model.daemon, intents);
        if model.daemon.was_connected || model.view.scope.has_samples(&model.tapes) {
            readouts::show(ui, &model.daemon, &model.tapes);
            plots::show(ui, model, intents);
        }
    });
}
