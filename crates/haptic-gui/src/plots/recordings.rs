//! The buttons to make a recording, to mark a moment of it, to open one, and to ask what another scene would have
//! felt like along it.

use crate::intent::Intent;
use crate::model::Model;
use crate::model::tapes::{Tapes, WhatIf};
use crate::model::view::View;
use crate::notice::{self, Notice};
use crate::recording::amount;
use crate::theme::Palette;
use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{Button, Key, Label, PopupCloseBehavior, RichText, TextEdit, Ui, Vec2, vec2};
use haptic_core::Scene;
use haptic_lab::recording::{Ending, Format, Metadata};
use std::path::PathBuf;

/// Size of the button that begins and ends a recording, for either name: its neighbours must not move.
const RECORD_SIZE: Vec2 = vec2(60.0, 0.0);

/// Size of the button of a what-if, for any name.
const WHAT_IF_SIZE: Vec2 = vec2(76.0, 0.0);

/// Width of the text of a marker, points.
const MARKER_WIDTH: f32 = 90.0;

/// The key that sets a marker.
const MARKER_KEY: Key = Key::M;

/// Shows the buttons, and takes a file that was dropped on the window.
pub(crate) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let Model { daemon, tapes, view } = model;
    if tapes.recording().is_some() && daemon.is_connected() {
        show_ending(ui, intents);
        show_marker(ui, tapes, view, intents);
    } else {
        show_beginning(ui, daemon.metadata(), view, intents);
    }
    if tapes.opened().is_some() {
        if ui
            .button("Close recording")
            .on_hover_text("Shows the rig again")
            .clicked()
        {
            intents.push(Intent::CancelWhatIf);
            tapes.close();
            view.scope.close();
        }
        show_what_if(ui, daemon.scene.active.as_ref(), tapes, intents);
    } else {
        show_opening(ui, view, intents);
    }
    let dropped = ui.input(|input| input.raw.dropped_files.first().map(|file| file.path().to_path_buf()));
    intents.extend(dropped.map(|path| Intent::Open { path }));
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

/// The button and the key that set a marker, and its text.
fn show_marker(ui: &mut Ui, tapes: &mut Tapes, view: &mut View, intents: &mut Vec<Intent>) {
    let count = tapes.recording().map_or(0, |recording| recording.markers.len());
    let next = format!("marker {}", count + 1);
    let button = ui.button(format!("Mark ({})", MARKER_KEY.name()));
    let button = button.on_hover_text("Marks this moment in the recording and on the time axis");
    let field = TextEdit::singleline(&mut view.marker_text)
        .hint_text(&next)
        .desired_width(MARKER_WIDTH);
    let field = ui.add(field).accessible_name("text of the marker");
    let entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
    // In a text field the key is a letter.
    let by_key =
        !ui.ctx().text_edit_focused() && ui.input_mut(|input| input.consume_key(egui::Modifiers::NONE, MARKER_KEY));
    if button.clicked() || entered || by_key {
        let typed = view.marker_text.trim();
        let text = if typed.is_empty() { next } else { typed.to_owned() };
        if let Some(tick) = tapes.set_marker(&text) {
            view.marker_text.clear();
            intents.push(Intent::Marker { tick, text });
        }
    }
}

/// The button that begins a recording, and the choice of its format.
fn show_beginning(ui: &mut Ui, metadata: Option<Metadata>, view: &mut View, intents: &mut Vec<Intent>) {
    let record = ui.add_enabled(metadata.is_some(), Button::new("Record").min_size(RECORD_SIZE));
    let ending = view.recording_format.ending();
    let hint = format!(
        "Every sample from now on, into a new .{ending} file in {}",
        view.export_folder
    );
    let clicked = record
        .on_hover_text(hint)
        .on_disabled_hover_text("There is no rig to record")
        .clicked();
    if let Some(mut metadata) = metadata.filter(|_| clicked) {
        let notes = view.recording_notes.trim();
        metadata.notes = (!notes.is_empty()).then(|| notes.to_owned());
        intents.push(Intent::Record {
            folder: PathBuf::from(&view.export_folder),
            format: view.recording_format,
            metadata: Box::new(metadata),
        });
    }
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let menu = MenuButton::new(format!(".{ending}")).config(config);
    let (button, _) = menu.ui(ui, |ui| {
        ui.label("A recording's file is");
        for format in Format::ALL {
            let what = match format {
                Format::Mcap => "for robotics tools; it survives a crash best",
                Format::Csv => "text, for everything",
                Format::Parquet => "for data frames; the smallest",
            };
            let text = format!(".{} ({what})", format.ending());
            ui.radio_value(&mut view.recording_format, format, text);
        }
        ui.label("Notes in it (the space bar is Stop; pasted text may have spaces):");
        let field = TextEdit::multiline(&mut view.recording_notes)
            .desired_rows(2)
            .desired_width(320.0);
        ui.add(field).accessible_name("notes of the recording");
    });
    let button = button.accessible_name("format and notes");
    button.on_hover_text("The format of the next recording, and notes in it");
}

