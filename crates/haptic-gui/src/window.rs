//! The panel in a window.

use haptic_gui::App;

/// The panel as the windowing system calls it.
pub(crate) struct Window {
    pub(crate) app: App,
    pub(crate) ctx: egui::Context,
}

impl eframe::App for Window {
    fn raw_input_hook(&mut self, _: &egui::Context, input: &mut egui::RawInput) {
        self.app.take_keys(input);
    }

    fn logic(&mut self, ctx: &egui::Context, _: &mut eframe::Frame) {
        self.app.take_news(ctx);
    }

    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        self.app.show(ui);
    }

    fn on_exit(&mut self, _: Option<&eframe::glow::Context>) {
        self.app.close(&self.ctx);
    }
}
