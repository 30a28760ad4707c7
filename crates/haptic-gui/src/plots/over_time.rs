//! Force, position and velocity over time, one below the other on one time axis, under the ribbon of contact.

use super::axis::{AXIS_WIDTH, USUAL_COUNT, reach};
use super::{contact_ribbon, frame};
use crate::scope::signal::{Quantity, Signal};
use crate::scope::trigger::Mode;
use crate::scope::value_axes::Reach;
use crate::scope::{Scope, While};
use crate::theme::Palette;
use egui::scroll_area::ScrollSource;
use egui::style::ScrollStyle;
use egui::{Color32, Pos2, Rect, RichText, ScrollArea, Sense, Ui, vec2};
use egui_plot::{HLine, Line, LineStyle, PlotBounds, PlotPoints, PlotResponse, VLine};

const TIME_LABEL_HEIGHT: f32 = 18.0;
const RIBBON_HEIGHT: f32 = 10.0;

/// Lower than this a plot has no room for the name of its axis.
const LOWEST_PLOT: f32 = 100.0;

/// So near to a cursor a drag takes it along, points.
const GRAB: f32 = 8.0;

/// Points of the wheel's scrolling that zoom by a factor of e.
const POINTS_PER_ZOOM: f32 = 200.0;

/// One line of a plot.
#[derive(Clone, Debug)]
pub(crate) struct Trace {
    pub(crate) signal: Signal,
    /// Time from the zero of the axis, s, and the value in the unit of its quantity.
    pub(crate) points: Vec<[f64; 2]>,
}

/// The lines of a quantity as `columns` pixels can show them.
pub(crate) fn traces(scope: &Scope, quantity: Quantity, seen: &While, columns: f64) -> [Trace; 2] {
    let signals = quantity.signals();
    let ends = (seen.from_s, seen.to_s);
    let [first, second] = scope.tape().outlines(signals, ends, seen.column_s(columns));
    let trace = |signal, mut points: Vec<[f64; 2]>| {
        for [t_s, _] in &mut points {
            *t_s -= seen.zero_s;
        }
        Trace { signal, points }
    };
    [trace(signals[0], first), trace(signals[1], second)]
}

/// How far the axis of a quantity reaches that has these lines.
pub(crate) fn value_reach(scope: &Scope, quantity: Quantity, traces: &[Trace; 2]) -> Reach {
    let values = || {
        let points = traces.iter().flat_map(|trace| &trace.points);
        points.map(|[_, value]| *value)
    };
    let held = scope.value_axes.held(quantity);
    held.unwrap_or_else(|| reach(values(), quantity.smallest_span()))
}

/// What the time axis counts from.
pub(crate) fn time_label(scope: &Scope) -> &'static str {
    match (scope.follows(), scope.trigger.mode()) {
        (true, Mode::Off) => "Time from the newest sample (s)",
        (true, _) => "Time from the trigger (s)",
        (false, _) => "Time (s)",
    }
}

/// Colour and width: the block's line is wider and drawn first; where both agree, it frames the device's instead of vanishing under it.
pub(crate) fn stroke(palette: &Palette, signal: Signal) -> (Color32, f32) {
    if signal.is_of_block() {
        (palette.block, 3.0)
    } else {
        (palette.device, 1.4)
    }
}

/// Shows the ribbon and the plots in `height` points.
pub(crate) fn show(ui: &mut Ui, scope: &mut Scope, height: f32) {
    let top = ui.cursor().top();
    show_key(ui);
    let (strip, _) = ui.allocate_exact_size(vec2(ui.available_width(), RIBBON_HEIGHT), Sense::hover());
    let quantities: Vec<Quantity> = scope.quantities().collect();
    let Some(lowest) = quantities.len().checked_sub(1) else {
        ui.label("Choose what to plot above");
        return;
    };
    let spacing = ui.spacing().item_spacing.y;
    let left = height - (ui.cursor().top() - top) - TIME_LABEL_HEIGHT;
    #[expect(clippy::cast_precision_loss, reason = "three plots at most")]
    let count = quantities.len() as f32;
    let height = (left / count - spacing).max(LOWEST_PLOT);
    let painter = ui.painter().clone();
    let show_all = |ui: &mut Ui| {
        for (place, quantity) in quantities.into_iter().enumerate() {
            let has_time = place == lowest;
            let height = if has_time { height + TIME_LABEL_HEIGHT } else { height };
            let shown = show_one(ui, scope, quantity, height, has_time);
            if place == 0 {
                contact_ribbon::paint(ui, &painter, strip, &shown.transform, scope);
            }
            take_pointer(ui, scope, &shown);
            take_axis_pointer(ui, scope, quantity, &shown);
        }
    };
    if count * (height + spacing) <= left + 1.0 {
        show_all(ui);
        return;
    }
    // Where there is no room for all of them they are scrolled by the bar alone, which is always seen: the wheel zooms.
    ui.spacing_mut().scroll = ScrollStyle::solid();
    ScrollArea::vertical()
        .scroll_source(ScrollSource::SCROLL_BAR)
        .auto_shrink(false)
        .show(ui, show_all);
}

fn show_key(ui: &mut Ui) {
    let palette = Palette::of(ui);
    let key = [
        (palette.stuck, "stuck"),
        (palette.sliding, "sliding"),
        (palette.block, "block and coupling"),
        (palette.device, "device and hand"),
    ];
    ui.horizontal_wrapped(|ui| {
        ui.add_space(AXIS_WIDTH);
        for (color, text) in key {
            let (square, _) = ui.allocate_exact_size(vec2(10.0, 10.0), Sense::hover());
            ui.painter().rect_filled(square, 0, color);
            ui.label(RichText::new(text).small());
        }
    });
}

