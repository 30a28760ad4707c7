//! The frame of every plot, and how a chart is drawn in it. The panel moves the plots together, so each
//! of them ignores the pointer, and their axes are aligned.

use super::axis::{count_for, grid, marks, number, steps};
use super::chart::{Chart, Curve, Overlay};
use super::labels::Labels;
use crate::plots::scope::value_axis::Reach;
use crate::theme::Palette;
use egui::{Align2, Color32, Rect, RichText, TextStyle, Ui, Vec2};
use egui_plot::{
    AxisHints, HLine, Line, LineStyle, Plot, PlotBounds, PlotPoint, PlotPoints, PlotUi, Points, Text, VLine,
};

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

/// Distance of the numbers of a vertical axis from the plot, and from its name, points.
const NUMBER_MARGIN: f32 = 4.0;

/// Height of the name of an axis, in heights of its text.
const NAME_HEIGHT: f32 = 1.25;

/// Width of the numbers of a vertical axis and of its name, points.
pub(crate) fn aside(ui: &Ui, up: Reach, inner: f32) -> f32 {
    let font = TextStyle::Body.resolve(ui.style());
    let (mut widest, mut height): (f32, f32) = (0.0, 0.0);
    for value in marks(up, count_for(inner)) {
        let text = ui
            .painter()
            .layout_no_wrap(number(value, up), font.clone(), Color32::WHITE);
        widest = widest.max(text.size().x);
        height = height.max(text.size().y);
    }
    (widest + 2.0 * NUMBER_MARGIN + NAME_HEIGHT * height).ceil()
}

/// A plot with `inner` points of its height for the lines, about `count` numbers at its horizontal axis, and at least
/// `aside` points of its width for those at its vertical axis.
pub(crate) fn plot<'a>(name: &str, height: f32, inner: f32, count: f64, aside: f32) -> Plot<'a> {
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
        .x_grid_spacer(move |input| grid(input.bounds, count))
        .y_grid_spacer(move |input| grid(input.bounds, count_for(inner)))
        .custom_x_axes(vec![numbers(AxisHints::new_x(), count)])
        .custom_y_axes(vec![numbers(AxisHints::new_y(), count_for(inner)).min_thickness(aside)])
}

