//! The page that changes the scene: parameters at the left, what the hand feels at the right.

use crate::intent::Intent;
use crate::model::Model;
use crate::{plots, readouts, scene, top_bar};
use egui::{CentralPanel, Panel, Ui};

pub(super) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    if model.is_connected() {
        let Model { daemon, view, .. } = &mut *model;
        Panel::left("scene")
            .resizable(false)
            .exact_size(scene::WIDTH)
            .show(ui, |ui| scene::show(ui, &daemon.scene, &mut view.tuning, intents));
    }
    CentralPanel::default_margins().show(ui, |ui| {
        let has_samples = model.view.scope.has_samples(&model.tapes);
        top_bar::explain_no_daemon(ui, &model.daemon, has_samples);
        if model.is_connected() || has_samples {
            readouts::show(ui, &model.daemon, &model.tapes);
            plots::show(ui, model, intents);
        }
    });
}