fn show_one(ui: &mut Ui, scope: &mut Scope, quantity: Quantity, height: f32, has_time: bool) -> PlotResponse<()> {
    let palette = Palette::of(ui);
    let inner = if has_time { height - TIME_LABEL_HEIGHT } else { height };
    let seen = scope.seen();
    let columns = f64::from((ui.available_width() - AXIS_WIDTH).max(1.0) * ui.pixels_per_point());
    let traces = traces(scope, quantity, &seen, columns);
    let (low, high) = value_reach(scope, quantity, &traces);
    scope.value_axes.saw(quantity, (low, high));
    let (left, right) = (seen.from_s - seen.zero_s, seen.to_s - seen.zero_s);
    let name = format!("{} plot", quantity.name());
    let cursor_group = egui::Id::unique("time of the plots");
    let plot = frame::plot(&name, height, inner, USUAL_COUNT)
        .link_cursor(cursor_group, [true, false])
        .x_axis_label(if has_time { time_label(scope) } else { "" })
        .y_axis_label(format!("{} ({})", quantity.name(), quantity.unit()))
        .sense(Sense::drag());
    let mut response = plot.show(ui, |plot| {
        plot.set_plot_bounds(PlotBounds::from_min_max([left, low], [right, high]));
        for trace in traces {
            let (color, width) = stroke(palette, trace.signal);
            let line = Line::new(trace.signal.name(), PlotPoints::new(trace.points));
            // A band would have gaps where one column of pixels lies wholly above the next.
            plot.line(line.color(color).width(width).allow_band(false));
        }
        if scope.trigger.mode() != Mode::Off {
            let marks = LineStyle::dashed_loose();
            if scope.trigger.signal.quantity() == quantity {
                plot.hline(
                    HLine::new("", scope.trigger.level)
                        .color(palette.mark)
                        .style(marks)
                        .allow_hover(false),
                );
            }
            plot.vline(VLine::new("", 0.0).color(palette.mark).style(marks).allow_hover(false));
        }
        if scope.cursors.shown {
            for at_s in scope.cursors.at_s {
                plot.vline(VLine::new("", at_s).color(palette.cursor).width(1.5).allow_hover(false));
            }
        }
    });
    response.response = response.response.accessible_name(name);
    response
}

/// Moves and zooms by pointer: the wheel zooms in time around it, a drag moves in time, or takes along the cursor that it began on.
fn take_pointer(ui: &Ui, scope: &mut Scope, shown: &PlotResponse<()>) {
    let (response, transform) = (&shown.response, &shown.transform);
    let time_at = |pos: Pos2| transform.value_from_position(pos).x;
    if let Some(pos) = response.hover_pos() {
        if let Some(factor) = zoom(ui) {
            scope.zoom(factor, time_at(pos));
        }
        let sideways = ui.input(|input| input.smooth_scroll_delta().x);
        if sideways != 0.0 {
            scope.shift(-f64::from(sideways) / transform.dpos_dvalue_x());
        }
    }
    let grabbed = response.id.with("grabbed cursor");
    if response.drag_started() {
        let origin = ui.input(|input| input.pointer.press_origin());
        let near = origin.filter(|_| scope.cursors.shown).and_then(|pos| {
            let nearest = scope.cursors.nearest(time_at(pos));
            let line = transform.position_from_point_x(scope.cursors.at_s[nearest]);
            ((line - pos.x).abs() <= GRAB).then_some(nearest)
        });
        ui.data_mut(|data| data.insert_temp(grabbed, near));
    }
    if response.dragged() {
        let by_s = f64::from(response.drag_delta().x) / transform.dpos_dvalue_x();
        match ui.data(|data| data.get_temp::<Option<usize>>(grabbed)).flatten() {
            Some(cursor) => scope.cursors.at_s[cursor] += by_s,
            None if by_s != 0.0 => scope.shift(-by_s),
            None => {}
        }
    }
}

/// The numbers at the left are a handle: the wheel zooms the values around it, a drag moves them, a double click fits them again.
fn take_axis_pointer(ui: &Ui, scope: &mut Scope, quantity: Quantity, shown: &PlotResponse<()>) {
    let (plot, transform) = (shown.response.rect, &shown.transform);
    let numbers = Rect::from_min_max(Pos2::new(plot.left() - AXIS_WIDTH, plot.top()), plot.left_bottom());
    let id = shown.response.id.with("numbers");
    let response = ui
        .interact(numbers, id, Sense::click_and_drag())
        .on_hover_text("The wheel zooms these values, a drag moves them, a double click fits them to what is seen")
        .accessible_name(format!("{} axis", quantity.name()));
    let axes = &mut scope.value_axes;
    if response.double_clicked() {
        axes.fit(quantity);
        return;
    }
    if let Some(pos) = response.hover_pos()
        && let Some(factor) = zoom(ui)
    {
        axes.zoom(quantity, factor, transform.value_from_position(pos).y);
    }
    let by = f64::from(response.drag_delta().y) / transform.dpos_dvalue_y();
    if response.dragged() && by != 0.0 {
        axes.shift(quantity, -by);
    }
}

/// By how much the wheel, or two fingers, zoom in now.
fn zoom(ui: &Ui) -> Option<f64> {
    let (scroll, zoom) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
    let factor = zoom * (scroll / POINTS_PER_ZOOM).exp();
    ((factor - 1.0).abs() > f32::EPSILON).then(|| f64::from(factor))
}
