//! What all plots have in common: they lie still under the pointer, for the panel moves them together, and their axes line up.

use super::axis::{AXIS_WIDTH, count_for, number, steps};
use egui::TextStyle;
use egui_plot::{AxisHints, Corner, Legend, Plot, uniform_grid_spacer};

/// From this height on a plot has a legend, points: in a lower one it would hide the lines.
const LOWEST_WITH_LEGEND: f32 = 110.0;

/// Numbers at the lines that are meant to carry one, and at no others. The plot's own choice fades those that it finds too near to one another
/// until they cannot be read.
fn numbers(axis: AxisHints<'_>, count: f64) -> AxisHints<'_> {
    let axis = axis.label_spacing(0.0..=f32::MIN_POSITIVE);
    axis.formatter(move |mark, reach| {
        let reach = (*reach.start(), *reach.end());
        let [finest, step, _] = steps(reach, count);
        // Between the two, so that rounding errors do not decide.
        if mark.step_size > (finest + step) / 2.0 {
            number(mark.value, reach)
        } else {
            String::new()
        }
    })
}

/// A plot of which `inner` points of its height are left for the lines; its axis across has about `count` numbers.
pub(crate) fn plot<'a>(name: &str, height: f32, inner: f32, count: f64) -> Plot<'a> {
    let plot = Plot::new(name)
        .height(height)
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
        ]);
    if inner < LOWEST_WITH_LEGEND {
        return plot;
    }
    let legend = Legend::default()
        .position(Corner::LeftTop)
        .text_style(TextStyle::Small)
        .follow_insertion_order(true);
    plot.legend(legend)
}
