//! The names of a plot's lines, in a row above it, where they hide no line.

use super::chart::Chart;
use crate::theme::Palette;
use egui::{Color32, Label, RichText, Role, Sense, Shape, Stroke, Ui, WidgetInfo, vec2};

/// Height of the row, points.
pub(crate) const HEIGHT: f32 = 18.0;

/// Size of the sample of a line, points.
const SWATCH: egui::Vec2 = vec2(16.0, 12.0);

/// Length of a dash of a dashed line's sample, points.
const DASH: f32 = 4.0;

/// A line of a plot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    pub(crate) name: String,
    /// What it is, for the hint; may be empty.
    pub(crate) hint: &'static str,
    pub(crate) color: Color32,
    /// Width of the line, points.
    pub(crate) width: f32,
    pub(crate) is_dashed: bool,
}

/// The lines of a chart that have names: those of its overlays, and its traces.
pub(crate) fn entries(chart: &Chart, palette: &Palette) -> Vec<Entry> {
    let lines = chart.curves.iter().chain(chart.under());
    let entry = |curve: &super::chart::Curve| Entry {
        name: curve.name.clone().into_owned(),
        hint: curve.hint,
        color: curve.ink.color(palette),
        width: curve.ink.width,
        is_dashed: curve.ink.is_dashed,
    };
    lines.filter(|curve| !curve.name.is_empty()).map(entry).collect()
}

/// Shows the names. One that does not fit into the row is shortened.
pub(crate) fn show(ui: &mut Ui, entries: &[Entry]) {
    ui.spacing_mut().item_spacing.x = 4.0;
    for entry in entries {
        let (line, _) = ui.allocate_exact_size(SWATCH, Sense::hover());
        let stroke = Stroke::new(entry.width, entry.color);
        if entry.is_dashed {
            let ends = [line.left_center(), line.right_center()];
            ui.painter().extend(Shape::dashed_line(&ends, stroke, DASH, DASH / 2.0));
        } else {
            ui.painter().hline(line.x_range(), line.center().y, stroke);
        }
        // Beside x the name of y is its letter: four full names would not fit.
        let text = if entry.is_dashed && entry.name.ends_with(", y") {
            "y"
        } else {
            &entry.name
        };
        let name = Label::new(RichText::new(text).small()).truncate();
        let name = ui.add(name);
        name.widget_info(|| WidgetInfo::labeled(Role::Label, true, &entry.name));
        if !entry.hint.is_empty() {
            name.on_hover_text(entry.hint);
        }
        ui.add_space(6.0);
    }
}
