//! The scene: its law, its parameters with a slider and a field for each, the library, and who changed what.

use super::model::SceneModel;
use super::{advice_lines, journal, library, parameter_row, tools};
use crate::intent::Intent;
use crate::theme::Palette;
use egui::{Align, Label, Layout, RichText, ScrollArea, Ui};
use parameter_row::sentence_case;

/// Width of the panel, points.
pub(crate) const WIDTH: f32 = 372.0;

/// Shows the scene and takes what the user changes in it.
pub(crate) fn show(ui: &mut Ui, scene: &mut SceneModel, intents: &mut Vec<Intent>) {
    ui.add_space(4.0);
    tools::show(ui, scene, intents);
    ui.separator();
    ui.with_layout(Layout::bottom_up(Align::Min), |ui| {
        ui.add_space(4.0);
        show_reports(ui, scene);
        ui.separator();
        ui.with_layout(Layout::top_down(Align::Min), |ui| {
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                // Room for the scroll bar, which would lie over the toggles.
                ui.set_max_width(ui.available_width() - 10.0);
                show_parameters(ui, scene);
                library::show(ui, scene, intents);
                journal::show(ui, scene);
            });
        });
    });
}

fn show_parameters(ui: &mut Ui, scene: &mut SceneModel) {
    let SceneModel {
        parameters,
        advised,
        checks_are_open,
        ..
    } = scene;
    let mut group = String::new();
    for parameter in parameters {
        if parameter.about.group != group {
            group.clone_from(&parameter.about.group);
            ui.label(RichText::new(sentence_case(&group)).small().weak());
        }
        ui.push_id(parameter.about.name.clone(), |ui| {
            parameter_row::show(ui, parameter, advised);
        });
        ui.add_space(3.0);
    }
    advice_lines::show_all(ui, advised, checks_are_open);
}

/// What is in force, and what became of the last thing that concerned the whole scene. The lowest line comes first.
fn show_reports(ui: &mut Ui, scene: &SceneModel) {
    let palette = Palette::of(ui);
    let text = match (scene.revision, scene.tick) {
        (Some(revision), Some(tick)) => format!("Revision {revision}, applied at tick {tick}"),
        (Some(revision), None) => format!("Revision {revision}"),
        (None, _) => "No scene heard of yet".to_owned(),
    };
    ui.label(RichText::new(text).small().weak());
    let report = scene.report.as_ref().map(|report| match report {
        Ok(done) => (done.as_str(), ui.visuals().text_color()),
        Err(why) => (why.as_str(), palette.error_text),
    });
    let trial = scene.trial.failure().map(|why| (why, palette.caution_text));
    let felt = scene
        .trial
        .is_felt()
        .then_some(("Trying: goes back by itself", palette.caution_text));
    for (text, color) in [report, trial, felt].into_iter().flatten() {
        ui.add(Label::new(RichText::new(text).small().color(color)).wrap());
    }
}
