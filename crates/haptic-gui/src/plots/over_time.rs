//! Force, position and velocity over time, one below the other on one time axis, under the contact ribbon.

use super::axis::{AXIS_WIDTH, USUAL_COUNT};
use super::chart::{Axes, Chart, Curve, Ink, Overlay, Trace};
use super::{contact_ribbon, frame};
use crate::model::scope::Scope;
use crate::model::scope::trigger::Mode;
use crate::model::tapes::{Tapes, WhatIf};
use crate::recording::Marker;
use crate::tape::signal::{Quantity, Signal};
use crate::theme::Palette;
use egui::scroll_area::ScrollSource;
use egui::style::ScrollStyle;
use egui::{Pos2, Rect, RichText, ScrollArea, Sense, Ui, vec2};
use egui_plot::PlotResponse;

const TIME_LABEL_HEIGHT: f32 = 18.0;
const RIBBON_HEIGHT: f32 = 10.0;

/// Lowest height of a plot with room for the name of its axis, points.
const LOWEST_PLOT: f32 = 100.0;

/// Distance from a cursor at which a drag takes it along, points.
const GRAB: f32 = 8.0;

/// Points of scrolling by the wheel that zoom by a factor of e.
const POINTS_PER_ZOOM: f32 = 200.0;

/// Width of the trigger's lines, points.
const MARK_WIDTH: f32 = 1.0;

/// Width of the force that would have been felt, points.
const WHAT_IF_WIDTH: f32 = 2.0;

/// Width of a cursor, points.
const CURSOR_WIDTH: f32 = 1.5;

/// The chart of a quantity, drawn in `columns` columns of pixels.
pub(crate) fn chart(tapes: &Tapes, scope: &Scope, quantity: Quantity, overlays: &[Overlay], columns: f64) -> Chart {
    let seen = scope.seen(tapes);
    let overlays = [recorded(tapes, scope, quantity, columns), overlays.to_vec()].concat();
    let traces: Vec<Trace> = quantity.signals().map(Trace::over_time).collect();
    let axes = Axes {
        seen,
        columns,
        across: seen.on_axis(),
        up: scope.value_axes.held(quantity),
        smallest_span: quantity.smallest_span(),
        labels: [
            time_label(scope).to_owned(),
            format!("{} ({})", quantity.name(), quantity.unit()),
        ],
    };
    Chart::new(scope.tape(tapes), &traces, &overlays, axes)
}

/// What would have been felt along the recording, and the markers.
fn recorded(tapes: &Tapes, scope: &Scope, quantity: Quantity, columns: f64) -> Vec<Overlay> {
    let seen = scope.seen(tapes);
    let mut overlays = Vec::new();
    if let WhatIf::Shown(what_if) = tapes.what_if()
        && quantity == Signal::COMMAND_FORCE.quantity()
        && !scope.is_of_rig()
    {
        let ends = (seen.from_s, seen.to_s);
        let lines = what_if
            .tape
            .outlines(&[Signal::COMMAND_FORCE], ends, seen.column_s(columns));
        let points = lines
            .into_iter()
            .flatten()
            .map(|[t_s, force]| [t_s - seen.zero_s, force]);
        overlays.push(Overlay::Curve(Curve {
            name: "What if",
            points: points.collect(),
            ink: Ink::solid(|palette| palette.law, WHAT_IF_WIDTH),
        }));
    }
    // Their texts stand in the first plot alone.
    let is_first = scope.quantities().next() == Some(quantity);
    let in_sight = |marker: &&Marker| (seen.from_s..=seen.to_s).contains(&marker.t_s);
    overlays.extend(
        scope
            .markers(tapes)
            .iter()
            .filter(in_sight)
            .map(|marker| Overlay::Mark {
                at: marker.t_s - seen.zero_s,
                label: if is_first {
                    marker.text.clone().into()
                } else {
                    "".into()
                },
                is_dashed: false,
                ink: Ink::solid(|palette| palette.mark, MARK_WIDTH),
            }),
    );
    overlays
}

