//! The plots over time, one below the other on one time axis, under the contact ribbon and the strip of what
//! happened.

use super::axis::{AXIS_WIDTH, DEFAULT_COUNT};
use super::chart::{Axes, Chart, Curve, Ink, Overlay, Trace};
use super::frame::{GRAB, RIGHT_MARGIN, zoom};
use super::limits::Limits;
use super::reference::Reference;
use super::scope::{Scope, TimeRange};
use super::{contact_ribbon, frame, legend, mark_strip, plot_header};
use crate::plots::scope::plot_list::{Plot, PlotList};
use crate::plots::scope::trigger::Mode;
use crate::tape::Tape;
use crate::tape::mark::MarkKind;
use crate::tape::plane::Component;
use crate::tape::signal::Signal;
use crate::tapes::{Tapes, WhatIf};
use crate::theme::Palette;
use egui::scroll_area::ScrollSource;
use egui::style::ScrollStyle;
use egui::{Pos2, Rect, RichText, ScrollArea, Sense, Ui, vec2};
use egui_plot::PlotResponse;

const TIME_LABEL_HEIGHT: f32 = 18.0;
const RIBBON_HEIGHT: f32 = 10.0;

/// Lowest height of a plot, points: three fit into a window of 1280 x 760 under a reading of two cursors.
const LOWEST_PLOT: f32 = 68.0;

/// Lowest height of a plot with room for the name of its axis, points. A lower one has its unit: the legend has names.
const NAMED_PLOT: f32 = 100.0;

/// Width of the trigger's lines, points.
const MARK_WIDTH: f32 = 1.0;

/// How strong the lines are where scene or state changed: they lie over the data.
const MARK_OPACITY: f32 = 0.6;

/// Least distance of two such lines, as a share of the time seen.
const MIN_MARK_SHARE: f64 = 0.005;

/// Width of the force that would have been felt, points.
const WHAT_IF_WIDTH: f32 = 2.0;

/// How strong the lines of the reference are.
const REFERENCE_OPACITY: f32 = 0.45;

/// Width of a cursor, points.
const CURSOR_WIDTH: f32 = 1.5;

/// What lies under the lines of the run in sight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Background<'a> {
    pub(crate) reference: Option<&'a Reference>,
    /// `None` where they are hidden.
    pub(crate) limits: Option<&'a Limits>,
    /// Whether the scene has a block. Without one there is no line of it.
    pub(crate) has_block: bool,
}

/// The chart of the plot at a place, drawn in `columns` columns of pixels.
pub(crate) fn chart(
    tapes: &Tapes,
    scope: &Scope,
    place: usize,
    background: Background<'_>,
    overlays: &[Overlay],
    columns: f64,
) -> Chart {
    let seen = scope.seen(tapes);
    let plot = &scope.plots.plots()[place];
    let is_there = |signal: &Signal| signal.is_there(background.has_block);
    let signals: Vec<Signal> = plot.signals().iter().copied().filter(is_there).collect();
    let is_plane = scope.tape(tapes).is_plane();
    let as_length = is_plane && plot.shows_lengths;
    let traces = Trace::all_over_time(&signals).into_iter();
    let traces: Vec<Trace> = traces.flat_map(|trace| trace.components(is_plane, as_length)).collect();
    let mut all = happened(tapes, scope, place == 0);
    all.extend(
        background
            .limits
            .into_iter()
            .flat_map(|limits| limits.levels(plot.signals(), as_length)),
    );
    all.extend(
        background
            .reference
            .into_iter()
            .flat_map(|reference| under(reference, &traces, &seen, columns)),
    );
    all.extend(what_if(tapes, scope, plot, columns));
    all.extend_from_slice(overlays);
    let axes = Axes {
        seen,
        columns,
        across: seen.on_axis(),
        up: plot.axis.held(),
        smallest_span: plot.smallest_span(),
        labels: [time_label(scope).to_owned(), plot.label()],
    };
    let mut chart = Chart::new(scope.tape(tapes), &traces, &all, axes);
    let clipped = background.limits.and_then(|limits| {
        let force = force(scope.tape(tapes), &chart, plot.signals(), &seen, columns);
        limits.clipped(&force)
    });
    chart.overlays.extend(clipped);
    chart
}

