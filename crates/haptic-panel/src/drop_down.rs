//! A drop-down list. Enter or a click chooses and closes it; the keyboard focus returns to the list.

use egui::{ComboBox, Key, Response, Ui, WidgetText};

/// Height from which a list scrolls, points: that of a dozen items, so that all laws are in sight.
const HIGHEST: f32 = 320.0;

/// Shows a list under `name`, with the text `shown` while it is closed. Returns the chosen item.
pub(crate) fn show<T>(
    ui: &mut Ui,
    name: &str,
    width: f32,
    shown: impl Into<WidgetText>,
    items: impl FnOnce() -> Vec<Item<T>>,
) -> (Option<T>, Response) {
    let list = ComboBox::from_id_salt(name)
        .width(width)
        .height(HIGHEST)
        .selected_text(shown);
    let list = list.show_ui(ui, |ui| {
        let mut chosen = None;
        for Item {
            what,
            text,
            hint,
            is_active,
        } in items()
        {
            let mut item = ui.selectable_label(is_active, text);
            if !hint.is_empty() {
                item = item.on_hover_text(hint);
            }
            if item.clicked() {
                chosen = Some(what);
                ui.close();
            }
        }
        chosen
    });
    let response = list.response.accessible_name(name);
    let chosen = list.inner.flatten();
    if chosen.is_some() && ui.input(|input| input.key_pressed(Key::Enter)) {
        response.request_focus();
    }
    (chosen, response)
}

/// Whether Enter has ended the typing in a field.
pub(crate) fn is_entered(ui: &Ui, field: &Response) -> bool {
    field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter))
}

/// An item to choose, with a hint that may be empty.
#[derive(Debug)]
pub(crate) struct Item<T> {
    pub(crate) what: T,
    pub(crate) text: String,
    pub(crate) hint: String,
    pub(crate) is_active: bool,
}

impl<T: PartialEq> Item<T> {
    /// An item without a hint.
    pub(crate) fn new(what: T, text: impl Into<String>, active: &T) -> Self {
        Self {
            is_active: what == *active,
            what,
            text: text.into(),
            hint: String::new(),
        }
    }
}
