//! The buttons to make a recording and to open one.

use crate::intent::Intent;
use crate::model::Model;
use crate::model::tapes::Tapes;
use crate::model::view::View;
use crate::notice::{self, Notice};
use crate::recording::amount;
use crate::theme::Palette;
use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{Button, Label, PopupCloseBehavior, RichText, TextEdit, Ui, Vec2, vec2};
use haptic_lab::recording::Ending;
use std::path::PathBuf;

/// Size of the button that begins and ends a recording, for either name: its neighbours must not move.
const RECORD_SIZE: Vec2 = vec2(60.0, 0.0);

/// Shows the buttons, and takes a file that was dropped on the window.
pub(crate) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let Model { daemon, tapes, view } = model;
    if tapes.recording().is_some() && daemon.is_connected() {
        let palette = Palette::of(ui);
        let end = RichText::new("End").color(palette.on_fill);
        let end = Button::new(end).fill(palette.caution).min_size(RECORD_SIZE);
        let end = ui.add(end).accessible_name("End recording");
        if end.on_hover_text("Ends the recording").clicked() {
            intents.push(Intent::EndRecording);
        }
    } else {
        let metadata = daemon.metadata();
        let record = ui.add_enabled(metadata.is_some(), Button::new("Record").min_size(RECORD_SIZE));
        let hint = format!("Every sample from now on, into a new file in {}", view.export_folder);
        let clicked = record
            .on_hover_text(hint)
            .on_disabled_hover_text("There is no rig to record")
            .clicked();
        if let Some(metadata) = metadata.filter(|_| clicked) {
            intents.push(Intent::Record {
                folder: PathBuf::from(&view.export_folder),
                metadata: Box::new(metadata),
            });
        }
    }
    if tapes.opened().is_some() {
        if ui
            .button("Close recording")
            .on_hover_text("Shows the rig again")
            .clicked()
        {
            tapes.close();
            view.scope.close();
        }
    } else {
        show_opening(ui, view, intents);
    }
    let dropped = ui.input(|input| input.raw.dropped_files.first().map(|file| file.path().to_path_buf()));
    intents.extend(dropped.map(|path| Intent::Open { path }));
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
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
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
        if opened.lost > 0 {
            text += &format!(", {} samples missing", opened.lost);
        }
        if opened.ending == Ending::Complete {
            return (text, ui.visuals().text_color());
        }
        text += &format!("; {}", opened.ending);
        (text, palette.caution_text)
    });
    for (text, color) in written.into_iter().chain(opened) {
        let line = Label::new(RichText::new(&text).small().color(color)).truncate();
        ui.add(line).on_hover_text(text);
    }
    notice::show(ui, notice);
}
