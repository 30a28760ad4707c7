//! Scenes to load, to save and to compare with.

use super::model::{Comparison, SceneModel};
use super::tools::SLOTS;
use crate::intent::Intent;
use crate::theme::Palette;
use egui::{Button, CollapsingHeader, ComboBox, DragValue, Label, RichText, TextEdit, Ui};
use haptic_ipc::SceneRef;

/// Shows the library and what can be done with it.
pub(crate) fn show(ui: &mut Ui, scene: &mut SceneModel, intents: &mut Vec<Intent>) {
    let title = CollapsingHeader::new("Scenes").default_open(false).show(ui, |ui| {
        show_presets(ui, scene, intents);
        show_saving(ui, scene, intents);
        show_comparison(ui, scene, intents);
    });
    title.header_response.on_hover_text("Load, save, compare");
}

fn show_presets(ui: &mut Ui, scene: &mut SceneModel, intents: &mut Vec<Intent>) {
    ui.horizontal(|ui| {
        ui.label("Go there over");
        let ramp = DragValue::new(&mut scene.ramp_ms)
            .range(0.0..=10_000.0)
            .speed(10.0)
            .suffix(" ms");
        ui.add(ramp)
            .accessible_name("ramp")
            .on_hover_text("Time over which a scene is loaded; 0 is between two ticks, and no jerk either");
    });
    if scene.library.is_empty() {
        ui.label(RichText::new("The daemon has no library of scenes").small().weak());
    }
    for listed in &scene.library {
        ui.horizontal(|ui| {
            let load = Button::new(RichText::new("Load").small()).small();
            let load = ui.add_enabled(listed.problem.is_none(), load);
            if load.accessible_name(format!("load {}", listed.name)).clicked() {
                intents.push(scene.load(&listed.name, SceneRef::Name(listed.name.clone())));
            }
            let name = ui.add(Label::new(&listed.name).truncate());
            let place = listed.path.as_deref().unwrap_or("comes with the daemon");
            let about = format!("{}\nLaw: {}\n{place}", listed.title, listed.law);
            name.on_hover_text(about);
            if let Some(problem) = &listed.problem {
                let color = Palette::of(ui).error_text;
                ui.add(Label::new(RichText::new(problem).small().color(color)).truncate());
            }
        });
    }
}

fn show_saving(ui: &mut Ui, scene: &mut SceneModel, intents: &mut Vec<Intent>) {
    ui.horizontal(|ui| {
        let field = TextEdit::singleline(&mut scene.save_as)
            .desired_width(150.0)
            .hint_text("name");
        ui.add(field).accessible_name("name to save as");
        let name = scene.save_as.trim();
        let save = ui.add_enabled(!name.is_empty(), Button::new("Save"));
        if save
            .on_hover_text("Keeps the scene in force in the daemon's library")
            .accessible_name("save scene")
            .clicked()
        {
            intents.push(Intent::Save {
                name: name.to_owned(),
                replace: false,
            });
        }
        if let Some(taken) = scene.would_replace.clone()
            && ui.button(format!("Replace {taken}")).clicked()
        {
            scene.would_replace = None;
            intents.push(Intent::Save {
                name: taken,
                replace: true,
            });
        }
    });
}

/// Everything that the scene in force can be compared with.
fn comparable(scene: &SceneModel) -> Vec<(String, SceneRef)> {
    let slots = SLOTS.into_iter().zip(&scene.slots);
    let slots = slots.filter_map(|(name, slot)| Some((name.to_owned(), SceneRef::Scene(Box::new(slot.clone()?)))));
    let library = scene.library.iter().filter(|listed| listed.problem.is_none());
    let library = library.map(|listed| (listed.name.clone(), SceneRef::Name(listed.name.clone())));
    let newest = scene.revision.unwrap_or(0);
    let oldest = newest.saturating_sub(20).max(1);
    let revisions = (oldest..newest).rev();
    let revisions = revisions.map(|revision| (format!("revision {revision}"), SceneRef::Revision(revision)));
    slots.chain(library).chain(revisions).collect()
}

fn show_comparison(ui: &mut Ui, scene: &SceneModel, intents: &mut Vec<Intent>) {
    ui.horizontal(|ui| {
        ui.label("Compare with");
        let shown = scene
            .comparison
            .as_ref()
            .map_or("choose", |comparison| comparison.with.as_str());
        let combo = ComboBox::from_id_salt("compare").width(150.0).selected_text(shown);
        let chosen = combo.show_ui(ui, |ui| {
            for (what, other) in comparable(scene) {
                if ui.selectable_label(what == shown, &what).clicked() {
                    intents.push(Intent::Compare { what, scene: other });
                }
            }
        });
        chosen.response.accessible_name("compare with");
    });
    let Some(Comparison { with, result }) = &scene.comparison else {
        return;
    };
    match result {
        Ok(differences) if differences.is_empty() => {
            ui.label(RichText::new(format!("No difference from {with}")).small());
        }
        Ok(differences) => {
            for difference in differences {
                ui.add(Label::new(RichText::new(difference.to_string()).small()).wrap());
            }
        }
        Err(why) => {
            let color = Palette::of(ui).error_text;
            ui.add(Label::new(RichText::new(why).small().color(color)).wrap());
        }
    }
}
