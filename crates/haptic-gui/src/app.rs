//! The panel in a window.

use haptic_gui::Model;
use haptic_gui::connection::Connection;

/// Ties the connection to the panel.
pub(crate) struct App {
    model: Model,
    connection: Connection,
}

impl App {
    pub(crate) fn new(connection: Connection) -> Self {
        Self {
            model: Model::new(),
            connection,
        }
    }
}

impl eframe::App for App {
    /// Also called while the window is hidden, so that news does not pile up.
    fn logic(&mut self, _: &egui::Context, _: &mut eframe::Frame) {
        for update in self.connection.updates() {
            self.model.apply(update);
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        for intent in haptic_gui::ui(ui, &mut self.model) {
            self.connection.send(intent);
        }
    }
}
