//! Keeps the settings in their file, on a thread, whenever they have changed.

use crate::files::Writer;
use crate::model::Model;
use crate::settings::Settings;
use crate::update::Update;
use std::path::PathBuf;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

/// Time between two looks at whether they have changed: a drag changes them in every frame.
const BETWEEN_LOOKS: Duration = Duration::from_secs(2);

/// Longest time that a closing window waits for a disk.
const AT_CLOSE: Duration = Duration::from_secs(1);

/// The settings as they were kept last, and their file.
#[derive(Debug)]
pub(crate) struct SettingsThread {
    file: PathBuf,
    kept: Settings,
    looked: Instant,
}

impl SettingsThread {
    pub(crate) fn new(file: PathBuf, kept: Settings) -> Self {
        let looked = Instant::now();
        Self { file, kept, looked }
    }

    /// Keeps them if they have changed, at most every two seconds.
    pub(crate) fn look(&mut self, model: &Model, ctx: &egui::Context, writer: &Writer) {
        if self.looked.elapsed() < BETWEEN_LOOKS {
            return;
        }
        self.looked = Instant::now();
        let now = settings(model, ctx);
        if now != self.kept {
            self.kept = now.clone();
            let file = self.file.clone();
            writer.work_unnoticed(move || Update::Remembered(now.write(&file)));
        }
    }

    /// Keeps them when the window closes. A disk that does not answer is left behind.
    pub(crate) fn close(&self, model: &Model, ctx: &egui::Context) {
        let now = settings(model, ctx);
        if now == self.kept {
            return;
        }
        let file = self.file.clone();
        let (done, is_done) = mpsc::channel();
        let write = move || {
            // There is no user left to show it to.
            now.write(&file).unwrap_or_default();
            done.send(()).unwrap_or_default();
        };
        if thread::Builder::new().name("settings".to_owned()).spawn(write).is_ok() {
            is_done.recv_timeout(AT_CLOSE).unwrap_or_default();
        }
    }
}

/// The settings of the panel as it is now.
fn settings(model: &Model, ctx: &egui::Context) -> Settings {
    let window = ctx.input(|input| input.viewport().inner_rect);
    Settings {
        theme: Some(ctx.options(|options| options.theme_preference).into()),
        window_size: window.map(|window| window.size().into()),
        ..model.settings()
    }
}
