//! Recordings: to make one, and to look at one.

use crate::intent::Intent;
use crate::model::Model;
use crate::recording::RecordingNews;
use crate::theme::Palette;
use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{Button, Label, PopupCloseBehavior, RichText, TextEdit, Ui};
use haptic_lab::recording::{Ending, Totals};
use std::path::PathBuf;

/// Shows the buttons, and takes a file that was dropped on the window.
pub(crate) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    if matches!(model.recording(), Some(RecordingNews::Going { .. })) && model.is_connected() {
        let end = Button::new("End recording").fill(Palette::of(ui).caution);
        if ui.add(end).clicked() {
            intents.push(Intent::EndRecording);
        }
    } else {
        let metadata = model.metadata();
        let record = ui.add_enabled(metadata.is_some(), Button::new("Record"));
        let hint = format!("Every sample from now on, into a new file in {}", model.export_folder);
        let clicked = record
            .on_hover_text(hint)
            .on_disabled_hover_text("There is no rig to record")
            .clicked();
        if let Some(metadata) = metadata.filter(|_| clicked) {
            intents.push(Intent::Record {
                folder: PathBuf::from(&model.export_folder),
                metadata: Box::new(metadata),
            });
        }
    }
    if model.scope().is_of_recording() {
        if ui
            .button("Close recording")
            .on_hover_text("Shows the rig again")
            .clicked()
        {
            model.close_recording();
        }
    } else {
        show_opening(ui, model, intents);
    }
    let dropped = ui.input(|input| input.raw.dropped_files.first().map(|file| file.path().to_path_buf()));
    intents.extend(dropped.map(|path| Intent::Open { path }));
}

fn show_opening(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let menu = MenuButton::new("Open").config(config);
    let (button, _) = menu.ui(ui, |ui| {
        ui.label("A recording's file (dropping it on the window does the same):");
        let field = TextEdit::singleline(&mut model.open_path).desired_width(320.0);
        let field = ui.add(field).accessible_name("recording to open");
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        if ui.button("Open recording").clicked() || entered {
            let path = PathBuf::from(model.open_path.trim());
            intents.push(Intent::Open { path });
            ui.close();
        }
    });
    button.on_hover_text("Looks at a recording, with or without a rig");
}

/// What is being recorded, and what is looked at.
pub(crate) fn show_news(ui: &mut Ui, model: &Model) {
    let palette = Palette::of(ui);
    let plain = ui.visuals().text_color();
    let taken = model.recording().map(|news| match news {
        RecordingNews::Going { path, totals } => (
            format!("Recording {}: {}", path.display(), size(totals)),
            palette.caution_text,
        ),
        RecordingNews::Ended { path, totals } => (format!("Recorded {}: {}", path.display(), size(totals)), plain),
        RecordingNews::Failed { why } => (why.clone(), palette.error_text),
    });
    let opened = model.opened().map(|opened| match opened {
        Ok(opened) => {
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
            let is_whole = opened.ending == Ending::Complete;
            if !is_whole {
                text += &format!("; {}", opened.ending);
            }
            (text, if is_whole { plain } else { palette.caution_text })
        }
        Err(why) => (why.clone(), palette.error_text),
    });
    for (text, color) in taken.into_iter().chain(opened) {
        let line = Label::new(RichText::new(&text).small().color(color)).truncate();
        ui.add(line).on_hover_text(text);
    }
}

fn size(totals: &Totals) -> String {
    #[expect(clippy::cast_precision_loss, reason = "one decimal is shown")]
    let megabytes = totals.bytes as f64 / 1e6;
    let mut text = format!("{:.1} s, {megabytes:.1} MB", totals.length_s);
    if totals.lost > 0 {
        text += &format!(", {} samples missing", totals.lost);
    }
    text
}
