//! A field for a number that is dragged, stepped by the arrow keys, or typed.

use egui::{DragValue, Key, Ui, Widget};

/// The field of a value, as `design` makes it. What is typed counts by Enter or Tab alone: a half-typed number is
/// dropped when the field loses the keyboard otherwise.
pub(crate) fn number_field(value: &mut f64, design: impl FnOnce(DragValue<'_>) -> DragValue<'_>) -> impl Widget {
    move |ui: &mut Ui| {
        let mut typed = *value;
        let field = ui.add(design(DragValue::new(&mut typed)).update_while_editing(false));
        let is_left_by_key = ui.input(|input| input.key_pressed(Key::Enter) || input.key_pressed(Key::Tab));
        if !field.lost_focus() || is_left_by_key {
            *value = typed;
        }
        field
    }
}
