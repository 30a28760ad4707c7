//! The frame of every plot, and how a chart is drawn in it. The panel moves the plots together, so each
//! of them ignores the pointer, and their axes are aligned.

use super::axis::{AXIS_WIDTH, count_for, number, steps};
use super::chart::{Chart, Curve, Overlay};
use crate::theme::Palette;
use egui::{Align2, Color32, RichText};
use egui_plot::{
    AxisHints, HLine, Line, LineStyle, Plot, PlotBounds, PlotPoint, PlotPoints, PlotUi, Points, Text, VLine,
    uniform_grid_spacer,
};

/// Share of the height at which the label of a mark stands above the lower edge.
const LABEL_SHARE: f64 = 0.04;

/// Room at the right of a plot, points: half of the last number of its axis.
pub(crate) const RIGHT_MARGIN: f32 = 16.0;

/// Numbers at the major lines of the grid alone. The plot's own choice fades numbers that are close to one
/// another until they cannot be read.
fn numbers(axis: AxisHints<'_>, count: f64) -> AxisHints<'_> {
    let axis = axis.label_spacing(0.0..=f32::MIN_POSITIVE);
    axis.formatter(move |mark, reach| {
        let reach = (*reach.start(), *reach.end());
        let [finest, step, _] = steps(reach, count);
        // Half-way, so that rounding errors do not decide.
        if mark.step_size > (finest + step) / 2.0 {
            number(mark.value, reach)
        } else {
            String::new()
        }
    })
}

/// A plot with `inner` points of its height for the lines, and about `count` numbers at its horizontal
/// axis.
pub(crate) fn plot<'a>(name: &str, height: f32, inner: f32, count: f64) -> Plot<'a> {
    Plot::new(name)
        .height(height)
        // Filling it costs as much as a third of the lines where there is no graphics card.
        .show_background(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_axis_zoom_drag(false)
        .allow_double_click_reset(false)
        .x_grid_spacer(uniform_grid_spacer(move |grid| steps(grid.bounds, count)))
        .y_grid_spacer(uniform_grid_spacer(move |grid| steps(grid.bounds, count_for(inner))))
        .custom_x_axes(vec![numbers(AxisHints::new_x(), count)])
        .custom_y_axes(vec![
            numbers(AxisHints::new_y(), count_for(inner)).min_thickness(AXIS_WIDTH),
        ])
}

/// Draws a chart: curves of overlays, traces, and the other overlays above them.
pub(crate) fn draw(plot: &mut PlotUi<'_>, chart: &Chart, palette: &Palette) {
    let ((left, right), (low, high)) = (chart.across, chart.up);
    plot.set_plot_bounds(PlotBounds::from_min_max([left, low], [right, high]));
    for overlay in &chart.overlays {
        if let Overlay::Curve(curve) = overlay {
            plot.line(line(curve, palette));
        }
    }
    for curve in &chart.curves {
        // A band would have gaps where one column of pixels lies wholly above the next.
        plot.line(line(curve, palette).allow_band(false));
    }
    for overlay in &chart.overlays {
        match overlay {
            Overlay::Curve(_) => {}
            Overlay::Level { value, label, ink } => {
                let line = HLine::new("", *value).color(ink.color(palette)).width(ink.width);
                plot.hline(line.style(LineStyle::dashed_loose()).allow_hover(false));
                if (low..=high).contains(value) {
                    let end = PlotPoint::new(right, *value);
                    draw_label(plot, end, label, Align2::RIGHT_BOTTOM, ink.color(palette));
                }
            }
            Overlay::Mark {
                at,
                label,
                is_dashed,
                ink,
            } => {
                let style = if *is_dashed {
                    LineStyle::dashed_loose()
                } else {
                    LineStyle::Solid
                };
                let line = VLine::new("", *at).color(ink.color(palette)).width(ink.width);
                plot.vline(line.style(style).allow_hover(false));
                let foot = PlotPoint::new(*at, low + LABEL_SHARE * (high - low));
                // On the side away from zero: the band between two marks may be narrower.
                let side = if *at < 0.0 {
                    Align2::RIGHT_CENTER
                } else {
                    Align2::LEFT_CENTER
                };
                draw_label(plot, foot, label, side, ink.color(palette));
            }
            Overlay::Dots {
                name,
                at,
                radius,
                color,
            } => {
                let dots = Points::new(*name, PlotPoints::new(at.clone()));
                plot.points(dots.color(color(palette)).radius(*radius));
            }
        }
    }
}

fn line<'a>(curve: &Curve, palette: &Palette) -> Line<'a> {
    let line = Line::new(curve.name.clone(), PlotPoints::new(curve.points.clone()));
    line.color(curve.ink.color(palette)).width(curve.ink.width)
}

fn draw_label(plot: &mut PlotUi<'_>, at: PlotPoint, label: &str, side: Align2, color: Color32) {
    if label.is_empty() {
        return;
    }
    let text = Text::new("", at, RichText::new(format!(" {label} ")).small());
    plot.text(text.color(color).anchor(side).allow_hover(false));
}
