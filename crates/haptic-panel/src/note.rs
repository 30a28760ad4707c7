//! A note on a moment of the rig: a key takes the moment, and a small field its text.

use crate::intent::Intent;
use crate::model::Model;
use crate::model::view::NoteField;
use egui::{Align2, Area, Frame, Key, Modifiers, Order, TextEdit, Ui, vec2};

/// The key that takes the moment.
const NOTE_KEY: Key = Key::N;

/// Distance of the field from the lower edge of the window, points.
const ABOVE_EDGE: f32 = 60.0;

/// Width of the field, points.
const WIDTH: f32 = 320.0;

/// Takes the key, on every page, and shows the field until Enter sets the note. In a text field the key is a
/// letter. A stop closes the field.
pub(crate) fn show(ui: &Ui, model: &mut Model, is_stopped: bool, intents: &mut Vec<Intent>) {
    let Model { tapes, view, .. } = model;
    if is_stopped {
        view.note = None;
    }
    let may_begin = view.note.is_none() && !ui.ctx().text_edit_focused();
    if may_begin && ui.input_mut(|input| input.consume_key(Modifiers::NONE, NOTE_KEY)) {
        let tick = tapes.newest().map(|newest| newest.tick);
        view.note = tick.map(|tick| NoteField {
            tick,
            text: String::new(),
            is_new: true,
        });
    }
    let Some(note) = &mut view.note else { return };
    let area = Area::new(egui::Id::unique("note"))
        .order(Order::Foreground)
        .anchor(Align2::CENTER_BOTTOM, vec2(0.0, -ABOVE_EDGE));
    let shown = area.show(ui.ctx(), |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            let hint = "A note on this moment, set by Enter (Space is Stop; pasted text may have spaces)";
            let field = TextEdit::singleline(&mut note.text)
                .hint_text(hint)
                .desired_width(WIDTH);
            let field = ui.add(field).accessible_name("note on this moment");
            if std::mem::take(&mut note.is_new) {
                field.request_focus();
            }
            let is_entered = ui.input(|input| input.key_pressed(Key::Enter));
            (field.lost_focus(), is_entered)
        })
    });
    let (has_left, is_entered) = shown.inner.inner;
    if !has_left {
        return;
    }
    let text = note.text.trim().to_owned();
    let tick = note.tick;
    view.note = None;
    if is_entered && !text.is_empty() && tapes.note(tick, &text) {
        intents.push(Intent::Marker { tick, text });
    }
}
