//! Closing the window while force is on asks first: the rig would stay engaged, and nobody would see what it does.

use crate::intent::Intent;
use crate::model::Model;
use crate::theme::Palette;
use crate::view::Closing;
use egui::{RichText, Ui, ViewportCommand};

/// Takes the wish to close the window, and closes it when the force is off.
pub(crate) fn take_wish(ui: &Ui, model: &mut Model) {
    let daemon = &model.daemon;
    // The fake rig of this window ends with it.
    let is_own = model.view.has_own_rig && daemon.takes_hand();
    let is_live = !is_own && daemon.rig().is_some_and(|rig| rig.state.is_live());
    let is_wanted = ui.input(|input| input.viewport().close_requested());
    let closing = &mut model.view.closing;
    if is_live && is_wanted {
        ui.ctx().send_viewport_cmd(ViewportCommand::CancelClose);
        *closing = Closing::Asked;
    }
    match closing {
        Closing::No => {}
        Closing::WhenReleased if !is_live => ui.ctx().send_viewport_cmd(ViewportCommand::Close),
        // Somebody else has taken the force away.
        Closing::Asked if !is_live => *closing = Closing::No,
        Closing::Asked | Closing::WhenReleased => {}
    }
}

/// Shows the question in a row that is always there: nothing moves, and nothing lies over Stop.
pub(crate) fn show_question(ui: &mut Ui, closing: &mut Closing, intents: &mut Vec<Intent>) {
    let color = Palette::of(ui).caution_text;
    if *closing == Closing::WhenReleased {
        ui.label(RichText::new("The window closes when the force is off").color(color));
    } else {
        ui.label(RichText::new("The rig would stay engaged").color(color));
        if ui.button("Release and close").clicked() {
            *closing = Closing::WhenReleased;
            intents.push(Intent::Release);
        }
    }
    if ui.button("Keep the window").clicked() {
        *closing = Closing::No;
    }
}
