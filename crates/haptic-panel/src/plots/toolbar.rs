//! The tools of the plots: run and freeze, zoom and move, choose, trigger, measure, export.

use super::scope::Scope;
use super::{compare_menu, rig_menu, trigger_bar};
use crate::dialogs;
use crate::intent::{DialogPurpose, Format, Intent};
use crate::model::{Model, has_block};
use crate::plots::scope::plot_list::PlotList;
use crate::plots::scope::trigger::Mode;
use crate::plots::scope::value_axis::{FARTHEST, ValueAxis};
use crate::tape::signal::Quantity;
use crate::tapes::Tapes;
use crate::text_input::number_field;
use crate::words::{cell, significant};
use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{Button, PopupCloseBehavior, RichText, TextEdit, Ui, Vec2, vec2};
use std::path::PathBuf;

/// Factor by which a press of a zoom button changes the time seen.
const ZOOM_STEP: f64 = 1.5;

/// Share of the time seen by which a press of a move button moves.
const SHIFT_SHARE: f64 = 0.25;

/// Left edge of the fields for the ends of the axes in the menu, points.
const AXIS_FIELDS_AT: f32 = 128.0;

/// Sizes of the button, for either name, and of the time seen: their neighbours must not move.
const RUN_SIZE: Vec2 = vec2(60.0, 0.0);
const SPAN_SIZE: Vec2 = vec2(68.0, 22.0);

/// Widths of the distance between the cursors, and of a signal at them, in a narrow window and in a wide one.
const DISTANCE_WIDTH: f32 = 190.0;
const READING_WIDTH: f32 = 180.0;
const WIDE_READING_WIDTH: f32 = 284.0;

/// Digits of a signal at a cursor.
const DIGITS: usize = 4;

/// Shows the tools. A wide window has room for the readings of both cursors.
pub(crate) fn show(ui: &mut Ui, model: &mut Model, is_wide: bool, intents: &mut Vec<Intent>) {
    let has_block = has_block(model);
    let Model { daemon, tapes, view } = model;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let scope = view.scope_mut(tapes);
        let is_of_rig = scope.is_of_rig();
        if is_of_rig {
            show_running(ui, tapes, scope);
        }
        show_moving(ui, tapes, scope);
        ui.separator();
        show_plots(ui, &mut scope.plots);
        show_axes(ui, scope);
        ui.separator();
        if is_of_rig {
            trigger_bar::show_mode(ui, scope);
        }
        show_cursors_toggle(ui, tapes, scope);
        ui.toggle_value(&mut view.layout.shows_limits, "Limits")
            .on_hover_text("Lines at the force limit, Fs and Fd, and dots where the force was clipped");
        let (scope, reference) = view.plotted(tapes);
        compare_menu::show(ui, tapes, scope, reference);
        show_export(ui, &mut view.folder, intents);
        if is_of_rig {
            rig_menu::show(ui, daemon);
        }
    });
    let is_compared = view.plotted(tapes).1.is_some();
    let is_plane = view.plotted(tapes).0.tape(tapes).is_plane();
    let scope = view.scope_mut(tapes);
    if scope.is_of_rig() && scope.trigger.mode() != Mode::Off {
        ui.horizontal_wrapped(|ui| trigger_bar::show(ui, scope, is_plane));
    } else if is_compared {
        ui.horizontal_wrapped(|ui| {
            ui.label("Aligned at");
            trigger_bar::show_crossing(ui, &mut scope.trigger, is_plane);
        });
    }
    if scope.cursors.shown {
        show_cursors(ui, tapes, scope, is_wide, has_block);
    }
}

pub(super) fn show_running(ui: &mut Ui, tapes: &Tapes, scope: &mut Scope) {
    let (name, hint) = if scope.follows() {
        ("Freeze", "Freezes the plots; the rig keeps running")
    } else {
        ("Run", "Follows the rig again")
    };
    let button = ui.add(Button::new(name).min_size(RUN_SIZE));
    if button.on_hover_text(hint).clicked() {
        if scope.follows() {
            scope.freeze(tapes);
        } else {
            scope.follow();
        }
    }
}

