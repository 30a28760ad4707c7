//! What was found: values with their intervals, what the record cannot tell, and remarks.

use crate::identification::Found;
use crate::theme::Palette;
use egui::{Grid, Label, RichText, Ui};
use haptic_core::Scene;
use haptic_lab::identify::in_words;

/// Shows it; `active` is the scene on the rig.
pub(super) fn show(ui: &mut Ui, found: &Found, active: Option<&Scene>) {
    let Found { origin, identified, .. } = found;
    ui.separator();
    let model = identified.model.name();
    let heading = format!("{model}, residual {:.4} N rms", identified.residual_rms_n);
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
