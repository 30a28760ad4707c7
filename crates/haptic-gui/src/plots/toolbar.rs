//! What can be done with the plots: run and freeze, zoom and move, choose, trigger, measure, keep.

use super::recordings;
use crate::drop_down::{self, Item};
use crate::intent::{Format, Intent};
use crate::model::Model;
use crate::scope::Scope;
use crate::scope::signal::{Quantity, Signal};
use crate::scope::trigger::{Edge, Mode};
use crate::scope::value_axes::{FARTHEST, ValueAxes};
use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{Button, DragValue, Label, PopupCloseBehavior, RichText, TextEdit, Ui, Vec2, vec2};
use std::path::PathBuf;

/// A press of a zoom button changes the while by this factor.
const ZOOM_STEP: f64 = 1.5;

/// A press of a move button moves by this share of the while.
const SHIFT_SHARE: f64 = 0.25;

/// From here on the fields for the ends of the axes stand in the menu, points.
const AXIS_FIELDS_AT: f32 = 96.0;

/// Room for either name of the button, and for a while, so that what stands beside them does not move.
const RUN_SIZE: Vec2 = vec2(60.0, 0.0);
const SPAN_SIZE: Vec2 = vec2(60.0, 22.0);

/// Shows the tools.
pub(crate) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let scope = model.scope_mut();
        show_running(ui, scope);
        show_moving(ui, scope);
        ui.separator();
        for (shown, quantity) in scope.shown.iter_mut().zip(Quantity::ALL) {
            let name = format!("plot {}", quantity.name().to_lowercase());
            ui.toggle_value(shown, quantity.name()).accessible_name(name);
        }
        show_axes(ui, scope);
        ui.separator();
        show_trigger_mode(ui, scope);
        show_cursors_toggle(ui, scope);
        show_keeping(ui, model, intents);
        recordings::show(ui, model, intents);
    });
    recordings::show_news(ui, model);
    let scope = model.scope_mut();
    if scope.trigger.mode() != Mode::Off && !scope.is_of_recording() {
        ui.horizontal_wrapped(|ui| show_trigger(ui, scope));
    }
    if scope.cursors.shown {
        show_cursors(ui, scope);
    }
}

fn show_running(ui: &mut Ui, scope: &mut Scope) {
    if scope.is_of_recording() {
        return;
    }
    let (name, hint) = if scope.follows() {
        ("Freeze", "Keeps what is seen; the rig goes on")
    } else {
        ("Run", "Follows the rig again")
    };
    let button = ui.add(Button::new(name).min_size(RUN_SIZE));
    if button.on_hover_text(hint).clicked() {
        if scope.follows() {
            scope.freeze();
        } else {
            scope.follow();
        }
    }
}

fn show_moving(ui: &mut Ui, scope: &mut Scope) {
    let seen = scope.seen();
    let (span_s, middle_s) = (scope.span_s(), seen.from_s.midpoint(seen.to_s) - seen.zero_s);
    let step_s = SHIFT_SHARE * span_s;
    for (text, name, hint) in [
        ("<", "earlier", "Shows earlier samples; so does dragging a plot"),
        ("-", "zoom out", "Shows a longer while; so does the wheel on a plot"),
        ("+", "zoom in", "Shows a shorter while; so does the wheel on a plot"),
        (">", "later", "Shows later samples; so does dragging a plot"),
    ] {
        let button = ui.add(Button::new(RichText::new(text).monospace()));
        if !button.accessible_name(name).on_hover_text(hint).clicked() {
            continue;
        }
        match name {
            "earlier" => scope.shift(-step_s),
            "later" => scope.shift(step_s),
            "zoom out" => scope.zoom(1.0 / ZOOM_STEP, middle_s),
            _ => scope.zoom(ZOOM_STEP, middle_s),
        }
    }
    ui.add_sized(SPAN_SIZE, Label::new(duration(span_s)))
        .on_hover_text("How long a while is seen");
}

/// How far the axes of the values reach, to be typed; the pointer does it at the numbers of each axis.
fn show_axes(ui: &mut Ui, scope: &mut Scope) {
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let (button, _) = MenuButton::new("Axes").config(config).ui(ui, |ui| {
        for quantity in Quantity::ALL {
            ui.horizontal(|ui| show_axis(ui, &mut scope.value_axes, quantity));
        }
    });
    button.on_hover_text("How far the values reach: fitted to what is seen, or held where you want them");
}

fn show_axis(ui: &mut Ui, axes: &mut ValueAxes, quantity: Quantity) {
    let name = quantity.name();
    let mut fits = axes.held(quantity).is_none();
    let toggle = ui.checkbox(&mut fits, format!("Fit {}", name.to_lowercase()));
    if toggle.changed() && fits {
        axes.fit(quantity);
    } else if toggle.changed() {
        axes.hold(quantity, axes.seen(quantity));
    }
    let (mut low, mut high) = axes.seen(quantity);
    let (speed, unit) = ((high - low) / 200.0, format!(" {}", quantity.unit()));
    // Those of all three stand in one column.
    ui.add_space((AXIS_FIELDS_AT - ui.min_rect().width()).max(0.0));
    let span = high - low;
    let mut field = |end: &mut f64, at: &str| {
        let field = DragValue::new(end).speed(speed).range(-FARTHEST..=FARTHEST);
        ui.add(field.max_decimals(6).suffix(&unit))
            .accessible_name(format!("{} axis {at} end", name.to_lowercase()))
            .changed()
    };
    let (low_typed, high_typed) = (field(&mut low, "lower"), field(&mut high, "upper"));
    // An end that passes the other takes it along.
    match (low_typed, high_typed) {
        (true, _) => axes.hold(quantity, (low, if high > low { high } else { low + span })),
        (_, true) => axes.hold(quantity, (if high > low { low } else { high - span }, high)),
        _ => {}
    }
}