/// What the scene that is edited would have felt like along the opened recording.
fn show_what_if(ui: &mut Ui, scene: Option<&Scene>, tapes: &mut Tapes, intents: &mut Vec<Intent>) {
    let (text, name, hint) = match tapes.what_if() {
        WhatIf::None => (
            "What if...",
            "What if...",
            "Shows which force the scene at the left would have given along this motion. The hand moves as recorded: \
             it does not react to the other force.",
        ),
        WhatIf::Asked => ("Cancel", "Cancel what-if", "Gives the rendering up"),
        WhatIf::Shown(_) => ("Hide", "Hide what-if", "Shows the recording alone"),
    };
    let is_none = matches!(tapes.what_if(), WhatIf::None);
    let button = Button::new(text).min_size(WHAT_IF_SIZE);
    let button = ui.add_enabled(!is_none || scene.is_some(), button);
    let button = button
        .accessible_name(name)
        .on_hover_text(hint)
        .on_disabled_hover_text("It needs a daemon, whose scene is edited here and rendered along the recording");
    if !button.clicked() {
        return;
    }
    if !is_none {
        tapes.end_what_if();
        intents.push(Intent::CancelWhatIf);
        return;
    }
    let path = tapes.opened().map(|opened| opened.path.clone());
    if let (Some(path), Some(scene)) = (path, scene) {
        intents.push(Intent::WhatIf {
            number: tapes.ask_what_if(),
            path,
            scene: Box::new(scene.clone()),
        });
    }
}

fn show_opening(ui: &mut Ui, view: &mut View, intents: &mut Vec<Intent>) {
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let menu = MenuButton::new("Open").config(config);
    let (button, _) = menu.ui(ui, |ui| {
        ui.label("A recording's file (dropping it on the window does the same):");
        let field = TextEdit::singleline(&mut view.open_path).desired_width(320.0);
        let field = ui.add(field).accessible_name("recording to open");
        if std::mem::take(&mut view.open_was_pressed) {
            field.request_focus();
        }
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        if ui.button("Open recording").clicked() || entered {
            let path = PathBuf::from(view.open_path.trim());
            intents.push(Intent::Open { path });
            ui.close();
        }
    });
    if button
        .on_hover_text("Looks at a recording, with or without a rig")
        .clicked()
    {
        view.open_was_pressed = true;
        ui.ctx().request_repaint();
    }
}

/// Shows the recording that is written, the one that is open, and the outcome of the last file.
pub(crate) fn show_news(ui: &mut Ui, tapes: &Tapes, notice: &mut Option<Notice>) {
    let palette = Palette::of(ui);
    let written = tapes.recording().map(|written| {
        let text = format!("Recording {}: {}", written.path.display(), amount(&written.totals));
        if written.lost == 0 {
            return (text, palette.caution_text);
        }
        let text = format!("The disk does not keep up: {} samples lost. {text}", written.lost);
        (text, palette.error_text)
    });
    let opened = tapes.opened().map(|opened| {
        let mut text = format!(
            "Looking at {}: {} of {}, scene {}",
            opened.path.display(),
            opened.metadata.server,
            opened.metadata.device,
            opened.metadata.scene.name
        );
        if let Some(notes) = &opened.metadata.notes {
            text += &format!(" ({notes})");
        }
        if opened.lost > 0 {
            text += &format!(", {} samples missing", opened.lost);
        }
        if opened.ending == Ending::Complete {
            return (text, ui.visuals().text_color());
        }
        text += &format!("; {}", opened.ending);
        (text, palette.caution_text)
    });
    let what_if = match tapes.what_if() {
        WhatIf::Shown(what_if) => Some((what_if.line(), palette.law)),
        WhatIf::None | WhatIf::Asked => None,
    };
    for (text, color) in written.into_iter().chain(opened).chain(what_if) {
        let line = Label::new(RichText::new(&text).small().color(color)).truncate();
        ui.add(line).on_hover_text(text);
    }
    notice::show(ui, notice);
}
