//! The recordings of a folder: length, scene and notes of each, and the way to open one.

use super::Listed;
use crate::dialogs;
use crate::drop_down::is_entered;
use crate::intent::{DialogPurpose, Intent};
use crate::model::Model;
use crate::theme::Palette;
use crate::view::View;
use egui::style::ScrollStyle;
use egui::{Button, Label, Response, RichText, ScrollArea, TextEdit, Ui};
use std::path::{Path, PathBuf};

/// Shows the folder, the field for any other file, and the list.
pub(super) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    show_opening(ui, &mut model.view, intents);
    let Model { tapes, view, .. } = model;
    let field = TextEdit::singleline(&mut view.folder);
    let field = show_path(ui, "Folder", field, "folder of recordings");
    ui.horizontal(|ui| {
        let asked = (DialogPurpose::Folder, view.folder.as_str());
        dialogs::browse_button(ui, "Browse...", "choose folder", asked, intents);
        let is_pressed = ui
            .button("Read again")
            .on_hover_text("Looks for new recordings in this folder")
            .clicked();
        // A half-typed folder is not there yet.
        if is_pressed || (!field.has_focus() && view.recordings.is_outdated(&view.folder)) {
            let folder = PathBuf::from(&view.folder);
            let known = view.recordings.ask(&folder);
            intents.push(Intent::List { folder, known });
        }
    });
    let opened = tapes.opened().map(|opened| opened.path.as_path());
    ui.spacing_mut().scroll = ScrollStyle::solid();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let listed = &view.recordings.listed;
        if let Some(why) = &view.recordings.problem {
            let color = Palette::of(ui).error_text;
            ui.add(Label::new(RichText::new(why).small().color(color)).wrap());
        } else if listed.is_empty() && !view.recordings.is_being_read {
            ui.label(RichText::new("No recording in this folder").small().weak());
        }
        for recording in listed {
            show_one(ui, recording, opened, intents);
        }
    });
}

fn show_opening(ui: &mut Ui, view: &mut View, intents: &mut Vec<Intent>) {
    let field = TextEdit::singleline(&mut view.open_path).hint_text("path, or drop it on the window");
    let field = show_path(ui, "File", field, "recording to open");
    ui.horizontal(|ui| {
        let path = &view.open_path;
        let near = if path.is_empty() { &view.folder } else { path };
        let asked = (DialogPurpose::Recording, near.as_str());
        dialogs::browse_button(ui, "Browse...", "choose recording", asked, intents);
        let is_typed = !path.trim().is_empty();
        let open = ui.add_enabled(is_typed, Button::new("Open recording"));
        if open.clicked() || (is_typed && is_entered(ui, &field)) {
            let path = PathBuf::from(path.trim());
            intents.push(Intent::Open { path });
        }
    });
}

/// A field for a path, which has all the width: its buttons are below.
fn show_path(ui: &mut Ui, label: &str, field: TextEdit<'_>, name: &str) -> Response {
    ui.horizontal(|ui| {
        ui.label(label);
        ui.add(field.desired_width(f32::INFINITY)).accessible_name(name)
    })
    .inner
}

fn show_one(ui: &mut Ui, recording: &Listed, opened: Option<&Path>, intents: &mut Vec<Intent>) {
    let name = recording.path.file_name().unwrap_or_default().to_string_lossy();
    let is_open = opened == Some(recording.path.as_path());
    let button = Button::selectable(is_open, name.as_ref()).truncate();
    let button = ui.add(button).accessible_name(format!("open {name}"));
    let about = recording.line();
    if button.on_hover_text(&about).clicked() {
        let path = recording.path.clone();
        intents.push(Intent::Open { path });
    }
    ui.indent(&recording.path, |ui| {
        let about = Label::new(RichText::new(&about).small().weak()).truncate();
        ui.add(about).on_hover_text(recording.line());
    });
}