pub(super) fn show_moving(ui: &mut Ui, tapes: &Tapes, scope: &mut Scope) {
    let seen = scope.seen(tapes);
    let (span_s, middle_s) = (scope.span_s(), seen.from_s.midpoint(seen.to_s) - seen.zero_s);
    let step_s = SHIFT_SHARE * span_s;
    for (text, name, hint) in [
        ("<", "earlier", "Shows earlier samples; so does dragging a plot"),
        ("-", "zoom out", "Shows more time; so does the wheel on a plot"),
        ("+", "zoom in", "Shows less time; so does the wheel on a plot"),
        (">", "later", "Shows later samples; so does dragging a plot"),
    ] {
        let button = ui.add(Button::new(RichText::new(text).monospace()));
        if !button.accessible_name(name).on_hover_text(hint).clicked() {
            continue;
        }
        match name {
            "earlier" => scope.shift(-step_s, tapes),
            "later" => scope.shift(step_s, tapes),
            "zoom out" => scope.zoom(1.0 / ZOOM_STEP, middle_s),
            _ => scope.zoom(ZOOM_STEP, middle_s),
        }
    }
    let (shortest_s, longest_s) = scope.window.reach_s();
    let mut typed_s = span_s;
    let field = number_field(&mut typed_s, |field| {
        let field = field.speed(span_s / 100.0).range(shortest_s..=longest_s);
        field.max_decimals(4).suffix(" s")
    });
    let field = ui.add_sized(SPAN_SIZE, field).accessible_name("time seen");
    field.on_hover_text("The time that is seen, to be dragged or typed");
    let default_s = scope.window.default_s();
    let usual = ui.add_enabled(span_s != default_s, Button::new("5 s"));
    let usual = usual
        .accessible_name("back to 5 s")
        .on_hover_text("Shows five seconds again");
    if usual.clicked() {
        typed_s = default_s;
    }
    if typed_s != span_s {
        scope.zoom(span_s / typed_s, middle_s);
    }
}

/// Adds plots. The menu above each plot chooses its signals, and removes it.
fn show_plots(ui: &mut Ui, plots: &mut PlotList) {
    let (button, _) = MenuButton::new("Plots").ui(ui, |ui| {
        ui.label(RichText::new("Add a plot of").small());
        for quantity in Quantity::ALL {
            let add = ui.add_enabled(!plots.is_full(), Button::new(quantity.name()));
            if add
                .accessible_name(format!("add {} plot", quantity.name().to_lowercase()))
                .clicked()
            {
                plots.add(quantity.signals());
                ui.close();
            }
        }
        ui.separator();
        if ui.button("Usual plots").clicked() {
            *plots = PlotList::default();
            ui.close();
        }
    });
    button.on_hover_text("Adds a plot; \"Signals\" above each plot changes what it shows");
}

/// The ranges of the value axes, to be typed. The pointer sets them at the numbers of each axis.
fn show_axes(ui: &mut Ui, scope: &mut Scope) {
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let (button, _) = MenuButton::new("Axes").config(config).ui(ui, |ui| {
        for place in 0..scope.plots.plots().len() {
            let name = scope.plots.name(place).to_lowercase();
            let plot = &mut scope.plots.plots_mut()[place];
            let unit = plot.unit();
            ui.horizontal(|ui| show_axis(ui, &mut plot.axis, &name, unit));
        }
    });
    button.on_hover_text("How far the values reach: fitted to what is seen, or held where you want them");
}

fn show_axis(ui: &mut Ui, axis: &mut ValueAxis, name: &str, unit: &str) {
    let mut fits = axis.held().is_none();
    let toggle = ui.checkbox(&mut fits, format!("Fit {name}"));
    if toggle.changed() && fits {
        axis.fit();
    } else if toggle.changed() {
        axis.hold(axis.seen());
    }
    let (mut low, mut high) = axis.seen();
    let (speed, unit) = ((high - low) / 200.0, format!(" {unit}"));
    // The fields of all plots are aligned.
    ui.add_space((AXIS_FIELDS_AT - ui.min_rect().width()).max(0.0));
    let span = high - low;
    let mut field = |end: &mut f64, at: &str| {
        let before = *end;
        let field = number_field(end, |field| {
            let field = field.speed(speed).range(-FARTHEST..=FARTHEST);
            field.max_decimals(6).suffix(&unit)
        });
        ui.add(field).accessible_name(format!("{name} axis {at} end"));
        *end != before
    };
    let (low_typed, high_typed) = (field(&mut low, "lower"), field(&mut high, "upper"));
    // An end that passes the other one takes it along.
    match (low_typed, high_typed) {
        (true, _) => axis.hold((low, if high > low { high } else { low + span })),
        (_, true) => axis.hold((if high > low { low } else { high - span }, high)),
        _ => {}
    }
}

