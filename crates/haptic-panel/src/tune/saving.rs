//! Saving a scene to the library: the name as it is typed, and what came of it.

use crate::drop_down::is_entered;
use crate::notice::Notice;
use egui::{Button, Id, TextEdit, Ui};
use haptic_ipc::{ErrorCode, SceneSaveReply, WireError};

/// The name under which to save.
#[derive(Debug, Default)]
pub(crate) struct Saving {
    name: String,
    /// The name of a scene in the library that a save would replace.
    pub(super) would_replace: Option<String>,
}

impl Saving {
    /// Shows the field, with its name, and the buttons, with text, name and hint of the one that saves. Returns the name
    /// to save under, and whether it may replace a scene of that name.
    pub(crate) fn show(
        &mut self,
        ui: &mut Ui,
        is_possible: bool,
        field_name: &str,
        (text, button_name, hint): (&str, &str, &str),
    ) -> Option<(String, bool)> {
        let field = TextEdit::singleline(&mut self.name)
            // It keeps the focus when the list above it grows.
            .id(Id::unique(field_name))
            .desired_width(150.0)
            .hint_text("name");
        let field = ui.add(field).accessible_name(field_name);
        let name = self.name.trim();
        let may_save = is_possible && !name.is_empty();
        let save = ui.add_enabled(may_save, Button::new(text)).on_hover_text(hint);
        let is_pressed = save.accessible_name(button_name).clicked();
        let saved = (is_pressed || (may_save && is_entered(ui, &field))).then(|| (name.to_owned(), false));
        let taken = self.would_replace.as_ref();
        let is_pressed = taken.is_some_and(|taken| ui.button(format!("Replace {taken}")).clicked());
        let replaced = self.would_replace.take_if(|_| is_pressed);
        saved.or(replaced.map(|taken| (taken, true)))
    }

    /// The daemon has answered a save under a name. Returns what to show the user.
    pub(crate) fn answered(&mut self, name: &str, result: Result<&SceneSaveReply, WireError>) -> Notice {
        Notice::new(match result {
            Ok(reply) => {
                self.would_replace = None;
                Ok(format!("Saved as {} ({})", reply.name, reply.path))
            }
            Err(error) if error.code == ErrorCode::SceneExists => {
                self.would_replace = Some(name.to_owned());
                Err(format!(
                    "The library has a scene {name} already: save under another name, or replace it"
                ))
            }
            Err(error) => Err(error.message),
        })
    }
}
