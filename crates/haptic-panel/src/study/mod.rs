//! A study with a person: what the subject sees, what the experimenter sees, and the thread that runs it.
//!
//! The pages of both tasks are made of the same parts: what is chosen and done at the left, and on the right its
//! stage, the rig, and the trials.

mod conductor;
mod controls;
pub(crate) mod form;
mod latency;
mod link;
mod live;
mod news;
mod session_thread;
mod setup;
pub(crate) mod subject;
mod subject_screen;
mod table;
mod trials;

use crate::intent::Intent;
use crate::model::Model;
use egui::style::ScrollStyle;
use egui::{CentralPanel, Panel, ScrollArea, Ui};
use haptic_studies::plan::Task;

pub(crate) use link::StudyLink;
pub use news::{Stage, StudyCommand, StudyNews, StudyPlan, StudyRow, StudyState, SubjectState};
pub use subject_screen::SubjectAction;
#[cfg(test)]
pub(crate) use subject_screen::TaskScale;
pub(crate) use subject_screen::{SubjectFrame, SubjectScreen};

/// Width of the left side, points.
const LEFT_WIDTH: f32 = 340.0;

/// Least height of the table of trials, points: its heading and some rows.
const LOWEST_TABLE: f32 = 120.0;

/// The page of a task.
pub(super) fn show(ui: &mut Ui, model: &mut Model, task: Task, intents: &mut Vec<Intent>) {
    let open = model.view.study.state().map(|state| state.task);
    Panel::left("study")
        .resizable(false)
        .exact_size(LEFT_WIDTH)
        .show(ui, |ui| {
            ui.add_space(4.0);
            ui.spacing_mut().scroll = ScrollStyle::solid();
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                if open == Some(task) {
                    controls::show(ui, model, intents);
                } else {
                    setup::show(ui, model, task, intents);
                }
            });
        });
    CentralPanel::default_margins().show(ui, |ui| {
        if open != Some(task) {
            setup::explain(ui, &mut model.view.study, task, intents);
            return;
        }
        let Model { tapes, view, .. } = model;
        let Some(state) = view.study.state() else { return };
        controls::show_stage(ui, state);
        let height = (ui.available_height() * 0.55).min(ui.available_height() - LOWEST_TABLE);
        live::show(ui, tapes.live(), state, height.max(LOWEST_TABLE));
        ui.separator();
        trials::show(ui, state, &view.study.rows);
    });
}

pub(crate) fn subject_window_id() -> egui::ViewportId {
    egui::ViewportId::from_hash_of("subject's screen")
}

#[cfg(test)]
mod tests;
