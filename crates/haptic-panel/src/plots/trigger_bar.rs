//! The controls of the trigger.

use super::scope::Scope;
use crate::drop_down::{self, Item};
use crate::plots::scope::trigger::{Edge, Mode, Trigger};
use crate::tape::plane::Component;
use crate::tape::signal::Signal;
use crate::text_input::number_field;
use egui::{Button, RichText, Ui};
use std::borrow::Cow;

pub(super) fn show_mode(ui: &mut Ui, scope: &mut Scope) {
    ui.label("Trigger");
    let mode = scope.trigger.mode();
    let items = || Mode::ALL.map(|other| Item::new(other, other.name(), &mode)).into();
    let (chosen, list) = drop_down::show(ui, "trigger", 80.0, mode.name(), items);
    list.on_hover_text(
        "Catches the time around a crossing. Auto: at every one, running while there is none. Normal: at every one. \
         Single: at the next.",
    );
    if let Some(mode) = chosen {
        scope.set_trigger_mode(mode);
    }
}

/// The name of what may cross a level.
fn name((signal, component): (Signal, Component), is_plane: bool) -> Cow<'static, str> {
    match (is_plane, component) {
        (false, _) => Component::Whole,
        (true, Component::Whole) => Component::of(signal, true, false)[0],
        (true, other) => other,
    }
    .name(signal)
}

/// Shows what has to cross which level, and how.
pub(super) fn show_crossing(ui: &mut Ui, trigger: &mut Trigger, is_plane: bool) {
    let line = (trigger.signal, trigger.component);
    let items = || {
        let lines = Signal::ALL.into_iter().flat_map(|signal| {
            let components = Component::of_trigger(signal, is_plane).iter();
            components.map(move |component| (signal, *component))
        });
        lines
            .map(|other| Item::new(other, name(other, is_plane), &line))
            .collect()
    };
    let (chosen, _) = drop_down::show(ui, "trigger signal", 140.0, name(line, is_plane).into_owned(), items);
    (trigger.signal, trigger.component) = chosen.unwrap_or(line);
    for (edge, name) in [(Edge::Rising, "Rising"), (Edge::Falling, "Falling")] {
        ui.selectable_value(&mut trigger.edge, edge, name)
            .on_hover_text("Which way the signal crosses the level");
    }
    ui.label("level");
    let unit = format!(" {}", trigger.signal.quantity().unit());
    ui.add(number_field(&mut trigger.level, |field| field.speed(0.05).suffix(unit)))
        .accessible_name("trigger level")
        .on_hover_text(
            "Before the signal can cross it again, it must go back beyond it by a tenth of how far it moved lately",
        );
}

/// Shows the settings of a trigger that is on.
pub(super) fn show(ui: &mut Ui, scope: &mut Scope, is_plane: bool) {
    let trigger = &mut scope.trigger;
    show_crossing(ui, trigger, is_plane);
    ui.label("before");
    let mut percent = trigger.share_before * 100.0;
    let before = number_field(&mut percent, |field| field.range(0.0..=100.0).speed(1.0).suffix(" %"));
    ui.add(before)
        .accessible_name("pre-trigger share")
        .on_hover_text("Share of the time seen that lies before the crossing");
    trigger.share_before = percent / 100.0;
    let arm = ui.add_enabled(trigger.mode() == Mode::Single, Button::new("Arm"));
    let arms = arm.on_hover_text("Waits for the next crossing").clicked();
    ui.label(RichText::new(trigger.state_text()).strong());
    if arms {
        trigger.arm();
        scope.follow();
    }
}
