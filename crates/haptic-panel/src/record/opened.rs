//! The opened recording: what it says of itself, and what another scene would have felt like along it.

use super::Opened;
use crate::intent::Intent;
use crate::model::Model;
use crate::tapes::{Tapes, WhatIf};
use crate::theme::Palette;
use crate::wording::shortened;
use egui::containers::menu::MenuButton;
use egui::{Button, Color32, RichText, Ui, Vec2, vec2};
use haptic_core::Scene;
use haptic_core::scene::SceneFile;
use haptic_ipc::BUILT_IN_SCENES;
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
        show_what_if(ui, daemon.mirror.scene.whole.as_ref(), tapes, intents);
        shortened(ui, RichText::new(&text).small().color(color), &text);
        if is_closed {
            intents.push(Intent::CancelWhatIf);
            tapes.close();
        }
    });
    // Its line is there before it, so that the plots stay where they are.
    let text = match tapes.what_if() {
        WhatIf::Shown(what_if) => what_if.line(),
        WhatIf::Asked => "Rendering...".to_owned(),
        WhatIf::None => " ".to_owned(),
    };
    let line = RichText::new(&text).small().color(Palette::of(ui).law);
    shortened(ui, line, &text);
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

/// The recording computed again, or what another scene would have felt like along it.
fn show_what_if(ui: &mut Ui, active: Option<&Scene>, tapes: &mut Tapes, intents: &mut Vec<Intent>) {
    let (text, name, hint) = match tapes.what_if() {
        WhatIf::None => {
            let chosen = choose_scene(ui, active);
            let path = tapes.opened().map(|opened| opened.path.clone());
            if let (Some(path), Some(scene)) = (path, chosen) {
                let number = tapes.ask_what_if();
                intents.push(Intent::WhatIf { number, path, scene });
            }
            return;
        }
        WhatIf::Asked => ("Cancel", "Cancel what-if", "Gives the rendering up"),
        WhatIf::Shown(_) => ("Hide", "Hide what-if", "Shows the recording alone"),
    };
    let button = ui.add(Button::new(text).min_size(WHAT_IF_SIZE));
    if button.accessible_name(name).on_hover_text(hint).clicked() {
        tapes.end_what_if();
        intents.push(Intent::CancelWhatIf);
    }
}

/// The menu of the scenes to render: the active one, those of the recording, and those that every library has.
#[expect(clippy::option_option, reason = "nothing chosen, or the recording's own scenes")]
fn choose_scene(ui: &mut Ui, active: Option<&Scene>) -> Option<Option<Box<Scene>>> {
    let mut chosen = None;
    let menu = MenuButton::from_button(Button::new("What if...").min_size(WHAT_IF_SIZE));
    let (button, _) = menu.ui(ui, |ui| {
        ui.label(RichText::new("The force along this motion with").small());
        let name = active.map_or_else(
            || "the active scene".to_owned(),
            |scene| format!("{} (active)", scene.name),
        );
        let item = ui.add_enabled(active.is_some(), Button::new(name));
        let item = item
            .on_hover_text("Another scene of the library is active once you pick it on Tune")
            .on_disabled_hover_text("It needs a daemon");
        if item.accessible_name("what if: active scene").clicked() {
            chosen = active.map(|scene| Some(Box::new(scene.clone())));
        }
        let item = ui.button("the recording's own scenes");
        let item = item.on_hover_text("A replay: the force is computed again from what was measured");
        if item.accessible_name("what if: own scenes").clicked() {
            chosen = Some(None);
        }
        ui.separator();
        for (name, text) in BUILT_IN_SCENES {
            let item = ui.button(*name).accessible_name(format!("what if: {name}"));
            if item.clicked() {
                let file = toml::from_str::<SceneFile>(text).ok();
                chosen = file.map(|file| Some(Box::new(file.on(None))));
            }
        }
        if chosen.is_some() {
            ui.close();
        }
    });
    button.on_hover_text(
        "Shows which force a scene would have given along this motion. The hand moves as recorded: it does not react \
         to the other force.",
    );
    chosen
}
