//! The opened recording: what it says of itself, and what another scene would have felt like along it.

use crate::intent::Intent;
use crate::model::Model;
use crate::model::tapes::{Tapes, WhatIf};
use crate::recording::Opened;
use crate::theme::Palette;
use egui::{Button, Color32, Label, RichText, Ui, Vec2, vec2};
use haptic_core::Scene;
use haptic_recording::Ending;

/// Size of the button of a what-if, for any name.
const WHAT_IF_SIZE: Vec2 = vec2(76.0, 0.0);

/// Shows its buttons and its lines.
pub(super) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let Model { daemon, tapes, .. } = model;
    let Some(opened) = tapes.opened() else { return };
    let (text, color) = line(ui, opened);
    ui.horizontal(|ui| {
        let close = ui.button("Close recording");
        let is_closed = close.on_hover_text("Shows the rig again").clicked();
        show_what_if(ui, daemon.scene.active.as_ref(), tapes, intents);
        let line = Label::new(RichText::new(&text).small().color(color)).truncate();
        ui.add(line).on_hover_text(text);
        if is_closed {
            intents.push(Intent::CancelWhatIf);
            tapes.close();
        }
    });
    if let WhatIf::Shown(what_if) = tapes.what_if() {
        let text = what_if.line();
        let color = Palette::of(ui).law;
        let line = Label::new(RichText::new(&text).small().color(color)).truncate();
        ui.add(line).on_hover_text(text);
    }
}

/// What the recording says of itself, in a colour that says whether it is whole.
fn line(ui: &Ui, opened: &Opened) -> (String, Color32) {
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
    (text, Palette::of(ui).caution_text)
}

/// What the active scene would have felt like along the opened recording.
fn show_what_if(ui: &mut Ui, scene: Option<&Scene>, tapes: &mut Tapes, intents: &mut Vec<Intent>) {
    let (text, name, hint) = match tapes.what_if() {
        WhatIf::None => (
            "What if...",
            "What if...",
            "Shows which force the active scene would have given along this motion. The hand moves as recorded: \
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
        .on_disabled_hover_text("It needs a daemon, whose active scene is rendered along the recording");
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
