//! The menu that keeps what is seen as a reference, and lays it under another run.

use super::reference::Reference;
use super::scope::Scope;
use crate::tapes::Tapes;
use crate::text_input::number_field;
use egui::containers::menu::{MenuButton, MenuConfig};
use egui::style::StyleModifier;
use egui::{Button, PopupCloseBehavior, RichText, Ui};

/// Most moments that are offered to align at.
const MAX_MARKS: usize = 8;

pub(super) fn show(ui: &mut Ui, tapes: &Tapes, scope: &Scope, reference: &mut Option<Reference>) {
    // A menu's own style draws no button, and one entry alone would look like a hint.
    let config = MenuConfig::new()
        .style(StyleModifier::default())
        .close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let text = RichText::new("Compare");
    let text = if reference.is_some() { text.strong() } else { text };
    let (button, _) = MenuButton::new(text).config(config).ui(ui, |ui| {
        let pin = Button::new("Keep what is seen as the reference");
        let pin = ui.add_enabled(scope.has_samples(tapes), pin);
        if pin
            .on_hover_text("It is drawn faintly behind what is shown next: the rig, or a recording")
            .clicked()
        {
            *reference = Some(Reference::pin(scope, tapes));
            ui.close();
        }
        if let Some(kept) = reference {
            ui.separator();
            show_kept(ui, tapes, scope, kept);
            ui.separator();
            if ui.button("Drop the reference").clicked() {
                *reference = None;
                ui.close();
            }
        }
    });
    button.on_hover_text("Overlays two runs and shows how they differ");
}

fn show_kept(ui: &mut Ui, tapes: &Tapes, scope: &Scope, kept: &mut Reference) {
    ui.label(RichText::new(format!("Reference: {}", kept.name)).small());
    ui.horizontal(|ui| {
        ui.label("moved by");
        let speed = scope.span_s() / 500.0;
        let shift = number_field(&mut kept.shift_s, |field| {
            field.speed(speed).max_decimals(4).suffix(" s")
        });
        ui.add(shift).accessible_name("shift of the reference");
        if ui.add_enabled(kept.shift_s != 0.0, Button::new("0 s")).clicked() {
            kept.shift_s = 0.0;
        }
    });
    let problem = ui.scope_id().with("cannot align");
    let at_crossing = ui
        .button("Align where the trigger's level is crossed")
        .on_hover_text("The first crossing in sight of both, by the trigger's signal, edge and level");
    if at_crossing.clicked() {
        let is_aligned = kept.align_at_crossing(scope, tapes);
        ui.data_mut(|data| data.insert_temp(problem, !is_aligned));
    }
    for text in kept.common_marks(scope, tapes).into_iter().take(MAX_MARKS) {
        let align = Button::new(format!("Align at {text}")).truncate();
        if ui.add(align).clicked() {
            let is_aligned = kept.align_at_mark(&text, scope, tapes);
            ui.data_mut(|data| data.insert_temp(problem, !is_aligned));
        }
    }
    if ui.data(|data| data.get_temp(problem)) == Some(true) {
        let signal = scope.trigger.signal;
        let (name, unit, level) = (signal.name(), signal.quantity().unit(), scope.trigger.level);
        let why = format!("{name} does not cross {level} {unit} in both runs");
        ui.label(RichText::new(why).small());
    }
}
