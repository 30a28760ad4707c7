//! The panel in a window.

use haptic_gui::connection::Connection;
use haptic_gui::export;
use haptic_gui::{Format, Intent, Model, Update};
use haptic_lab::recording::{self, RecordingError};
use std::path::PathBuf;
use std::sync::mpsc;
use std::thread;
use std::time::Instant;

/// Ties the connection to the panel.
pub(crate) struct App {
    model: Model,
    connection: Connection,
    /// News from threads of the panel's own: screenshots, and recordings that were read.
    own: (mpsc::Sender<Update>, mpsc::Receiver<Update>),
}

impl App {
    pub(crate) fn new(connection: Connection) -> Self {
        Self {
            model: Model::new(),
            connection,
            own: mpsc::channel(),
        }
    }

    fn carry_out(&mut self, ctx: &egui::Context, intent: Intent) {
        match intent {
            Intent::Export { format, folder } => self.export(ctx, format, folder),
            Intent::Open { path } => self.open(ctx, path),
            intent => self.connection.send(intent),
        }
    }

    /// Reads a recording on a thread of its own: an hour takes seconds, and the stop button must work meanwhile.
    pub(crate) fn open(&self, ctx: &egui::Context, path: PathBuf) {
        let (own, ctx) = (self.own.0.clone(), ctx.clone());
        let reads = move || {
            let result = recording::read(&path);
            let result = result.map(Box::new);
            let result = result.map_err(|error| match error {
                // It names the file.
                RecordingError::Open { .. } => format!("cannot open {error}"),
                error => format!("cannot open {}: {error}", path.display()),
            });
            own.send(Update::Opened { path, result }).unwrap_or(());
            ctx.request_repaint();
        };
        if let Err(error) = thread::Builder::new().name("read".to_owned()).spawn(reads) {
            let failed = Update::Exported(Err(format!("no thread to read with: {error}")));
            self.own.0.send(failed).unwrap_or(());
        }
    }

    fn export(&mut self, ctx: &egui::Context, format: Format, folder: PathBuf) {
        let content = match format {
            Format::Csv => export::csv(&self.model),
            Format::Svg => export::svg(&self.model),
            Format::Png => {
                let (own, ctx_of_callback) = (self.own.0.clone(), ctx.clone());
                let (part, scale) = (self.model.plots_area(), ctx.pixels_per_point());
                ctx.request_screenshot(move |image| {
                    let content = export::png(&image, part, scale);
                    let written = content.and_then(|content| export::write(&folder, format, &content));
                    // Nobody listens only when the window is gone.
                    own.send(Update::Exported(written)).unwrap_or(());
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
        while let Ok(update) = self.own.1.try_recv() {
            self.model.apply(update);
        }
        let (intents, wait) = self.model.due(Instant::now());
        for intent in intents {
            self.carry_out(ctx, intent);
        }
        if let Some(wait) = wait {
            ctx.request_repaint_after(wait);
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        for intent in haptic_gui::ui(ui, &mut self.model, Instant::now()) {
            self.carry_out(ui.ctx(), intent);
        }
    }
}