fn show_cursors_toggle(ui: &mut Ui, tapes: &Tapes, scope: &mut Scope) {
    let seen = scope.seen(tapes);
    let toggle = Button::selectable(scope.cursors.shown, "Cursors").frame_when_inactive(true);
    if ui
        .add(toggle)
        .on_hover_text(
            "Two cursors in time, whose lines or dots are dragged, or typed. If they are out of sight, this brings them \
             back.",
        )
        .clicked()
    {
        scope.cursors.toggle(seen.on_axis());
    }
}

/// Shows the cursors and the differences between them, of signals that are there.
fn show_cursors(ui: &mut Ui, tapes: &Tapes, scope: &mut Scope, is_wide: bool, has_block: bool) {
    let zero_s = scope.seen(tapes).zero_s;
    let readings: Vec<_> = scope
        .plots
        .lines(has_block, scope.tape(tapes).is_plane())
        .into_iter()
        .map(|line| scope.cursors.read(line, scope.tape(tapes), zero_s))
        .collect();
    let speed = scope.span_s() / 500.0;
    let cursors = &mut scope.cursors;
    ui.horizontal_wrapped(|ui| {
        let height = ui.spacing().interact_size.y;
        for (at_s, name) in cursors.at_s.iter_mut().zip(["cursor 1", "cursor 2"]) {
            ui.add(number_field(at_s, |field| {
                field.speed(speed).max_decimals(4).suffix(" s")
            }))
            .accessible_name(name);
        }
        let frequency = cursors
            .frequency_hz()
            .map_or_else(|| "∞".to_owned(), |hz| format!("{hz:.4}"));
        let text = format!("dt {:.4} s, 1/dt {frequency} Hz", cursors.distance_s());
        cell(ui, vec2(DISTANCE_WIDTH, height), RichText::new(&text).strong()).on_hover_text(text);
        for reading in &readings {
            let (name, unit) = (reading.component.name(reading.signal), reading.signal.quantity().unit());
            let [first, second] = reading
                .values
                .map(|value| value.map_or_else(|| "none".to_owned(), |value| significant(value, DIGITS)));
            let difference = reading.difference().map_or_else(
                || "none".to_owned(),
                |difference| {
                    let sign = if difference > 0.0 { "+" } else { "" };
                    format!("{sign}{} {unit}", significant(difference, DIGITS))
                },
            );
            let mut text = format!("{name} {difference}");
            if is_wide {
                text += &format!(" ({first} to {second})");
            }
            let width = if is_wide { WIDE_READING_WIDTH } else { READING_WIDTH };
            cell(ui, vec2(width, height), RichText::new(text).small())
                .on_hover_text(format!("{name}: {first} at the first, {second} {unit} at the second"));
        }
    });
}

/// Writes the plots to files.
pub(super) fn show_export(ui: &mut Ui, folder: &mut String, intents: &mut Vec<Intent>) {
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let menu = MenuButton::new("Export").config(config);
    let (button, _) = menu.ui(ui, |ui| {
        ui.label("What is seen, into this folder:");
        ui.horizontal(|ui| {
            let field = TextEdit::singleline(folder).desired_width(240.0);
            ui.add(field).accessible_name("folder to export to");
            let asked = (DialogPurpose::Folder, folder.as_str());
            dialogs::browse_button(ui, "Browse...", "choose folder to export to", asked, intents);
        });
        ui.horizontal(|ui| {
            for format in Format::ALL {
                let name = format.extension().to_uppercase();
                let button = ui.button(&name).accessible_name(format!("export {name}"));
                if button.clicked() {
                    let folder = PathBuf::from(&*folder);
                    intents.push(Intent::Export { format, folder });
                    // The menu must not be in the picture.
                    ui.close();
                }
            }
            ui.separator();
            for format in Format::ALL {
                let name = format.extension().to_uppercase();
                let (text, name) = (format!("{name} as..."), format!("export {name} as"));
                let asked = (DialogPurpose::Export(format), folder.as_str());
                if dialogs::browse_button(ui, &text, &name, asked, intents) {
                    ui.close();
                }
            }
        });
    });
    button.on_hover_text("PNG as it is drawn, SVG for a paper, CSV with every column");
}
