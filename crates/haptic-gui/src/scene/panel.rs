//! The scene: its law, its parameters with a slider and a field for each, the library, and who changed what.

use super::model::SceneModel;
use super::{advice_lines, journal, library, parameter_row, tools};
use crate::intent::Intent;
use crate::theme::Palette;
use egui::style::ScrollAnimation;
use egui::{Align, Id, Label, Layout, RichText, ScrollArea, TextStyle, Ui, vec2};
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
        ui.with_layout(Layout::top_down(Align::Min), |ui| show_list(ui, scene, intents));
    });
}

/// Shows all that scrolls. What is under the pointer stays there when something comes or goes above it.
fn show_list(ui: &mut Ui, scene: &mut SceneModel, intents: &mut Vec<Intent>) {
    let mut rows = Rows::new(ui);
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        // Room for the scroll bar, which would lie over the toggles.
        ui.set_max_width(ui.available_width() - 10.0);
        rows.begin(ui);
        show_parameters(ui, scene, &mut rows);
        rows.show(ui, "library", |ui| library::show(ui, scene, intents));
        rows.show(ui, "journal", |ui| journal::show(ui, scene));
        rows.end(ui);
    });
}

/// Where the rows of the list lie, and which of them is under the pointer.
struct Rows {
    /// Height of the pointer, while it is over the list.
    pointer: Option<f32>,
    /// Where the list begins, which may be scrolled out of sight.
    top: f32,
    /// The row that was under the pointer when the list was drawn last, and how far below the list's beginning it was.
    before: Option<(Id, f32)>,
    now: Option<(Id, f32)>,
    moved: f32,
}

impl Rows {
    fn new(ui: &Ui) -> Self {
        let list = ui.available_rect_before_wrap();
        let pointer = ui.input(|input| input.pointer.hover_pos());
        Self {
            pointer: pointer.filter(|pos| list.contains(*pos)).map(|pos| pos.y),
            top: 0.0,
            before: ui.data(|data| data.get_temp(Self::key())).flatten(),
            now: None,
            moved: 0.0,
        }
    }

    fn key() -> Id {
        Id::unique("row under the pointer")
    }

    fn begin(&mut self, ui: &Ui) {
        self.top = ui.cursor().top();
    }

    fn show(&mut self, ui: &mut Ui, name: &str, row: impl FnOnce(&mut Ui)) {
        let id = ui.scope_id().with(name);
        let rect = ui.push_id(name, row).response.rect;
        let below = rect.top() - self.top;
        if let Some((_, before)) = self.before.filter(|(before, _)| *before == id) {
            self.moved = below - before;
        }
        if self.pointer.is_some_and(|pointer| rect.y_range().contains(pointer)) {
            self.now = Some((id, below));
        }
    }

    /// Scrolls by as much as the row under the pointer was moved.
    fn end(self, ui: &Ui) {
        // The row that slid under the pointer instead is none that it was on.
        let keeps = self.moved != 0.0;
        let under = if keeps {
            self.before.map(|(id, below)| (id, below + self.moved))
        } else {
            self.now
        };
        ui.data_mut(|data| data.insert_temp(Self::key(), under));
        if keeps {
            ui.scroll_with_delta_animation(vec2(0.0, -self.moved), ScrollAnimation::none());
            ui.ctx().request_repaint();
        }
    }
}

fn show_parameters(ui: &mut Ui, scene: &mut SceneModel, rows: &mut Rows) {
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
        let name = parameter.about.name.clone();
        rows.show(ui, &name, |ui| parameter_row::show(ui, parameter, advised));
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
    let report = scene.report.as_ref().map(|report| match &report.told {
        Ok(done) => (done.as_str(), ui.visuals().text_color()),
        Err(why) => (why.as_str(), palette.error_text),
    });
    let trial = scene.trial.failure().map(|why| (why, palette.caution_text));
    let felt = scene
        .trial
        .is_felt()
        .then_some(("Trying: goes back by itself", palette.caution_text));
    // The room is there whether anything is said or not, so that the list above does not move when it is.
    let (text, color) = trial.or(felt).or(report).unwrap_or(("", palette.caution_text));
    let line = Label::new(RichText::new(text).small().color(color)).truncate();
    let height = ui.text_style_height(&TextStyle::Small);
    ui.allocate_ui_with_layout(vec2(ui.available_width(), height), Layout::top_down(Align::Min), |ui| {
        ui.set_min_height(height);
        if !text.is_empty() {
            ui.add(line).on_hover_text(text);
        }
    });
}
