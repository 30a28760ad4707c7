//! The controls of the whole scene: its law, undo and redo, two kept scenes, and tries.

use super::journal;
use super::scene_edits::{SLOTS, Tuning};
use super::trial::TRIAL;
use crate::drop_down::{self, Item};
use crate::intent::Intent;
use crate::words::shortened;
use egui::{Align, Button, Key, KeyboardShortcut, Layout, Modifiers, RichText, Ui};
use haptic_core::Scene;
use haptic_core::friction::{Friction, LAWS};
use haptic_ipc::{DaemonMirror, SceneMirror, SceneRef, differences};

const UNDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Z);
const REDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);

/// Takes the keys of undo and redo, unless the user types in a text field, which has an undo of its own.
pub(crate) fn take_keys(ui: &Ui, scene: &SceneMirror, tuning: &Tuning, intents: &mut Vec<Intent>) {
    let focused = ui.memory(egui::Memory::focused);
    if ui.ctx().text_edit_focused() && !focused.is_some_and(|field| tuning.is_untouched_value(field)) {
        return;
    }
    // The longer one first: the shorter one would match it as well.
    if ui.input_mut(|input| input.consume_shortcut(&REDO)) && scene.redo_depth > 0 {
        intents.push(Intent::Redo);
    }
    if ui.input_mut(|input| input.consume_shortcut(&UNDO)) && scene.undo_depth > 0 {
        intents.push(Intent::Undo);
    }
}

pub(crate) fn show(ui: &mut Ui, daemon: &DaemonMirror, tuning: &mut Tuning, intents: &mut Vec<Intent>) {
    let scene = &daemon.scene;
    ui.horizontal(|ui| {
        show_law(ui, scene, tuning, intents);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let last = daemon.journal.iter().rev().find(|entry| !entry.changes.is_empty());
            let last = last.map_or_else(String::new, |entry| format!("\nLast change: {}", journal::line(entry)));
            for (name, depth, keys, hint, intent) in [
                (
                    "Redo",
                    scene.redo_depth,
                    "Ctrl+Shift+Z",
                    "Repeats the change that was undone",
                    Intent::Redo,
                ),
                (
                    "Undo",
                    scene.undo_depth,
                    "Ctrl+Z",
                    "Takes back the newest change, of any client",
                    Intent::Undo,
                ),
            ] {
                let button = Button::new(format!("{name} {depth}"));
                let button = ui.add_enabled(depth > 0, button).accessible_name(name.to_lowercase());
                let hint = format!("{hint} ({keys}). Steps left: {depth}.{last}");
                if button.on_hover_text(&hint).on_disabled_hover_text(&hint).clicked() {
                    intents.push(intent);
                }
            }
        });
    });
    ui.horizontal(|ui| {
        show_slots(ui, scene.whole.as_ref(), tuning, intents);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| show_try(ui, tuning));
    });
    let text = slots_in_words(tuning);
    shortened(ui, RichText::new(&text).small().weak(), &text);
}

/// What A and B are for, as far as they are kept.
fn slots_in_words(tuning: &Tuning) -> String {
    let [first, second] = SLOTS;
    match &tuning.slots {
        [None, None] => format!("Keep {first}, change something, Keep {second}: {first}/{second} switches"),
        [Some(_), None] => format!("{first} is kept. Change something, then Keep {second}"),
        [None, Some(_)] => format!("{second} is kept. Change something, then Keep {first}"),
        [Some(kept), Some(other)] => {
            let changes = differences(kept, other);
            let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
            if changes.is_empty() {
                format!("{first} and {second} are the same")
            } else {
                format!("From {first} to {second}: {}", changes.join(", "))
            }
        }
    }
}

/// The active law, and all laws to choose from.
fn show_law(ui: &mut Ui, scene: &SceneMirror, tuning: &mut Tuning, intents: &mut Vec<Intent>) {
    ui.label("Law");
    let item = |law| Item {
        hint: Friction::summary(law).unwrap_or_default().to_owned(),
        ..Item::new(law, law, &scene.law.as_str())
    };
    let items = || LAWS.map(item).into();
    let (chosen, list) = drop_down::show(ui, "friction law", 140.0, &scene.law, items);
    list.on_hover_text(format!(
        "{}.\nAnother law takes over every parameter that both have, and the force on the hand. Its own parameters \
         have the values that they had last.",
        Friction::summary(&scene.law).unwrap_or_default()
    ));
    let Some(law) = chosen.filter(|law| *law != scene.law) else {
        return;
    };
    let active = scene.whole.as_ref();
    if let Some(changed) = active.and_then(|active| tuning.with_law(active, law)) {
        intents.push(tuning.load(format!("law {law}"), SceneRef::from(changed)));
    }
}

/// Two scenes to compare by feel: keep the active one as A or B, activate either, or switch.
fn show_slots(ui: &mut Ui, scene: Option<&Scene>, tuning: &mut Tuning, intents: &mut Vec<Intent>) {
    let active = tuning.active_slot(scene);
    for (place, slot) in SLOTS.into_iter().enumerate() {
        let keep = Button::new(RichText::new(format!("Keep {slot}")).small()).small();
        let keep = ui.add_enabled(scene.is_some(), keep);
        if keep
            .accessible_name(format!("keep as {slot}"))
            .on_hover_text(format!("Keeps the active scene as {slot}, in this panel"))
            .clicked()
            && let Some(scene) = scene
        {
            tuning.keep(place, scene);
        }
        let kept = tuning.slots[place].clone();
        let go = Button::selectable(active == Some(place), slot).frame_when_inactive(true);
        let go = ui
            .add_enabled(kept.is_some(), go)
            .accessible_name(format!("go to {slot}"));
        let nothing = format!("Nothing is kept as {slot} yet");
        if go
            .on_hover_text(format!("Activates {slot}"))
            .on_disabled_hover_text(nothing)
            .clicked()
            && let Some(kept) = kept
        {
            intents.push(tuning.load(slot, SceneRef::from(kept)));
        }
    }
    let next = active.map_or(0, |place| 1 - place);
    let other = tuning.slots[next].clone();
    let both = tuning.slots.iter().all(Option::is_some);
    let switch = ui
        .add_enabled(both, Button::new("A/B"))
        .accessible_name("switch between A and B");
    if switch
        .on_hover_text("Activates the other of the two")
        .on_disabled_hover_text("Switches between two scenes, once both are kept")
        .clicked()
        && let Some(other) = other
    {
        intents.push(tuning.load(SLOTS[next], SceneRef::from(other)));
    }
}

fn show_try(ui: &mut Ui, tuning: &mut Tuning) {
    let seconds = TRIAL.as_secs();
    let hint = format!(
        "While this is on, every change goes back by itself {seconds} s after it was made. It is this panel that \
         takes it \
         back: if you close it or it loses the daemon meanwhile, the change stays. A change that somebody else has \
         made \
         since is never taken back."
    );
    let toggle = Button::selectable(tuning.trial.is_on, format!("Try {seconds} s")).frame_when_inactive(true);
    if ui.add(toggle).accessible_name("try").on_hover_text(hint).clicked() {
        tuning.trial.is_on = !tuning.trial.is_on;
    }
}
