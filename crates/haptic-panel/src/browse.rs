//! The button beside a field for a path, which opens the desktop's own dialog.

use crate::intent::{DialogPurpose, Intent};
use egui::Ui;
use std::path::PathBuf;

/// Width of the button with the distance before it, points.
pub(crate) const WIDTH: f32 = 82.0;

/// Shows the button. Returns whether it was pressed.
pub(crate) fn show(
    ui: &mut Ui,
    text: &str,
    name: &str,
    (purpose, near): (DialogPurpose, &str),
    intents: &mut Vec<Intent>,
) -> bool {
    let button = ui
        .button(text)
        .on_hover_text("Opens the dialog of the desktop. Space and Escape stop in this window, not in that one.")
        .accessible_name(name);
    if button.clicked() {
        let near = PathBuf::from(near);
        intents.push(Intent::Choose { purpose, near });
    }
    button.clicked()
}
