//! The scene: the list of scenes, its law, a slider and a field for each parameter, and the journal.

use super::scene_edits::Tuning;
use super::{advice_lines, journal, library, parameter_row, tools};
use crate::daemon::Daemon;
use crate::intent::Intent;
use crate::theme::Palette;
use crate::words::{in_two_lines, sentence_case};
use egui::style::{ScrollAnimation, ScrollStyle};
use egui::{Align, Button, Id, Layout, RichText, ScrollArea, TextStyle, Ui, vec2};

/// Width of the panel, points.
pub(crate) const WIDTH: f32 = 372.0;

/// Shows the scene, and takes the changes of the user.
pub(crate) fn show(ui: &mut Ui, daemon: &Daemon, tuning: &mut Tuning, intents: &mut Vec<Intent>) {
    ui.add_space(4.0);
    library::show_scenes(ui, &daemon.mirror, tuning, intents);
    tools::show(ui, &daemon.mirror, tuning, intents);
    advice_lines::show_all(ui, daemon, &mut tuning.checks_are_open);
    ui.separator();
    ui.with_layout(Layout::bottom_up(Align::Min), |ui| {
        ui.add_space(4.0);
        show_reports(ui, daemon, tuning, intents);
        ui.separator();
        ui.with_layout(Layout::top_down(Align::Min), |ui| {
            show_list(ui, daemon, tuning, intents);
        });
    });
}

/// Shows the list that scrolls. The row under the pointer stays there when the rows above it change.
fn show_list(ui: &mut Ui, daemon: &Daemon, tuning: &mut Tuning, intents: &mut Vec<Intent>) {
    let mut rows = RowPositions::new(ui);
    // A list that continues below shows that it does.
    ui.spacing_mut().scroll = ScrollStyle::solid();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        rows.begin(ui);
        show_parameters(ui, daemon, tuning, &mut rows);
        rows.show(ui, "library", |ui| library::show(ui, &daemon.mirror, tuning, intents));
        rows.show(ui, "journal", |ui| journal::show(ui, daemon));
        rows.end(ui);
    });
}

/// The positions of the rows, and the row under the pointer.
struct RowPositions {
    /// Vertical position of the pointer over the list, points.
    pointer: Option<f32>,
    /// Top of the list, which may be scrolled out of sight.
    top: f32,
    /// The row under the pointer in the last frame, and its distance from the top of the list.
    before: Option<(Id, f32)>,
    now: Option<(Id, f32)>,
    moved: f32,
}

impl RowPositions {
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

    /// Scrolls by as much as the row under the pointer has moved.
    fn end(self, ui: &Ui) {
        // Another row has moved under the pointer meanwhile.
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

fn show_parameters(ui: &mut Ui, daemon: &Daemon, tuning: &mut Tuning, rows: &mut RowPositions) {
    // A row is 40 points high, and the next one follows at once: its name is distance enough.
    let distance = std::mem::take(&mut ui.spacing_mut().item_spacing.y);
    let mut group = "";
    for about in &daemon.mirror.scene.parameters {
        let Some(edits) = tuning.parameter(&about.name) else {
            continue;
        };
        if about.group != group {
            group = &about.group;
            ui.add_space(distance);
            ui.label(RichText::new(sentence_case(group)).small().weak());
        }
        rows.show(ui, &about.name, |ui| {
            parameter_row::show(ui, about, edits, daemon);
        });
    }
    ui.spacing_mut().item_spacing.y = distance;
}

/// The revision, and the outcome of the last action on the whole scene. The lowest line comes first.
fn show_reports(ui: &mut Ui, daemon: &Daemon, tuning: &Tuning, intents: &mut Vec<Intent>) {
    let palette = Palette::of(ui);
    let text = match (daemon.mirror.scene.revision, daemon.mirror.scene.tick) {
        // No tick has applied the scene that the daemon began with.
        (Some(revision), None | Some(0)) => format!("Revision {revision}"),
        (Some(revision), Some(tick)) => format!("Revision {revision}, applied at tick {tick}"),
        (None, _) => "No scene yet".to_owned(),
    };
    ui.horizontal(|ui| {
        ui.label(RichText::new(text).small().weak());
        if let Some(change) = &daemon.would_chatter {
            let button = Button::new(RichText::new("Change anyway").small()).small();
            let hint = format!("Once, although the rig would chatter: {change}; keep a finger on Stop");
            if ui.add(button).on_hover_text(hint).clicked() {
                intents.push(Intent::Anyway(Box::new(change.clone())));
            }
        }
    });
    let report = tuning.report.as_ref().map(|report| match &report.outcome {
        Ok(done) => (done.as_str(), ui.visuals().text_color()),
        Err(why) => (why.as_str(), palette.error_text),
    });
    let trial = tuning.trial.failure.as_deref().map(|why| (why, palette.caution_text));
    let active = tuning
        .trial
        .is_active()
        .then_some(("Trying: goes back by itself", palette.caution_text));
    // It keeps its height without a text, so that the list above does not move.
    let (text, color) = trial.or(active).or(report).unwrap_or(("", palette.caution_text));
    let height = 2.0 * ui.text_style_height(&TextStyle::Small);
    ui.allocate_ui_with_layout(vec2(ui.available_width(), height), Layout::top_down(Align::Min), |ui| {
        ui.set_min_height(height);
        if !text.is_empty() {
            in_two_lines(ui, text, color);
        }
    });
}
