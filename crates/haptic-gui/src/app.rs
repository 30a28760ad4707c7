//! The panel in a window.

use haptic_gui::connection::Connection;
use haptic_gui::export;
use haptic_gui::{Format, Intent, Model, Update};
use std::path::PathBuf;
use std::sync::mpsc;
use std::time::Instant;

/// Ties the connection to the panel.
pub(crate) struct App {
    model: Model,
    connection: Connection,
    /// Screenshots come back on another thread.
    exported: (mpsc::Sender<Result<PathBuf, String>>, mpsc::Receiver<Result<PathBuf, String>>),
    /// When the panel was drawn last, by its own clock in s and by the system's.
    drawn: (f64, Instant),
}

impl App {
    pub(crate) fn new(connection: Connection) -> Self {
        Self {
            model: Model::new(),
            connection,
            exported: mpsc::channel(),
            drawn: (0.0, Instant::now()),
        }
    }

    fn carry_out(&mut self, ctx: &egui::Context, intent: Intent) {
        match intent {
            Intent::Export { format, folder } => self.export(ctx, format, folder),
            intent => self.connection.send(intent),
        }
    }

    fn export(&mut self, ctx: &egui::Context, format: Format, folder: PathBuf) {
        let content = match format {
            Format::Csv => export::csv(&self.model),
            Format::Svg => export::svg(&self.model),
            Format::Png => {
                let (exported, ctx_of_callback) = (self.exported.0.clone(), ctx.clone());
                let (part, scale) = (self.model.plots_area(), ctx.pixels_per_point());
                ctx.request_screenshot(move |image| {
                    let content = export::png(&image, part, scale);
                    let written = content.and_then(|content| export::write(&folder, format, &content));
                    // Nobody listens only when the window is gone.
                    exported.send(written).unwrap_or(());
                    ctx_of_callback.request_repaint();
                });
                return;
            }
        };
        let result = export::write(&folder, format, content.as_bytes());
        self.model.apply(Update::Exported(result));
    }
}

impl eframe::App for App {
    /// Also called while the window is hidden, so that news does not pile up and a try goes back though nobody looks.
    fn logic(&mut self, ctx: &egui::Context, _: &mut eframe::Frame) {
        for update in self.connection.updates() {
            self.model.apply(update);
        }
        while let Ok(result) = self.exported.1.try_recv() {
            self.model.apply(Update::Exported(result));
        }
        // The clock of a hidden window stands still.
        let now = self.drawn.0 + self.drawn.1.elapsed().as_secs_f64();
        let (intents, wait) = self.model.due(now);
        for intent in intents {
            self.carry_out(ctx, intent);
        }
        if let Some(wait) = wait {
            ctx.request_repaint_after(wait);
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        self.drawn = (ui.input(|input| input.time), Instant::now());
        for intent in haptic_gui::ui(ui, &mut self.model) {
            self.carry_out(ui.ctx(), intent);
        }
    }
}
