//! The controls that make a recording and mark moments of it.

use crate::intent::Intent;
use crate::model::Model;
use crate::tapes::Tapes;
use crate::theme::Palette;
use crate::view::View;
use egui::{Button, Key, Modifiers, RichText, TextEdit, Ui, Vec2, vec2};
use haptic_recording::{Format, Metadata};
use std::path::PathBuf;

/// Size of the button that begins and ends a recording, for either name: its neighbours must not move.
const RECORD_SIZE: Vec2 = vec2(72.0, 28.0);

const MARKER_KEY: Key = Key::M;

/// Sets a marker by its key, on every page. In a text field the key is a letter.
pub(crate) fn take_marker_key(ui: &Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let Model { tapes, view, .. } = model;
    if tapes.recording().is_some()
        && !ui.ctx().text_edit_focused()
        && ui.input_mut(|input| input.consume_key(Modifiers::NONE, MARKER_KEY))
    {
        mark(tapes, view, intents);
    }
}

pub(super) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let Model { daemon, tapes, view } = model;
    ui.horizontal(|ui| {
        if tapes.recording().is_some() && daemon.is_connected() {
            show_ending(ui, intents);
        } else {
            show_beginning(ui, daemon.metadata(), view, intents);
        }
        for format in Format::ALL {
            let what = match format {
                Format::Mcap => "For robotics tools; it survives a crash best",
                Format::Csv => "Text, for everything",
                Format::Parquet => "For data frames; the smallest",
            };
            ui.selectable_value(&mut view.recording_format, format, format.ending())
                .on_hover_text(what);
        }
    });
    ui.horizontal(|ui| show_marker(ui, tapes, view, intents));
    let field = TextEdit::multiline(&mut view.recording_notes)
        .hint_text("Notes for the next recording")
        .desired_rows(2)
        .desired_width(f32::INFINITY);
    ui.add(field).accessible_name("notes of the recording");
}

fn show_ending(ui: &mut Ui, intents: &mut Vec<Intent>) {
    let palette = Palette::of(ui);
    let end = RichText::new("End").color(palette.on_fill);
    let end = Button::new(end).fill(palette.caution).min_size(RECORD_SIZE);
    let end = ui.add(end).accessible_name("End recording");
    if end.on_hover_text("Ends the recording").clicked() {
        intents.push(Intent::EndRecording);
    }
}

fn show_beginning(ui: &mut Ui, metadata: Option<Metadata>, view: &View, intents: &mut Vec<Intent>) {
    let record = ui.add_enabled(metadata.is_some(), Button::new("Record").min_size(RECORD_SIZE));
    let ending = view.recording_format.ending();
    let hint = format!("Every sample from now on, into a new .{ending} file in {}", view.folder);
    let clicked = record
        .on_hover_text(hint)
        .on_disabled_hover_text("There is no rig to record")
        .clicked();
    if let Some(mut metadata) = metadata.filter(|_| clicked) {
        let notes = view.recording_notes.trim();
        metadata.notes = (!notes.is_empty()).then(|| notes.to_owned());
        intents.push(Intent::Record {
            folder: PathBuf::from(&view.folder),
            format: view.recording_format,
            metadata: Box::new(metadata),
        });
    }
}

/// The button that sets a marker, and its text.
fn show_marker(ui: &mut Ui, tapes: &mut Tapes, view: &mut View, intents: &mut Vec<Intent>) {
    let is_recording = tapes.recording().is_some();
    let button = Button::new(format!("Mark ({})", MARKER_KEY.name()));
    let button = ui
        .add_enabled(is_recording, button)
        .on_hover_text("Marks this moment in the recording and on the time axis")
        .on_disabled_hover_text("Nothing is recorded");
    let field = TextEdit::singleline(&mut view.marker_text)
        .hint_text(next_marker(tapes))
        .desired_width(f32::INFINITY);
    let field = ui
        .add_enabled(is_recording, field)
        .accessible_name("text of the marker");
    let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
    if button.clicked() || is_entered {
        mark(tapes, view, intents);
    }
}

/// The text of a marker that is given none.
fn next_marker(tapes: &Tapes) -> String {
    let count = tapes.recording().map_or(0, |recording| recording.markers);
    format!("marker {}", count + 1)
}

fn mark(tapes: &mut Tapes, view: &mut View, intents: &mut Vec<Intent>) {
    let typed = view.marker_text.trim();
    let text = if typed.is_empty() {
        next_marker(tapes)
    } else {
        typed.to_owned()
    };
    if let Some(tick) = tapes.set_marker(&text) {
        view.marker_text.clear();
        intents.push(Intent::Marker { tick, text });
    }
}