/// The line of the force on the hand in a chart; where it shows both of its axes, that of its length, which is limited.
fn force(tape: &Tape, chart: &Chart, signals: &[Signal], seen: &TimeRange, columns: f64) -> Vec<[f64; 2]> {
    let whole = [Component::Whole, Component::Length].map(|component| component.name(Signal::COMMAND_FORCE));
    if let Some(curve) = chart.curves.iter().find(|curve| whole.contains(&curve.name)) {
        return curve.points.clone();
    }
    if !signals.contains(&Signal::COMMAND_FORCE) {
        return Vec::new();
    }
    let length = [(Signal::COMMAND_FORCE, Component::Length)];
    let lines = tape.lines(&length, (seen.from_s, seen.to_s), seen.column_s(columns));
    let points = lines.into_iter().flatten();
    points.map(|[t_s, force_n]| [t_s - seen.zero_s, force_n]).collect()
}

/// The lines of the reference, fainter than those of the run in sight.
fn under(reference: &Reference, traces: &[Trace], seen: &TimeRange, columns: f64) -> Vec<Overlay> {
    let offset_s = reference.offset_s(seen.zero_s);
    let ends = (seen.from_s - offset_s, seen.to_s - offset_s);
    let lines: Vec<_> = traces.iter().map(Trace::line).collect();
    let lines = reference.tape.lines(&lines, ends, seen.column_s(columns));
    let curve = |(trace, points): (&Trace, Vec<[f64; 2]>)| {
        let points = points
            .into_iter()
            .map(|[t_s, value]| [t_s + offset_s - seen.zero_s, value]);
        Overlay::Curve(Curve {
            name: format!("{}, reference", trace.name).into(),
            hint: "The run that was kept with Compare",
            points: points.collect(),
            ink: Ink {
                opacity: REFERENCE_OPACITY,
                ..trace.ink
            },
        })
    };
    traces.iter().zip(lines).map(curve).collect()
}

/// What would have been felt along the recording.
fn what_if(tapes: &Tapes, scope: &Scope, plot: &Plot, columns: f64) -> Vec<Overlay> {
    let force = Signal::COMMAND_FORCE;
    let WhatIf::Shown(what_if) = &tapes.what_if else {
        return Vec::new();
    };
    if scope.is_of_rig() || !plot.signals().contains(&force) {
        return Vec::new();
    }
    let seen = scope.seen(tapes);
    let traces = Trace::over_time(force).components(what_if.tape.is_plane(), plot.shows_lengths);
    let traces: Vec<Trace> = traces.collect();
    let lines: Vec<_> = traces.iter().map(Trace::line).collect();
    let ends = (seen.from_s, seen.to_s);
    let lines = what_if.tape.lines(&lines, ends, seen.column_s(columns));
    let curve = |(trace, points): (&Trace, Vec<[f64; 2]>)| {
        let points = points.into_iter().map(|[t_s, force]| [t_s - seen.zero_s, force]);
        Overlay::Curve(Curve {
            name: trace.name.replace(force.name(), "What if").into(),
            hint: "The force that the other scene would have given along this motion",
            points: points.collect(),
            ink: Ink {
                is_dashed: trace.ink.is_dashed,
                ..Ink::solid(|palette| palette.law, WHAT_IF_WIDTH)
            },
        })
    };
    traces.iter().zip(lines).map(curve).collect()
}

/// Lines where something happened. The texts of markers stand in the first plot alone; the others are in the
/// strip above.
fn happened(tapes: &Tapes, scope: &Scope, is_first: bool) -> Vec<Overlay> {
    let seen = scope.seen(tapes);
    let tape = scope.tape(tapes);
    let least_s = (seen.to_s - seen.from_s) * MIN_MARK_SHARE;
    let mut drawn_s = f64::NEG_INFINITY;
    let mut lines = Vec::new();
    for (t_s, mark) in tape.marks(seen.from_s, seen.to_s) {
        let is_marker = mark.kind == MarkKind::Marker;
        // A drag changes the scene thirty times a second.
        if !is_marker && t_s - drawn_s < least_s {
            continue;
        }
        drawn_s = t_s;
        lines.push(Overlay::Mark {
            at: t_s - seen.zero_s,
            label: if is_first && is_marker {
                mark.text.clone().into()
            } else {
                "".into()
            },
            is_dashed: false,
            ink: Ink {
                opacity: if is_marker { 1.0 } else { MARK_OPACITY },
                ..Ink::solid(mark.kind.color(), MARK_WIDTH)
            },
        });
    }
    lines
}

