//! A note on a moment of the rig: a key takes the moment, and a small field its text.

use crate::drop_down::is_entered;
use crate::intent::Intent;
use crate::model::Model;
use crate::view::NoteField;
use egui::text_edit::TextEditState;
use egui::{Align2, Area, Event, Frame, Id, InputState, Key, Order, TextEdit, Ui, vec2};

/// The key that takes the moment.
const NOTE_KEY: Key = Key::N;

/// Distance of the field from the lower edge of the window, points.
const ABOVE_EDGE: f32 = 60.0;

/// Width of the field, points.
const WIDTH: f32 = 320.0;

fn field_id() -> Id {
    Id::unique("note")
}

/// Takes the key, on every page: it begins a note, or continues the one that is not set yet. In a text field the key
/// is a letter.
pub(crate) fn take_key(ui: &Ui, model: &mut Model) {
    let Model { tapes, view, .. } = model;
    let newest = tapes.newest();
    let may_take = (view.note.is_some() || newest.is_some()) && !ui.ctx().text_edit_focused();
    if may_take && let Some(typed) = ui.input_mut(take_press) {
        let note = view.note.get_or_insert_with(|| NoteField {
            tick: newest.map(|newest| newest.tick),
            text: String::new(),
            wants_keyboard: true,
        });
        note.text += &typed;
        note.wants_keyboard = true;
    }
}

/// Removes a press of the key, and what is typed behind it before the field is there; returns that.
fn take_press(input: &mut InputState) -> Option<String> {
    let is_press = |event: &Event| matches!(event, Event::Key { key: NOTE_KEY, pressed: true, modifiers, .. } if !modifiers.any() || modifiers.shift_only());
    let press = input.events.iter().position(is_press)?;
    let typed: String = input
        .events
        .extract_if(press.., |event| matches!(event, Event::Key { .. } | Event::Text(_)))
        .filter_map(|event| match event {
            Event::Text(text) => Some(text),
            _ => None,
        })
        .collect();
    // The first letter is the key's own.
    Some(typed.chars().skip(1).collect())
}

/// Shows the field until Enter sets the note, or an empty field loses the keyboard: no note is lost by a stop, another
/// page or another daemon.
pub(crate) fn show(ui: &Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let Model { tapes, view, .. } = model;
    let Some(note) = &mut view.note else { return };
    let area = Area::new(Id::unique("note area"))
        .order(Order::Foreground)
        .anchor(Align2::CENTER_BOTTOM, vec2(0.0, -ABOVE_EDGE));
    let shown = area.show(ui.ctx(), |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            let field = TextEdit::singleline(&mut note.text)
                .id(field_id())
                .hint_text("A note on this moment, set by Enter")
                .desired_width(WIDTH);
            let field = ui.add(field).accessible_name("note on this moment");
            if std::mem::take(&mut note.wants_keyboard) {
                field.request_focus();
            }
            (field.lost_focus(), is_entered(ui, &field))
        })
    });
    let (has_left, is_entered) = shown.inner.inner;
    let text = note.text.trim();
    let set_at = note.tick.or_else(|| tapes.newest().map(|newest| newest.tick));
    match set_at.filter(|_| is_entered) {
        _ if !has_left => return,
        _ if text.is_empty() => {}
        None => return,
        Some(tick) => {
            let text = text.to_owned();
            if tapes.note(tick, &text) {
                intents.push(Intent::Marker { tick, text });
            }
        }
    }
    view.note = None;
    // Nobody types into a field that is gone.
    ui.ctx().data_mut(|data| data.remove::<TextEditState>(field_id()));
}
