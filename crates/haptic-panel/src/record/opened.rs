//! The opened recording: what it says of itself, and what another scene would have felt like along it.

use super::Opened;
use crate::intent::Intent;
use crate::model::Model;
use crate::tapes::{Tapes, WhatIf};
use crate::theme::Palette;
use crate::words::shortened;
use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{Button, Color32, PopupCloseBehavior, RichText, ScrollArea, Ui, Vec2, vec2};
use haptic_core::scene::SceneFile;
use haptic_ipc::{BUILT_IN_SCENES, DaemonMirror};
use haptic_recording::Ending;

/// Size of the button of a what-if, for any name.
const WHAT_IF_SIZE: Vec2 = vec2(76.0, 0.0);

/// Largest height of the list of scenes, points.
const SCENES_HEIGHT: f32 = 320.0;

/// Shows its buttons and its lines.
pub(super) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let Model { daemon, tapes, .. } = model;
    let Some(opened) = tapes.opened() else { return };
    let (text, color) = line(ui, opened);
    ui.horizontal(|ui| {
        let close = ui.button("Close recording");
        let is_closed = close.on_hover_text("Shows the rig again").clicked();
        show_what_if(ui, &daemon.mirror, tapes, intents);
        shortened(ui, RichText::new(&text).small().color(color), &text);
        if is_closed {
            intents.push(Intent::CancelWhatIf);
            tapes.close();
        }
    });
    // Its line is there before it, so that the plots stay where they are.
    let text = match &tapes.what_if {
        WhatIf::Shown(what_if) => what_if.line(),
        WhatIf::Fetching | WhatIf::Asked => "Rendering...".to_owned(),
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
fn show_what_if(ui: &mut Ui, daemon: &DaemonMirror, tapes: &mut Tapes, intents: &mut Vec<Intent>) {
    let (text, name, hint) = match &tapes.what_if {
        WhatIf::None => {
            let chosen = choose_scene(ui, daemon);
            let path = tapes.opened().map(|opened| opened.path.clone());
            let Some((path, chosen)) = path.zip(chosen) else { return };
            intents.push(match chosen {
                Chosen::Saved(name) => Intent::WhatIfSaved {
                    number: tapes.fetch_what_if(),
                    path,
                    name,
                },
                Chosen::Scene(scene) => Intent::WhatIf {
                    number: tapes.ask_what_if(),
                    path,
                    scene,
                },
            });
            return;
        }
        WhatIf::Fetching | WhatIf::Asked => ("Cancel", "Cancel what-if", "Gives the rendering up"),
        WhatIf::Shown(_) => ("Hide", "Hide what-if", "Shows the recording alone"),
    };
    let button = ui.add(Button::new(text).min_size(WHAT_IF_SIZE));
    if button.accessible_name(name).on_hover_text(hint).clicked() {
        tapes.end_what_if();
        intents.push(Intent::CancelWhatIf);
    }
}

/// What to render along a recording.
enum Chosen {
    /// A scene, or its own ones.
    Scene(Option<Box<SceneFile>>),
    /// A scene of the daemon's library.
    Saved(String),
}

/// The menu of the scenes to render: the active one, those of the recording, and those of the library.
fn choose_scene(ui: &mut Ui, daemon: &DaemonMirror) -> Option<Chosen> {
    let active = daemon.scene.whole.as_ref();
    let mut chosen = None;
    let button = Button::new("What if...").min_size(WHAT_IF_SIZE);
    // A click on its scroll bar does not close it.
    let stays = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let (button, _) = MenuButton::from_button(button).config(stays).ui(ui, |ui| {
        ui.label(RichText::new("The force along this motion with").small());
        let name = active.map_or_else(
            || "the active scene".to_owned(),
            |scene| format!("{} (active)", scene.name),
        );
        let item = ui.add_enabled(active.is_some(), Button::new(name));
        let item = item.on_disabled_hover_text("It needs a daemon");
        if item.accessible_name("what if: active scene").clicked() {
            chosen = active.map(|scene| Chosen::Scene(Some(Box::new(scene.clone().into()))));
        }
        let item = ui.button("the recording's own scenes");
        let item = item.on_hover_text("A replay: the force is computed again from what was measured");
        if item.accessible_name("what if: own scenes").clicked() {
            chosen = Some(Chosen::Scene(None));
        }
        ui.separator();
        let is_chosen = |ui: &mut Ui, name: &str| {
            let item = ui.button(name).accessible_name(format!("what if: {name}"));
            item.clicked()
        };
        ScrollArea::vertical().max_height(SCENES_HEIGHT).show(ui, |ui| {
            for (name, text) in BUILT_IN_SCENES {
                if is_chosen(ui, name) {
                    let scene = toml::from_str(text).ok().map(Box::new);
                    chosen = scene.map(|scene| Chosen::Scene(Some(scene)));
                }
            }
            // Those that are built in have no file.
            let saved = daemon.library.iter().filter(|listed| listed.path.is_some());
            for listed in saved.filter(|listed| listed.problem.is_none()) {
                if is_chosen(ui, &listed.name) {
                    chosen = Some(Chosen::Saved(listed.name.clone()));
                }
            }
        });
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