/// The level and the moment of the trigger, and the cursors.
fn overlays(scope: &Scope, plot: &Plot) -> Vec<Overlay> {
    let mut overlays = Vec::new();
    let mark = Ink::solid(|palette| palette.mark, MARK_WIDTH);
    if scope.trigger.mode() != Mode::Off {
        if plot.signals().contains(&scope.trigger.signal) {
            overlays.push(Overlay::Level {
                value: scope.trigger.level,
                label: "".into(),
                is_inward: false,
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
    match scope.caught() {
        Some(_) => "Time from the trigger (s)",
        None if scope.follows() => "Time from the newest sample (s)",
        None => "Time (s)",
    }
}

/// Shows the ribbon and the plots in `height` points.
pub(crate) fn show(ui: &mut Ui, tapes: &Tapes, scope: &mut Scope, background: Background<'_>, height: f32) {
    let top = ui.cursor().top();
    show_key(ui);
    ui.spacing_mut().item_spacing.y = 2.0;
    let flags = mark_strip::allocate(ui);
    let (strip, _) = ui.allocate_exact_size(vec2(ui.available_width(), RIBBON_HEIGHT), Sense::hover());
    let Some(lowest) = scope.plots.plots().len().checked_sub(1) else {
        ui.label("No plot is left");
        if ui.button("Show the usual plots").clicked() {
            scope.plots = PlotList::default();
        }
        return;
    };
    let spacing = ui.spacing().item_spacing.y;
    let left = height - (ui.cursor().top() - top) - TIME_LABEL_HEIGHT;
    #[expect(clippy::cast_precision_loss, reason = "a few plots")]
    let count = (lowest + 1) as f32;
    let header = legend::HEIGHT + 2.0 * spacing;
    let height = (left / count - header).max(LOWEST_PLOT);
    let (mut change, mut time_axis) = (None, None);
    let is_plane = scope.tape(tapes).is_plane();
    let mut show_all = |ui: &mut Ui| {
        ui.spacing_mut().item_spacing.y = spacing;
        // Something too wide in one of the rows must not make those below it wider.
        let width = ui.available_width();
        let columns = f64::from((width - RIGHT_MARGIN - AXIS_WIDTH).max(1.0) * ui.pixels_per_point());
        let chart = |place: usize| {
            let overlays = overlays(scope, &scope.plots.plots()[place]);
            chart(tapes, scope, place, background, &overlays, columns)
        };
        let charts: Vec<Chart> = (0..=lowest).map(chart).collect();
        // One width for the numbers of all, so that they are aligned.
        let asides = charts.iter().map(|chart| frame::aside(ui, chart.up, height));
        let aside = asides.fold(AXIS_WIDTH, f32::max);
        for (place, chart) in charts.iter().enumerate() {
            let extent = Extent {
                width,
                height,
                aside,
                has_time: place == lowest,
            };
            let (shown, asked) = show_one(ui, (scope, is_plane), place, chart, extent);
            change = change.or(asked.map(|asked| (place, asked)));
            if place == 0 {
                time_axis = Some(shown.transform);
            }
            take_pointer(ui, tapes, scope, &shown);
            take_axis_pointer(ui, scope, place, &shown, aside);
        }
    };
    if count * (height + header) <= left + 1.0 {
        show_all(ui);
    } else {
        // Without room for all of them they are scrolled by the bar alone, which stays visible: the wheel zooms.
        ui.spacing_mut().scroll = ScrollStyle::solid();
        ScrollArea::vertical()
            .max_height(left.max(LOWEST_PLOT))
            .scroll_source(ScrollSource::SCROLL_BAR)
            .auto_shrink(false)
            .show(ui, show_all);
    }
    // Above what may be scrolled.
    if let Some(axis) = time_axis {
        let (tape, seen) = (scope.tape(tapes), scope.seen(tapes));
        contact_ribbon::paint(ui, strip, &axis, tape, &seen);
        mark_strip::show(ui, flags, &axis, tape, &seen);
    }
    if let Some((place, change)) = change {
        plot_header::carry_out(&mut scope.plots, place, change);
    }
}

fn show_key(ui: &mut Ui) {
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

/// How large a plot is, points.
#[derive(Clone, Copy, Debug)]
struct Extent {
    /// With the numbers at the left, and the margin at the right.
    width: f32,
    /// Without the numbers and the name of the time axis.
    height: f32,
    /// Width of the numbers at the left.
    aside: f32,
    has_time: bool,
}

fn show_one(
    ui: &mut Ui,
    (scope, is_plane): (&mut Scope, bool),
    place: usize,
    chart: &Chart,
    extent: Extent,
) -> (PlotResponse<()>, Option<plot_header::Change>) {
    let palette = Palette::of(ui);
    let Extent {
        width,
        height: inner,
        aside,
        has_time,
    } = extent;
    let height = if has_time { inner + TIME_LABEL_HEIGHT } else { inner };
    let change = plot_header::show(
        ui,
        width,
        (&scope.plots, is_plane),
        place,
        &legend::entries(chart, palette),
    );
    let name = format!("{} plot", scope.plots.name(place));
    let plot = &mut scope.plots.plots_mut()[place];
    plot.axis.saw(chart.up);
    let axis_name = if inner < NAMED_PLOT {
        plot.unit()
    } else {
        &chart.labels[1]
    };
    let cursor_group = egui::Id::unique("time of the plots");
    let shown = frame::plot(&format!("plot {}", plot.id), height, inner, DEFAULT_COUNT, aside)
        .width(width - RIGHT_MARGIN)
        .show_axes([has_time, true])
        .link_cursor(cursor_group, [true, false])
        .x_axis_label(if has_time { chart.labels[0].as_str() } else { "" })
        .y_axis_label(axis_name)
        .sense(Sense::drag());
    let mut response = shown.show(ui, |plot| frame::draw(plot, chart, palette));
    response.response = response.response.accessible_name(name);
    (response, change)
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
        let cursor = ui.data(|data| data.get_temp::<Option<usize>>(grabbed)).flatten();
        match (cursor, response.interact_pointer_pos()) {
            // Not by the travel of the pointer, which may have jumped in the frame of the press.
            (Some(cursor), Some(pos)) => scope.cursors.at_s[cursor] = time_at(pos),
            (None, _) if by_s != 0.0 => scope.shift(-by_s, tapes),
            _ => {}
        }
    }
}

/// The numbers at the left are a handle: the wheel zooms the values, a drag moves them, a double click
/// fits them again.
fn take_axis_pointer(ui: &Ui, scope: &mut Scope, place: usize, shown: &PlotResponse<()>, aside: f32) {
    let name = format!("{} axis", scope.plots.name(place));
    let (plot, transform) = (shown.response.rect, &shown.transform);
    let numbers = Rect::from_min_max(Pos2::new(plot.left() - aside, plot.top()), plot.left_bottom());
    let id = shown.response.id.with("numbers");
    let response = ui
        .interact(numbers, id, Sense::click_and_drag())
        .on_hover_text("The wheel zooms these values, a drag moves them, a double click fits them to what is seen")
        .accessible_name(name);
    let axis = &mut scope.plots.plots_mut()[place].axis;
    if response.double_clicked() {
        axis.fit();
        return;
    }
    if let Some(pos) = response.hover_pos()
        && let Some(factor) = zoom(ui)
    {
        axis.zoom(factor, transform.value_from_position(pos).y);
    }
    let by = f64::from(response.drag_delta().y) / transform.dpos_dvalue_y();
    if response.dragged() && by != 0.0 {
        axis.shift(-by);
    }
}