/// Draws a chart: curves of overlays, traces, and the other overlays above them.
pub(crate) fn draw(plot: &mut PlotUi<'_>, chart: &Chart, palette: &Palette) {
    let ((left, right), (low, high)) = (chart.across, chart.up);
    plot.set_plot_bounds(PlotBounds::from_min_max([left, low], [right, high]));
    for overlay in &chart.overlays {
        if let Overlay::Curve(curve) = overlay {
            for part in lines(curve, palette) {
                plot.line(part);
            }
        }
    }
    for curve in &chart.curves {
        for part in lines(curve, palette) {
            // A band would have gaps where one column of pixels lies wholly above the next.
            plot.line(part.allow_band(false));
        }
    }
    let scale = Scale {
        area: plot.response().rect,
        corner: (left, high),
        span: (right - left, high - low),
    };
    let levels = chart.overlays.iter().filter_map(|overlay| match overlay {
        Overlay::Level { value, .. } => Some(scale.y(*value)),
        _ => None,
    });
    let mut labels = Labels::new(scale.area, levels.collect());
    for overlay in &chart.overlays {
        match overlay {
            Overlay::Curve(_) => {}
            Overlay::Level {
                value,
                label,
                is_inward,
                ink,
            } => {
                let line = HLine::new("", *value).color(ink.color(palette)).width(ink.width);
                plot.hline(line.style(LineStyle::dashed_loose()).allow_hover(false));
                if (low..=high).contains(value) {
                    let is_above = (*value >= 0.0) != *is_inward;
                    let place = |size| labels.at_level(scale.y(*value), is_above, size);
                    draw_label(plot, &scale, label, (ink.color)(palette), place);
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
                if (left..=right).contains(at) {
                    let place = |size| labels.at_mark(scale.x(*at), scale.x(0.0), size);
                    draw_label(plot, &scale, label, (ink.color)(palette), place);
                }
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

/// The parts of a curve between its breaks.
fn lines(curve: &Curve, palette: &Palette) -> impl Iterator<Item = Line<'static>> {
    let style = if curve.ink.is_dashed {
        LineStyle::dashed_dense()
    } else {
        LineStyle::Solid
    };
    let is_break = |point: &[f64; 2]| point.iter().any(|value| value.is_nan());
    let parts = curve.points.split(is_break).filter(|part| !part.is_empty());
    parts.map(move |part| {
        let line = Line::new(curve.name.clone(), PlotPoints::new(part.to_vec()));
        line.color(curve.ink.color(palette)).width(curve.ink.width).style(style)
    })
}

/// From values to points of the window. That of the plot itself is that of the frame before.
struct Scale {
    /// The inner part of the plot, points.
    area: Rect,
    /// The values at its upper left corner.
    corner: (f64, f64),
    span: (f64, f64),
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "points of a window, which are drawn as f32"
)]
impl Scale {
    fn x(&self, value: f64) -> f32 {
        self.area.left() + self.area.width() * ((value - self.corner.0) / self.span.0) as f32
    }

    fn y(&self, value: f64) -> f32 {
        self.area.top() + self.area.height() * ((self.corner.1 - value) / self.span.1) as f32
    }

    /// The values in the middle of a rectangle.
    fn middle(&self, rect: Rect) -> PlotPoint {
        let share = (rect.center() - self.area.min) / self.area.size();
        PlotPoint::new(
            self.corner.0 + self.span.0 * f64::from(share.x),
            self.corner.1 - self.span.1 * f64::from(share.y),
        )
    }
}

/// Draws a label where `place` finds room for its size.
fn draw_label(
    plot: &mut PlotUi<'_>,
    scale: &Scale,
    label: &str,
    color: Color32,
    place: impl FnOnce(Vec2) -> Option<Rect>,
) {
    if label.is_empty() {
        return;
    }
    let text = format!(" {label} ");
    let ctx = plot.ctx();
    let font = TextStyle::Small.resolve(&ctx.global_style());
    let size = ctx.fonts_mut(|fonts| fonts.layout_no_wrap(text.clone(), font, color).size());
    let Some(rect) = place(size) else { return };
    let text = Text::new("", scale.middle(rect), RichText::new(text).small());
    plot.text(text.color(color).anchor(Align2::CENTER_CENTER).allow_hover(false));
}

/// Points of scrolling by the wheel that zoom by a factor of e.
pub(crate) const POINTS_PER_ZOOM: f32 = 200.0;

/// Distance from a cursor at which a drag takes it along, points.
pub(super) const GRAB: f32 = 8.0;

/// The factor by which the wheel, or two fingers, zoom in now.
pub(super) fn zoom(ui: &Ui) -> Option<f64> {
    let (scroll, zoom) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
    let factor = zoom * (scroll / POINTS_PER_ZOOM).exp();
    ((factor - 1.0).abs() > f32::EPSILON).then(|| f64::from(factor))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plots::chart::Ink;
    use crate::tape::outline::BREAK;
    use egui_plot::{PlotGeometry, PlotItem};

    #[test]
    fn curve_with_a_break_is_drawn_in_two_lines() {
        let curve = Curve {
            name: "Force".into(),
            hint: "",
            points: vec![[0.0, 1.0], [1.0, 1.0], BREAK, [5.0, 1.0]],
            ink: Ink::solid(|palette| palette.law, 1.0),
        };
        let parts = lines(&curve, Palette::for_paper());
        let counts = parts.map(|line| match line.geometry() {
            PlotGeometry::Points(points) => points.len(),
            _ => 0,
        });
        assert_eq!(counts.collect::<Vec<_>>(), [2, 1]);
    }
}
