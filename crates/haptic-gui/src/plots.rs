//! Forces and positions over the last seconds.

use crate::contact_ribbon;
use crate::history::{History, WINDOW_S};
use crate::readouts::MM_PER_M;
use crate::theme::Palette;
use egui::{Color32, RichText, Sense, TextStyle, Ui, Vec2b, vec2};
use egui_plot::{Legend, Line, Plot, PlotPoints, PlotResponse, uniform_grid_spacer};
use haptic_ipc::Sample;

/// Room for the numbers of the vertical axes, points: the same for both, so that the plots line up.
const AXIS_WIDTH: f32 = 64.0;

const TIME_LABEL_HEIGHT: f32 = 18.0;

const RIBBON_HEIGHT: f32 = 10.0;

/// Beyond this nothing is a force in N or a position in mm, and the axes' arithmetic runs out of digits.
const DRAWABLE: f64 = 1e9;

/// Shows the ribbon of contact and both plots in the space that is left.
pub(crate) fn show(ui: &mut Ui, history: &History) {
    show_ribbon_key(ui);
    let (strip, _) = ui.allocate_exact_size(vec2(ui.available_width(), RIBBON_HEIGHT), Sense::hover());
    // Only the lower plot names the time axis, which takes a line.
    let heights = ui.available_height() - ui.spacing().item_spacing.y;
    let height = (heights - TIME_LABEL_HEIGHT) / 2.0;
    let palette = Palette::of(ui);
    // The block's line is drawn first and wider: where both agree, it frames the device's instead of vanishing under it.
    let (block, device) = ((palette.block, 3.0), (palette.device, 1.4));
    let force = Graph {
        name: "Force plot",
        axis: "Force (N)",
        time: "",
        smallest_span: 2.0,
        height,
    };
    let forces = force.show(
        ui,
        [
            trace(history, "Coupling force", block, |sample| sample.coupling_force_n),
            trace(history, "Force on the hand", device, |sample| sample.command_force_n),
        ],
    );
    contact_ribbon::paint(ui, strip, &forces.transform, history);
    let position = Graph {
        name: "Position plot",
        axis: "Position (mm)",
        time: "Time from the newest sample (s)",
        smallest_span: 1.0,
        height: height + TIME_LABEL_HEIGHT,
    };
    position.show(
        ui,
        [
            trace(history, "Block", block, |sample| sample.block_position_m * MM_PER_M),
            trace(history, "Device", device, |sample| sample.device_position_m * MM_PER_M),
        ],
    );
}

fn show_ribbon_key(ui: &mut Ui) {
    let palette = Palette::of(ui);
    ui.horizontal(|ui| {
        ui.add_space(AXIS_WIDTH);
        for (color, text) in [(palette.stuck, "stuck"), (palette.sliding, "sliding")] {
            let (square, _) = ui.allocate_exact_size(vec2(10.0, 10.0), Sense::hover());
            ui.painter().rect_filled(square, 0, color);
            ui.label(RichText::new(text).small());
        }
    });
}

/// One line of a plot.
struct Trace {
    name: &'static str,
    color: Color32,
    width: f32,
    points: Vec<[f64; 2]>,
}

fn trace(history: &History, name: &'static str, (color, width): (Color32, f32), value: fn(&Sample) -> f64) -> Trace {
    let points = history
        .with_age()
        .map(|(age, sample)| [age, value(sample).clamp(-DRAWABLE, DRAWABLE)])
        .collect();
    Trace {
        name,
        color,
        width,
        points,
    }
}

/// A plot of traces over the last seconds.
struct Graph {
    name: &'static str,
    axis: &'static str,
    time: &'static str,
    /// The axis spans at least this much, so that the encoder's noise at rest does not fill the plot.
    smallest_span: f64,
    height: f32,
}

impl Graph {
    fn show(&self, ui: &mut Ui, traces: [Trace; 2]) -> PlotResponse<()> {
        let middle = middle(traces.iter().flat_map(|trace| &trace.points));
        let group = egui::Id::unique("time axis of the plots");
        let legend = Legend::default()
            .text_style(TextStyle::Small)
            .follow_insertion_order(true);
        let time_only = Vec2b::new(true, false);
        let plot = Plot::new(self.name)
            .height(self.height)
            .allow_scroll(false)
            .allow_boxed_zoom(false)
            .allow_zoom(time_only)
            .allow_drag(time_only)
            .allow_axis_zoom_drag(time_only)
            .link_axis(group, time_only)
            .link_cursor(group, time_only)
            .set_margin_fraction(vec2(0.0, 0.08))
            .include_x(-WINDOW_S)
            .include_x(0.0)
            .include_y(middle - self.smallest_span / 2.0)
            .include_y(middle + self.smallest_span / 2.0)
            .x_axis_label(self.time)
            .y_axis_label(self.axis)
            .y_grid_spacer(uniform_grid_spacer(|grid| steps(grid.bounds)))
            .y_axis_formatter(|mark, _| format!("{:.*}", decimals(mark.step_size), mark.value))
            .y_axis_min_width(AXIS_WIDTH)
            .legend(legend);
        let mut response = plot.show(ui, |plot| {
            for trace in traces {
                let points = PlotPoints::new(trace.points);
                plot.line(Line::new(trace.name, points).color(trace.color).width(trace.width));
            }
        });
        response.response = response.response.accessible_name(self.name);
        response
    }
}

/// Half-way between the extremes; zero without points.
fn middle<'a>(points: impl Iterator<Item = &'a [f64; 2]>) -> f64 {
    let (low, high) = points.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), [_, value]| {
        (low.min(*value), high.max(*value))
    });
    if low <= high { low.midpoint(high) } else { 0.0 }
}

/// Distances of the grid's lines: about four that carry a number, at 1, 2 or 5 times a power of ten.
///
/// The plot's own grid knows only powers of ten, which leaves most axes with the number 0 alone.
fn steps((low, high): (f64, f64)) -> [f64; 3] {
    let wanted = (high - low) / 4.0;
    if !(wanted.is_finite() && wanted > f64::MIN_POSITIVE) {
        return [1.0; 3];
    }
    let power = 10_f64.powf(wanted.log10().floor());
    let (major, parts) = match wanted / power {
        ..1.5 => (power, 5.0),
        ..3.5 => (2.0 * power, 4.0),
        ..7.5 => (5.0 * power, 5.0),
        _ => (10.0 * power, 5.0),
    };
    [major / parts, major, major * 10.0]
}

/// Decimals that numbers at this distance need.
fn decimals(step: f64) -> usize {
    // Rounding errors must not turn the 1 of a power of ten into 0.999.
    let decimals = (-step.log10() - 1e-6).ceil().clamp(0.0, 12.0);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to 0..=12"
    )]
    let decimals = decimals as usize;
    decimals
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_an_axis_are_round_and_enough() {
        for (bounds, major, digits) in [((-4.5, 4.5), 2.0, 0), ((0.0, 1.0), 0.2, 1), ((-23.0, 24.0), 10.0, 0)] {
            let [minor, step, _] = steps(bounds);
            assert!((step - major).abs() < 1e-9, "{bounds:?}: {step}");
            assert!(minor < step);
            assert_eq!(decimals(step), digits, "{bounds:?}");
        }
        assert_eq!(steps((f64::NEG_INFINITY, f64::INFINITY)), [1.0; 3]);
    }
}
