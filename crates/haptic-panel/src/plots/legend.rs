//! The names of a plot's lines, in a row above it, where they hide no line.

use super::chart::Chart;
use crate::theme::Palette;
use egui::{Color32, Label, RichText, Sense, Stroke, Ui, vec2};

/// Height of the row, points.
pub(crate) const HEIGHT: f32 = 18.0;

/// Size of the sample of a line, points.
const SWATCH: egui::Vec2 = vec2(16.0, 12.0);

/// A line of a plot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    pub(crate) name: String,
    /// What it is, for the hint; may be empty.
    pub(crate) hint: &'static str,
    pub(crate) color: Color32,
    /// Width of the line, points.
    pub(crate) width: f32,
}

/// The lines of a chart: those of its overlays, and its traces.
pub(crate) fn entries(chart: &Chart, palette: &Palette) -> Vec<Entry> {
    let lines = chart.curves.iter().chain(chart.under());
    let entry = |curve: &super::chart::Curve| Entry {
        name: curve.name.clone().into_owned(),
        hint: curve.hint,
        color: curve.ink.color(palette),
        width: curve.ink.width,
    };
    lines.map(entry).collect()
}

/// Shows the names. What does not fit into the row is cut off.
pub(crate) fn show(ui: &mut Ui, entries: &[Entry]) {
    ui.spacing_mut().item_spacing.x = 4.0;
    for entry in entries {
        let (line, _) = ui.allocate_exact_size(SWATCH, Sense::hover());
        let stroke = Stroke::new(entry.width, entry.color);
        ui.painter().hline(line.x_range(), line.center().y, stroke);
        let name = Label::new(RichText::new(&entry.name).small()).extend();
        let name = ui.add(name);
        if !entry.hint.is_empty() {
            name.on_hover_text(entry.hint);
        }
        ui.add_space(6.0);
    }
}