fn show_trigger_mode(ui: &mut Ui, scope: &mut Scope) {
    if scope.is_of_recording() {
        return;
    }
    ui.label("Trigger");
    let mode = scope.trigger.mode();
    let items = || Mode::ALL.map(|other| Item::new(other, other.name(), &mode)).into();
    let (chosen, list) = drop_down::show(ui, "trigger", 80.0, mode.name(), items);
    list.on_hover_text(
        "Catches the while around a crossing. Auto: at every one, running while there is none. Normal: at every one. \
         Single: at the next.",
    );
    if let Some(mode) = chosen {
        scope.set_trigger_mode(mode);
    }
}

fn show_trigger(ui: &mut Ui, scope: &mut Scope) {
    let trigger = &mut scope.trigger;
    let signal = trigger.signal;
    let items = || Signal::ALL.map(|other| Item::new(other, other.name(), &signal)).into();
    let (chosen, _) = drop_down::show(ui, "trigger signal", 140.0, signal.name(), items);
    trigger.signal = chosen.unwrap_or(signal);
    for (edge, name) in [(Edge::Rising, "Rising"), (Edge::Falling, "Falling")] {
        ui.selectable_value(&mut trigger.edge, edge, name)
            .on_hover_text("Which way the signal crosses the level");
    }
    ui.label("level");
    let unit = format!(" {}", trigger.signal.quantity().unit());
    ui.add(DragValue::new(&mut trigger.level).speed(0.05).suffix(unit))
        .accessible_name("trigger level")
        .on_hover_text(
            "Before the signal can cross it again, it must go back beyond it by a tenth of how far it moved lately",
        );
    ui.label("before");
    let mut percent = trigger.share_before * 100.0;
    let before = DragValue::new(&mut percent).range(0.0..=100.0).speed(1.0).suffix(" %");
    ui.add(before)
        .accessible_name("pre-trigger share")
        .on_hover_text("Share of the while seen that lies before the crossing");
    trigger.share_before = percent / 100.0;
    let arm = ui.add_enabled(trigger.mode() == Mode::Single, Button::new("Arm"));
    let arms = arm.on_hover_text("Waits for the next crossing").clicked();
    ui.label(RichText::new(trigger.says()).strong());
    if arms {
        trigger.arm();
        scope.follow();
    }
}

fn show_cursors_toggle(ui: &mut Ui, scope: &mut Scope) {
    let seen = scope.seen();
    let toggle = Button::selectable(scope.cursors.shown, "Cursors").frame_when_inactive(true);
    if ui
        .add(toggle)
        .on_hover_text("Two cursors in time, to be dragged or typed. If they are out of sight, this brings them back.")
        .clicked()
    {
        scope
            .cursors
            .toggle((seen.from_s - seen.zero_s, seen.to_s - seen.zero_s));
    }
}

/// Where the cursors are, and what lies between them.
fn show_cursors(ui: &mut Ui, scope: &mut Scope) {
    let zero_s = scope.seen().zero_s;
    let readings: Vec<_> = scope
        .quantities()
        .flat_map(Quantity::signals)
        .map(|signal| scope.cursors.read(signal, scope.tape(), zero_s))
        .collect();
    let speed = scope.span_s() / 500.0;
    let has_room = ui.available_width() >= super::WIDE;
    let cursors = &mut scope.cursors;
    ui.horizontal_wrapped(|ui| {
        for (at_s, name) in cursors.at_s.iter_mut().zip(["cursor 1", "cursor 2"]) {
            ui.add(DragValue::new(at_s).speed(speed).max_decimals(4).suffix(" s"))
                .accessible_name(name);
        }
        let frequency = cursors
            .frequency_hz()
            .map_or_else(|| "∞".to_owned(), |hz| format!("{hz:.4}"));
        ui.label(RichText::new(format!("dt {:.4} s, 1/dt {frequency} Hz", cursors.distance_s())).strong());
        for reading in &readings {
            let Some(difference) = reading.difference() else {
                continue;
            };
            let (name, unit) = (reading.signal.name(), reading.signal.quantity().unit());
            let [first, second] = reading
                .values
                .map(|value| value.map_or_else(|| "none".to_owned(), |value| format!("{value:.3}")));
            let mut text = format!("{name} {difference:+.3} {unit}");
            if has_room {
                text += &format!(" ({first} to {second})");
            }
            ui.add(Label::new(RichText::new(text).small()).extend())
                .on_hover_text(format!("{first} at the first, {second} {unit} at the second"));
        }
    });
}

/// Writes what is seen to files.
fn show_keeping(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let menu = MenuButton::new("Export").config(config);
    let (button, _) = menu.ui(ui, |ui| {
        ui.label("What is seen, into this folder:");
        let field = TextEdit::singleline(&mut model.export_folder).desired_width(240.0);
        ui.add(field).accessible_name("folder to export to");
        ui.horizontal(|ui| {
            for format in Format::ALL {
                let name = format.extension().to_uppercase();
                let button = ui.button(&name).accessible_name(format!("export {name}"));
                if button.clicked() {
                    let folder = PathBuf::from(&model.export_folder);
                    intents.push(Intent::Export { format, folder });
                    // The menu must not be in the picture.
                    ui.close();
                }
            }
        });
    });
    button.on_hover_text("PNG and SVG as it is drawn, CSV with every column");
}

/// A while as it is read at a glance.
fn duration(span_s: f64) -> String {
    if span_s < 0.1 {
        format!("{:.1} ms", span_s * 1e3)
    } else {
        format!("{span_s:.2} s")
    }
}