/// The level and the moment of the trigger, and the cursors.
fn overlays(scope: &Scope, quantity: Quantity) -> Vec<Overlay> {
    let mut overlays = Vec::new();
    let mark = Ink::solid(|palette| palette.mark, MARK_WIDTH);
    if scope.trigger.mode() != Mode::Off {
        if scope.trigger.signal.quantity() == quantity {
            overlays.push(Overlay::Level {
                value: scope.trigger.level,
                ink: mark,
            });
        }
        overlays.push(Overlay::Mark {
            at: 0.0,
            label: "".into(),
            is_dashed: true,
            ink: mark,
        });
    }
    if scope.cursors.shown {
        overlays.extend(scope.cursors.at_s.map(|at| Overlay::Mark {
            at,
            label: "".into(),
            is_dashed: false,
            ink: Ink::solid(|palette| palette.cursor, CURSOR_WIDTH),
        }));
    }
    overlays
}

/// The name of the time axis.
fn time_label(scope: &Scope) -> &'static str {
    match (scope.follows(), scope.trigger.mode()) {
        (true, Mode::Off) => "Time from the newest sample (s)",
        (true, _) => "Time from the trigger (s)",
        (false, _) => "Time (s)",
    }
}

/// Shows the ribbon and the plots in `height` points.
pub(crate) fn show(ui: &mut Ui, tapes: &Tapes, scope: &mut Scope, height: f32) {
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
            let shown = show_one(ui, tapes, scope, quantity, height, has_time);
            if place == 0 {
                contact_ribbon::paint(
                    ui,
                    &painter,
                    strip,
                    &shown.transform,
                    scope.tape(tapes),
                    &scope.seen(tapes),
                );
            }
            take_pointer(ui, tapes, scope, &shown);
            take_axis_pointer(ui, scope, quantity, &shown);
        }
    };
    if count * (height + spacing) <= left + 1.0 {
        show_all(ui);
        return;
    }
    // Without room for all of them they are scrolled by the bar alone, which stays visible: the wheel zooms.
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

fn show_one(
    ui: &mut Ui,
    tapes: &Tapes,
    scope: &mut Scope,
    quantity: Quantity,
    height: f32,
    has_time: bool,
) -> PlotResponse<()> {
    let palette = Palette::of(ui);
    let inner = if has_time { height - TIME_LABEL_HEIGHT } else { height };
    let columns = f64::from((ui.available_width() - AXIS_WIDTH).max(1.0) * ui.pixels_per_point());
    let chart = chart(tapes, scope, quantity, &overlays(scope, quantity), columns);
    scope.value_axes.saw(quantity, chart.up);
    let name = format!("{} plot", quantity.name());
    let cursor_group = egui::Id::unique("time of the plots");
    let plot = frame::plot(&name, height, inner, USUAL_COUNT)
        .link_cursor(cursor_group, [true, false])
        .x_axis_label(if has_time { chart.labels[0].as_str() } else { "" })
        .y_axis_label(chart.labels[1].as_str())
        .sense(Sense::drag());
    let mut response = plot.show(ui, |plot| frame::draw(plot, &chart, palette));
    response.response = response.response.accessible_name(name);
    response
}

/// Moves and zooms by pointer: the wheel zooms in time, a drag moves in time or takes a cursor along.
fn take_pointer(ui: &Ui, tapes: &Tapes, scope: &mut Scope, shown: &PlotResponse<()>) {
    let (response, transform) = (&shown.response, &shown.transform);
    let time_at = |pos: Pos2| transform.value_from_position(pos).x;
    if let Some(pos) = response.hover_pos() {
        if let Some(factor) = zoom(ui) {
            scope.zoom(factor, time_at(pos));
        }
        let sideways = ui.input(|input| input.smooth_scroll_delta().x);
        if sideways != 0.0 {
            scope.shift(-f64::from(sideways) / transform.dpos_dvalue_x(), tapes);
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
            None if by_s != 0.0 => scope.shift(-by_s, tapes),
            None => {}
        }
    }
}

/// The numbers at the left are a handle: the wheel zooms the values, a drag moves them, a double click
/// fits them again.
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

/// The factor by which the wheel, or two fingers, zoom in now.
fn zoom(ui: &Ui) -> Option<f64> {
    let (scroll, zoom) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
    let factor = zoom * (scroll / POINTS_PER_ZOOM).exp();
    ((factor - 1.0).abs() > f32::EPSILON).then(|| f64::from(factor))
}
