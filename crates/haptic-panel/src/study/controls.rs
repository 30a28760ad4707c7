//! An open study: its subjects, its progress, the subject's screen, and notes.

use crate::drop_down::{self, Item, is_entered};
use crate::intent::Intent;
use crate::model::Model;
use crate::study::{Stage, StudyCommand, StudyState, SubjectScreen, SubjectState};
use crate::theme::Palette;
use crate::words::shortened;
use egui::{Button, Grid, Label, ProgressBar, RichText, TextEdit, Ui, Vec2, vec2};
use std::sync::Arc;

/// Size of the buttons that begin, continue and pause, for every name.
const BUTTON_SIZE: Vec2 = vec2(150.0, 36.0);

/// Width of the list of subjects, points.
const LIST_WIDTH: f32 = 220.0;

pub(super) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let study = &mut model.view.study;
    let Some(state) = study.state() else { return };
    let mut commands = Vec::new();
    show_study(ui, state, &mut commands);
    ui.separator();
    show_buttons(ui, state, &mut commands);
    ui.separator();
    show_screen(ui, &study.screen);
    ui.separator();
    Grid::new("now").num_columns(2).show(ui, |ui| {
        for (name, value) in &state.now {
            ui.label(RichText::new(*name).weak());
            ui.add(Label::new(value).wrap());
            ui.end_row();
        }
    });
    ui.separator();
    ui.horizontal(|ui| {
        let field = TextEdit::singleline(&mut study.note)
            .hint_text("A note")
            .desired_width(ui.available_width() - 64.0);
        let field = ui.add(field).accessible_name("note on the study");
        let text = study.note.trim().to_owned();
        let button = ui.add_enabled(!text.is_empty(), Button::new("Note"));
        if !text.is_empty() && (button.clicked() || is_entered(ui, &field)) {
            study.note.clear();
            commands.push(StudyCommand::Note(text));
        }
    });
    intents.extend(commands.into_iter().map(Intent::Study));
}

/// The study, and the list of its subjects.
fn show_study(ui: &mut Ui, state: &StudyState, commands: &mut Vec<StudyCommand>) {
    ui.add(Label::new(RichText::new(&state.plan).strong()).wrap());
    let folder = state.folder.display().to_string();
    shortened(ui, RichText::new(&folder).small().weak(), &folder);
    // Another subject, and another study, while nobody is at work.
    let is_free = matches!(state.stage, Stage::Held { .. } | Stage::Finished);
    ui.horizontal(|ui| {
        ui.add_enabled_ui(is_free, |ui| {
            let shown = state.subjects.get(state.subject).map_or_else(String::new, subject_line);
            let items = || {
                let subjects = state.subjects.iter().enumerate();
                let item = |(place, subject)| Item::new(place, subject_line(subject), &state.subject);
                subjects.map(item).collect()
            };
            let (chosen, _) = drop_down::show(ui, "subject", LIST_WIDTH, shown, items);
            commands.extend(chosen.map(StudyCommand::Choose));
            let close = ui.button("Close").on_hover_text("What is done is on the disk");
            if close.accessible_name("close the study").clicked() {
                commands.push(StudyCommand::Close);
            }
        });
    });
    if let Some(subject) = state.subjects.get(state.subject) {
        let (done, all) = subject.progress.unwrap_or_default();
        #[expect(clippy::cast_precision_loss, reason = "a share is drawn")]
        let share = done as f32 / all.unwrap_or(0).max(done).max(1) as f32;
        ui.add(ProgressBar::new(share).text(trials_done(subject)));
    }
}

fn subject_line(subject: &SubjectState) -> String {
    let done = if subject.is_finished { ", done" } else { "" };
    format!("Subject {}{done}", subject.code)
}

fn trials_done(subject: &SubjectState) -> String {
    let left = subject.time_left.as_ref();
    let left = left.map_or_else(String::new, |left| format!(", {left}"));
    match subject.progress {
        Some((done, Some(all))) => format!("{done} of {all} trials{left}"),
        Some((done, None)) => format!("{done} trials"),
        None => String::new(),
    }
}

fn show_buttons(ui: &mut Ui, state: &StudyState, commands: &mut Vec<StudyCommand>) {
    ui.horizontal(|ui| {
        let name = if state.has_begun() { "Go on" } else { "Begin" };
        let may_go_on = matches!(state.stage, Stage::Held { .. });
        let button = Button::new(RichText::new(name).size(16.0)).min_size(BUTTON_SIZE);
        let button = ui.add_enabled(may_go_on, button);
        if button.on_hover_text("The subject begins, or continues").clicked() {
            commands.push(StudyCommand::GoOn);
        }
        let may_pause = matches!(state.stage, Stage::Waiting { .. } | Stage::Running { .. });
        let button = Button::new(RichText::new("Pause").size(16.0)).min_size(BUTTON_SIZE);
        let button = ui.add_enabled(may_pause, button);
        let about =
            "The trial under way is done again. The force stays as it is: Release ramps it down, Stop takes it away";
        if button.on_hover_text(about).clicked() {
            commands.push(StudyCommand::Pause);
        }
    });
}

/// The subject's window, and how late its cursor is.
fn show_screen(ui: &mut Ui, screen: &Arc<SubjectScreen>) {
    ui.horizontal(|ui| {
        let mut is_open = screen.is_open();
        let about = "A window of its own, to be moved to the subject's display";
        if ui
            .checkbox(&mut is_open, "Subject's screen")
            .on_hover_text(about)
            .changed()
        {
            screen.set_open(is_open.then(|| ui.ctx().clone()));
        }
        let mut is_full = screen.is_full_screen();
        let full = ui.add_enabled(is_open, egui::Checkbox::new(&mut is_full, "Full screen"));
        if full.on_hover_text("F11 in that window").changed() {
            screen.set_full_screen(is_full);
        }
    });
    let text = match screen.latency_ms() {
        Some((median_ms, p95_ms, frames)) => {
            format!("Cursor latency: median {median_ms:.1} ms, 95 % below {p95_ms:.1} ms ({frames} frames)")
        }
        None => "Cursor latency: not measured yet".to_owned(),
    };
    let about = "From the sample on the device to the end of the frame that shows its position, as far as a program can \
                 know: the link's round trip, and the time until the next frame begins. The display adds its own.";
    ui.add(Label::new(RichText::new(text).small()).wrap())
        .on_hover_text(about);
}

/// The stage of the study, in a line above the plots.
pub(super) fn show_stage(ui: &mut Ui, state: &StudyState) {
    let palette = Palette::of(ui);
    let (text, color) = match &state.stage {
        Stage::Held { why, is_trouble: true } => (why.as_str(), palette.error_text),
        Stage::Held { why, .. } => (why.as_str(), ui.visuals().strong_text_color()),
        Stage::Waiting { what } => (what.as_str(), palette.caution_text),
        Stage::Running { what } => (what.as_str(), ui.visuals().strong_text_color()),
        Stage::Finished => ("This subject has done everything", ui.visuals().strong_text_color()),
    };
    ui.horizontal(|ui| {
        shortened(ui, RichText::new(text).size(18.0).color(color), text);
    });
}
