//! Data and fits: force against velocity and position, over time, and what the fit leaves.

use super::Found;
use super::fit_chart::{Extent, FitChart, parts, thinned};
use crate::plots::axis::{AXIS_WIDTH, DEFAULT_COUNT};
use crate::plots::legend::Entry;
use crate::plots::{frame, legend};
use crate::theme::{FIT_OPACITY, Palette};
use egui::{Color32, Label, RichText, Ui, vec2};
use egui_plot::{Line, PlotPoints, PlotUi, Points};
use haptic_lab::drawing::{Form, Trace};

/// Side of the square in which one dot is drawn, points.
const DOT_CELL: f32 = 2.0;

const DOT_RADIUS: f32 = 1.0;
const LINE_WIDTH: f32 = 1.5;

/// Height of a plot's title and legend with the distances around them, points.
const TITLE_HEIGHT: f32 = 46.0;

/// Shows the charts, two in a row.
pub(super) fn show(ui: &mut Ui, found: &Found) {
    let rows = found.charts.len().div_ceil(2).max(1);
    let spacing = ui.spacing().item_spacing;
    #[expect(clippy::cast_precision_loss, reason = "two rows")]
    let height = ui.available_height() / rows as f32 - TITLE_HEIGHT;
    let width = (ui.available_width() - spacing.x) / 2.0;
    for row in found.charts.chunks(2) {
        ui.horizontal_top(|ui| {
            for chart in row {
                let size = vec2(width, height);
                ui.allocate_ui(size, |ui| {
                    ui.vertical(|ui| show_one(ui, chart, height.max(80.0)));
                });
            }
        });
    }
}

fn show_one(ui: &mut Ui, FitChart { chart, extent }: &FitChart, height: f32) {
    let palette = Palette::of(ui);
    ui.add(Label::new(RichText::new(&chart.title).small()).truncate()).on_hover_text(
        "The wheel zooms, dragging moves, a double click shows all of it. Of many samples in one place one is drawn.",
    );
    ui.horizontal(|ui| {
        let entry = |(place, trace): (usize, &Trace)| Entry {
            name: trace.name.clone(),
            hint: "",
            color: color(palette, place),
            width: LINE_WIDTH,
            is_dashed: false,
        };
        legend::show(ui, &chart.traces.iter().enumerate().map(entry).collect::<Vec<_>>());
        // Beside a low plot it would not fit.
        ui.add(Label::new(RichText::new(&chart.up.label).small().weak()).truncate());
    });
    let Extent { least, greatest } = *extent;
    let name = format!("{} of the fit", chart.title);
    let cells = [ui.available_width() - AXIS_WIDTH, height].map(|side| {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a window has few pixels"
        )]
        let cells = (side / DOT_CELL).max(1.0) as usize;
        cells
    });
    // Another result is seen whole.
    let id = format!("{name} {least:?} {greatest:?}");
    let plot = frame::plot(&id, height, height, DEFAULT_COUNT, AXIS_WIDTH)
        .width(ui.available_width() - frame::RIGHT_MARGIN)
        .x_axis_label(chart.across.label.as_str())
        .default_x_bounds(least[0], greatest[0])
        .default_y_bounds(least[1], greatest[1])
        .allow_drag(true)
        .allow_double_click_reset(true);
    let shown = plot.show(ui, |plot| {
        let response = plot.response().clone();
        if response.hovered() {
            let scroll = plot.ctx().input(|input| input.smooth_scroll_delta().y);
            if scroll != 0.0 {
                plot.zoom_bounds_around_hovered(egui::Vec2::splat((scroll / frame::POINTS_PER_ZOOM).exp()));
            }
        }
        let bounds = plot.plot_bounds();
        let seen = Extent {
            least: bounds.min(),
            greatest: bounds.max(),
        };
        for (place, trace) in chart.traces.iter().enumerate() {
            draw(plot, trace, seen, cells, color(palette, place));
        }
    });
    shown.response.accessible_name(name);
}

/// The measured samples have the colour of the device, the fit that of a law.
fn color(palette: &Palette, place: usize) -> Color32 {
    if place == 0 {
        palette.device
    } else {
        palette.law.gamma_multiply(FIT_OPACITY)
    }
}

fn draw(plot: &mut PlotUi<'_>, trace: &Trace, seen: Extent, cells: [usize; 2], color: Color32) {
    if trace.form == Form::Dots {
        let dots = thinned(trace.points.iter().copied(), seen, cells);
        let dots = Points::new(&trace.name, PlotPoints::new(dots));
        plot.points(dots.color(color).radius(DOT_RADIUS).allow_hover(false));
        return;
    }
    for part in parts(&trace.points) {
        let line = Line::new(&trace.name, PlotPoints::new(part.to_vec()));
        plot.line(line.color(color).width(LINE_WIDTH).allow_hover(false));
    }
}
