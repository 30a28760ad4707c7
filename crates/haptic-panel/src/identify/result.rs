//! What was identified, and what is done with it.

use super::Found;
use super::fit::{Fitting, Foreseen, Progress};
use crate::intent::Intent;
use crate::model::Model;
use crate::theme::Palette;
use crate::tune::TRIAL;
use egui::{Button, CollapsingHeader, Grid, Label, RichText, Ui};
use haptic_core::Scene;
use haptic_lab::identify::in_words;

/// Shows it; `active` is the scene on the rig.
pub(super) fn show(ui: &mut Ui, found: &Found, active: Option<&Scene>) {
    let Found { origin, identified, .. } = found;
    ui.separator();
    let model = identified.model.name();
    let heading = format!("{model}, {}", identified.residual());
    ui.label(RichText::new(heading).strong());
    small(ui, &format!("From {origin}"));
    if let Some(why) = &identified.chosen_because {
        small(ui, &format!("Chosen because {why}"));
    }
    // The longest interval has room beside its value.
    let grid = Grid::new("values").num_columns(4).striped(true).spacing([3.0, 4.0]);
    grid.show(ui, |ui| {
        for text in ["", "value", "", "95 % interval"] {
            ui.label(RichText::new(text).small().weak());
        }
        ui.end_row();
        for value in identified.values() {
            ui.label(&value.what);
            ui.label(RichText::new(&value.value).strong());
            ui.label(value.unit);
            ui.label(RichText::new(&value.interval).small());
            ui.end_row();
        }
    });
    let caution = Palette::of(ui).caution_text;
    for refusal in &identified.refused {
        let name = RichText::new(format!("Not determined: {}", in_words(&refusal.parameter))).color(caution);
        ui.label(name);
        small(ui, &format!("{}. Record instead: {}.", refusal.reason, refusal.instead));
    }
    let assumptions = found.scene.iter().flat_map(|made| &made.assumptions);
    for note in identified.notes.iter().chain(assumptions) {
        small(ui, note);
    }
    if found.scene.is_ok() && active.is_some_and(|active| active.coupling.is_some()) {
        small(
            ui,
            "here it is tried and saved with the coupling of the active scene, which suits the rig",
        );
    }
}

fn small(ui: &mut Ui, text: &str) {
    ui.add(Label::new(RichText::new(text).small()).wrap());
}

/// Height of the window from which the remarks are open, points.
const TALL: f32 = 760.0;

/// Shows what the daemon says of the scene, and the buttons.
pub(super) fn show_use(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let takes_commands = model.daemon.takes_commands();
    let is_tuning = model.view.tuning.trial.is_active();
    let fitting = &mut model.view.fitting;
    let Progress::Found(found) = &fitting.progress else {
        return;
    };
    if let Err(why) = &found.scene {
        wrapped(ui, why, Palette::of(ui).caution_text);
    }
    let Some(scene) = fitting.scene(model.daemon.mirror.scene.whole.as_ref()) else {
        return;
    };
    show_advice(ui, &fitting.advice);
    let seconds = TRIAL.as_secs();
    let can_try = takes_commands && !fitting.is_trying() && !is_tuning;
    let button = Button::new(format!("Try this for {seconds} s"));
    let button = ui.add_enabled(can_try, button);
    let hint = format!(
        "The hand feels it at once, and the scene before comes back after {seconds} s. Meanwhile the panel holds a \
         lease: if it is lost, the rig is released."
    );
    let why_not = if takes_commands {
        "A try is under way"
    } else {
        "No daemon answers"
    };
    if button.on_hover_text(hint).on_disabled_hover_text(why_not).clicked() {
        intents.push(fitting.begin_trial());
    }
    ui.horizontal_wrapped(|ui| show_saving(ui, fitting, &scene, takes_commands, intents));
}

fn show_saving(ui: &mut Ui, fitting: &mut Fitting, scene: &Scene, takes_commands: bool, intents: &mut Vec<Intent>) {
    let button = ("Save as scene", "Save as scene", "Keeps it in the daemon's library");
    let field = "name of the identified scene";
    let saved = fitting.saving.show(ui, takes_commands, field, button);
    let save = |(name, replace): (String, bool)| Intent::Save {
        scene: Some(Box::new(Scene {
            name: name.clone(),
            ..scene.clone()
        })),
        name,
        replace,
    };
    intents.extend(saved.map(save));
}

/// What the daemon remarks on the scene.
fn show_advice(ui: &mut Ui, advice: &Foreseen) {
    let palette = Palette::of(ui);
    match advice {
        Foreseen::Known(Ok(advice)) if advice.is_empty() => {
            let text = "The adviser has no objection to this scene on this rig";
            wrapped(ui, text, ui.visuals().text_color());
        }
        Foreseen::Known(Ok(advice)) => {
            let plural = if advice.len() == 1 { "" } else { "s" };
            let title = format!("The adviser has {} remark{plural} on this scene", advice.len());
            let title = RichText::new(title).color(palette.caution_text);
            let is_tall = ui.ctx().content_rect().height() >= TALL;
            CollapsingHeader::new(title)
                .id_salt("advice")
                .default_open(is_tall)
                .show(ui, |ui| {
                    for advice in advice {
                        wrapped(ui, &advice.message, palette.caution_text);
                    }
                });
        }
        Foreseen::Known(Err(why)) => wrapped(ui, &format!("The daemon refuses this scene: {why}"), palette.error_text),
        Foreseen::Unasked | Foreseen::Asked => {}
    }
}

fn wrapped(ui: &mut Ui, text: &str, color: egui::Color32) {
    ui.add(Label::new(RichText::new(text).small().color(color)).wrap());
}
