//! The trials of the chosen subject, the newest first.

use crate::study::{StudyRow, StudyState};
use crate::theme::Palette;
use egui::style::ScrollStyle;
use egui::{Align, Label, Layout, RichText, ScrollArea, TextStyle, Ui, vec2};

/// Widest column, points.
const COLUMN: f32 = 96.0;

pub(super) fn show(ui: &mut Ui, state: &StudyState, rows: &[StudyRow]) {
    let palette = Palette::of(ui);
    #[expect(clippy::cast_precision_loss, reason = "a dozen columns")]
    let width =
        (ui.available_width() / (state.columns.len().max(1) as f32) - ui.spacing().item_spacing.x - 1.0).min(COLUMN);
    let height = ui.text_style_height(&TextStyle::Small);
    let cell = |ui: &mut Ui, text: RichText| {
        let layout = Layout::left_to_right(Align::Center);
        ui.allocate_ui_with_layout(vec2(width, height), layout, |ui| {
            ui.set_min_width(width);
            ui.add(Label::new(text.small()).truncate());
        });
    };
    ui.horizontal(|ui| {
        for name in state.columns {
            cell(ui, RichText::new(*name).weak());
        }
    });
    if rows.is_empty() {
        ui.label(RichText::new("No trial yet").small().weak());
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
                        for text in &row.cells {
                            cell(ui, RichText::new(text));
                        }
                    }
                });
            }
        });
}
