//! A list to choose one from: a choice closes it, by Enter as by a click, and the keyboard goes on from where the list hangs.

use egui::{ComboBox, Key, Response, Ui, WidgetText};

/// Shows a list under `name`, `shown` standing in it while it is closed; gives what was chosen.
///
/// Each item has its text, a hint (which may be empty), and whether it is the one in force.
pub(crate) fn show<T>(
    ui: &mut Ui,
    name: &str,
    width: f32,
    shown: impl Into<WidgetText>,
    items: impl FnOnce() -> Vec<Item<T>>,
) -> (Option<T>, Response) {
    let list = ComboBox::from_id_salt(name).width(width).selected_text(shown);
    let list = list.show_ui(ui, |ui| {
        let mut chosen = None;
        for Item {
            what,
            text,
            hint,
            is_in_force,
        } in items()
        {
            let mut item = ui.selectable_label(is_in_force, text);
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

/// One to choose.
#[derive(Debug)]
pub(crate) struct Item<T> {
    pub(crate) what: T,
    pub(crate) text: String,
    pub(crate) hint: String,
    pub(crate) is_in_force: bool,
}

impl<T: PartialEq> Item<T> {
    /// One that needs no hint.
    pub(crate) fn new(what: T, text: impl Into<String>, in_force: &T) -> Self {
        Self {
            is_in_force: what == *in_force,
            what,
            text: text.into(),
            hint: String::new(),
        }
    }
}
