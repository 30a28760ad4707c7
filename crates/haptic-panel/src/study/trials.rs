//! The trials of the chosen subject, the newest first.

use crate::study::{StudyRow, StudyState};
use crate::theme::Palette;
use crate::words::cell;
use egui::style::ScrollStyle;
use egui::{Color32, Label, RichText, ScrollArea, TextStyle, Ui, vec2};

/// Most of the room beside the headings that a column gets, points.
const MAX_SPARE: f32 = 40.0;

pub(super) fn show(ui: &mut Ui, state: &StudyState, rows: &[StudyRow]) {
    let palette = Palette::of(ui);
    let widths = widths(ui, state.columns);
    let height = ui.text_style_height(&TextStyle::Small);
    ui.horizontal(|ui| {
        for (name, width) in state.columns.iter().zip(&widths) {
            cell(ui, vec2(*width, height), RichText::new(*name).small().weak());
        }
    });
    if rows.is_empty() {
        let none = if state.has_begun() {
            "No trial since the study was opened; its files have those before"
        } else {
            "No trial yet"
        };
        ui.label(RichText::new(none).small().weak());
    }
    ui.spacing_mut().scroll = ScrollStyle::solid();
    ScrollArea::vertical()
        .auto_shrink(false)
        .show_rows(ui, height, rows.len(), |ui, seen| {
            for row in seen.filter_map(|place| rows.len().checked_sub(place + 1).and_then(|place| rows.get(place))) {
                ui.horizontal(|ui| match &row.void {
                    Some(why) => {
                        let text = RichText::new(format!("void: {why}")).small().color(palette.error_text);
                        ui.add(Label::new(text).truncate()).on_hover_text(why);
                    }
                    None => {
                        for (text, width) in row.cells.iter().zip(&widths) {
                            cell(ui, vec2(*width, height), RichText::new(text).small());
                        }
                    }
                });
            }
        });
}

/// Widths of the columns, points: each has its heading whole, and a part of what is left.
fn widths(ui: &Ui, columns: &[&str]) -> Vec<f32> {
    let font = TextStyle::Small.resolve(ui.style());
    let width = |name: &&str| {
        let heading = ui
            .painter()
            .layout_no_wrap((*name).to_owned(), font.clone(), Color32::WHITE);
        heading.size().x.ceil() + 1.0
    };
    let headings: Vec<f32> = columns.iter().map(width).collect();
    #[expect(clippy::cast_precision_loss, reason = "a dozen columns")]
    let count = columns.len().max(1) as f32;
    let spare = (ui.available_width() - headings.iter().sum::<f32>()) / count - ui.spacing().item_spacing.x;
    let spare = spare.clamp(0.0, MAX_SPARE);
    headings.into_iter().map(|heading| heading + spare).collect()
}
