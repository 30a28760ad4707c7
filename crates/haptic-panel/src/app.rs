//! Ties connection and files to the panel, for the window to call. Nothing here waits.

use crate::connection::Connection;
use crate::export::Destination;
use crate::fake_rig::FakeRig;
use crate::files::Files;
use crate::intent::{DialogPurpose, Format, Intent};
use crate::model::Model;
use crate::notice::Notice;
use crate::page::Page;
use crate::plots::picture;
use crate::settings::Settings;
use crate::settings::thread::SettingsThread;
use crate::shell;
use crate::stop::button::is_stop_key;
use crate::study::StudyCommand;
use crate::text_input::{FRAME_PERIOD, Typing};
use crate::update::Update;
use egui::ViewportId;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How much longer the time between two frames is without a graphics card.
const SLOWER_IN_SOFTWARE: u32 = 3;

/// Shortest time between two frames without a graphics card: 8 a second.
const MIN_IN_SOFTWARE: Duration = Duration::from_millis(120);

/// Longest time between two frames without a graphics card: no number in sight is older.
const MAX_IN_SOFTWARE: Duration = Duration::from_secs(3);

/// Time between two looks whether a fake rig that is started has failed.
const UNTIL_A_LOOK: Duration = Duration::from_millis(200);

/// The panel with its connection and its files.
#[derive(Debug)]
pub struct App {
    model: Model,
    connection: Connection,
    files: Files,
    /// There is no graphics card.
    is_drawn_in_software: bool,
    /// A stop was sent by key before the frame was drawn.
    stopped_by_key: bool,
    typing: Arc<Typing>,
    settings_thread: Option<SettingsThread>,
    /// The daemon that ends with the window, and the socket that was named.
    fake_rig: Option<FakeRig>,
    socket: Option<PathBuf>,
}

impl App {
    /// The panel with a connection and files that repaint the same window.
    #[must_use]
    pub fn new(connection: Connection, files: Files) -> Self {
        let mut model = Model::new();
        model.view.study.screen = connection.subject_screen();
        Self {
            model,
            connection,
            files,
            is_drawn_in_software: false,
            stopped_by_key: false,
            typing: Arc::new(Typing::new(Instant::now())),
            settings_thread: None,
            fake_rig: None,
            socket: None,
        }
    }

    /// Names the socket of a fake rig that is started here; the usual one otherwise.
    pub fn name_socket(&mut self, socket: Option<PathBuf>) {
        self.socket = socket;
    }

    /// Draws so few frames with new samples that a processor does it without strain.
    pub fn draw_in_software(&mut self) {
        self.is_drawn_in_software = true;
    }

    /// A stop for any thread: each call sends one, and returns false once the panel is closed. Waits for nothing.
    pub fn stopper(&self) -> impl Fn() -> bool + Send + use<> {
        self.connection.stopper()
    }

    /// Whether Space is typed into a text field of the panel's own window now, and does not stop; for any thread.
    pub fn space_is_typed(&self) -> impl Fn() -> bool + Send + use<> {
        let typing = Arc::clone(&self.typing);
        move || typing.takes_space(Instant::now())
    }

    /// Opens a study. A page of studies shows how that went, and it turns to the study's own once it is open.
    pub fn open_study(&mut self, folder: PathBuf) {
        if !self.model.page().is_of_studies() {
            self.model.turn_to(Page::Task);
        }
        let command = StudyCommand::Open { folder };
        self.model.view.study.note_sent(&command);
        self.connection.send(Intent::Study(command));
    }

    /// Turns to a page.
    pub fn turn_to(&mut self, page: Page) {
        self.model.turn_to(page);
    }

    /// Takes up remembered settings, or shows why there are none, and keeps them in their file from now on. A
    /// file that cannot be read stays as it is.
    pub fn remember(&mut self, file: PathBuf, settings: Result<Settings, String>) {
        let is_unreadable = settings.is_err() && file.exists();
        let settings = settings.unwrap_or_else(|why| {
            self.model.view.show_settings_error(why);
            Settings::default()
        });
        self.model.restore(&settings);
        self.settings_thread = (!is_unreadable).then(|| SettingsThread::new(file, settings));
    }

    /// Keeps the settings before the window closes.
    pub fn close(&self, ctx: &egui::Context) {
        if let Some(settings_thread) = &self.settings_thread {
            settings_thread.close(&self.model, ctx);
        }
    }

    /// What the panel shows.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Takes an update from elsewhere.
    pub fn hear(&mut self, update: Update) {
        self.model.apply(update);
    }

    /// The files that it reads and writes.
    #[must_use]
    pub fn files(&self) -> &Files {
        &self.files
    }

    /// Takes the keys of Stop of any window, before anything is laid out or drawn.
    pub fn take_keys(&mut self, input: &egui::RawInput) {
        let now = Instant::now();
        if self.has_stop_key(input, now) {
            self.stopped_by_key = true;
            self.connection.stop();
            // Now: an answer may come before the panel's own window is drawn, and the key may be the subject's.
            self.model.press_stop(now);
        }
    }

    fn has_stop_key(&self, input: &egui::RawInput, now: Instant) -> bool {
        // No other window has a text field.
        let is_typing = input.viewport_id == ViewportId::ROOT && self.typing.takes_space(now);
        input.events.iter().any(|event| is_stop_key(event, is_typing))
    }

    /// Takes the updates, and carries out what is due. A hidden window calls it too: updates must
    /// not pile up, and a try goes back while nobody looks.
    pub fn take_news(&mut self, ctx: &egui::Context) {
        for update in self.connection.updates() {
            self.model.apply(update);
        }
        for update in self.files.updates() {
            self.model.apply(update);
        }
        if let Some(settings_thread) = &mut self.settings_thread {
            settings_thread.look(&self.model, ctx, &self.files.writer());
        }
        self.look_after_fake_rig(ctx);
        self.model.view.has_own_rig = self.fake_rig.is_some();
        let (intents, wait) = self.model.due(Instant::now());
        for intent in intents {
            self.carry_out(ctx, intent);
        }
        if let Some(wait) = wait {
            ctx.request_repaint_after(wait);
        }
    }

    /// Draws the panel, and carries out the intents of the user.
    pub fn show(&mut self, ui: &mut egui::Ui) {
        // The outcome of a stop by key may be known before its frame: the stop of this frame is the same.
        let outcome = self.stopped_by_key.then(|| self.model.daemon.stop.clone());
        let intents = shell::ui(ui, &mut self.model, Instant::now());
        if let Some(outcome) = outcome {
            self.model.daemon.stop = outcome;
        }
        for intent in intents {
            self.carry_out(ui.ctx(), intent);
        }
        picture::count_frame(ui.ctx());
        self.stopped_by_key = false;
        let has_field = ui.ctx().text_edit_focused();
        self.typing.note_frame(has_field, Instant::now());
        if has_field {
            ui.ctx().request_repaint_after(FRAME_PERIOD);
        }
        let mut pace = self.model.pace();
        if self.is_drawn_in_software {
            pace = (pace * SLOWER_IN_SOFTWARE).clamp(MIN_IN_SOFTWARE, MAX_IN_SOFTWARE);
        }
        self.connection.set_pace(pace);
    }

    /// Carries out an intent.
    pub fn carry_out(&mut self, ctx: &egui::Context, intent: Intent) {
        match intent {
            // It was sent when the key was seen.
            Intent::Stop if std::mem::take(&mut self.stopped_by_key) => {}
            Intent::Export { format, folder } => self.export(ctx, format, Destination::NewIn(folder)),
            Intent::Choose {
                purpose: DialogPurpose::Export(format),
                near,
            } => self.export(ctx, format, Destination::Asked { near }),
            Intent::Choose { purpose, near } => self.files.choose(purpose, near),
            Intent::StartFakeRig if self.fake_rig.is_none() => {
                let stops = self.connection.stops_pressed();
                match FakeRig::start(self.socket.as_deref()) {
                    Ok(started) => {
                        self.connection.set_own_rig(Some((started.pid(), stops)));
                        self.fake_rig = Some(started);
                        self.model.view.file_notice = None;
                    }
                    Err(why) => self.model.view.file_notice = Some(Notice::new(Err(why))),
                }
            }
            Intent::ConnectTo { path } => {
                self.socket = Some(path.clone());
                self.connection.send(Intent::ConnectTo { path });
            }
            // It is on its way.
            Intent::StartFakeRig => {}
            Intent::Open { path } => self.files.open(path),
            Intent::List { folder, known } => self.files.list(folder, known),
            Intent::WhatIf { number, path, scene } => self.files.what_if(number, path, scene.map(|scene| *scene)),
            Intent::CancelWhatIf => self.files.cancel_what_if(),
            Intent::ReadHeadings { path } => self.files.read_headings(path),
            Intent::Identify { number, question } => self.files.identify(number, *question),
            Intent::CancelIdentify => self.files.cancel_identify(),
            intent => self.connection.send(intent),
        }
    }

    /// Says why a fake rig that was started here has ended.
    fn look_after_fake_rig(&mut self, ctx: &egui::Context) {
        let Some(fake_rig) = &mut self.fake_rig else { return };
        if let Some(why) = fake_rig.end() {
            self.fake_rig = None;
            self.connection.set_own_rig(None);
            self.model.view.file_notice = Some(Notice::new(Err(why)));
        } else if !self.model.is_connected() {
            ctx.request_repaint_after(UNTIL_A_LOOK);
        }
    }

    fn export(&self, ctx: &egui::Context, format: Format, to: Destination) {
        if format != Format::Png {
            self.files.export(&self.model, format, to);
            return;
        }
        picture::begin(ctx);
        let writer = self.files.writer();
        let (part, scale) = (self.model.plots_area(), ctx.pixels_per_point());
        ctx.request_screenshot(move |image| writer.export_picture(image, part, scale, to));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connection::Patience;
    use crate::stop::report::StopReport;
    use crate::update::StopNews;
    use egui::{Event, Key, Modifiers, RawInput};

    fn press(key: Key, viewport_id: ViewportId) -> RawInput {
        let event = Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        RawInput {
            viewport_id,
            events: vec![event],
            ..RawInput::default()
        }
    }

    fn app() -> App {
        let connection = Connection::start(|| "/nowhere".into(), Patience::default(), |_| {}).expect("threads");
        App::new(connection, Files::new(|_| {}))
    }

    /// Draws a frame.
    fn draw(ctx: &egui::Context, input: RawInput, mut contents: impl FnMut(&mut egui::Ui)) -> egui::FullOutput {
        let mut output = ctx.run_ui(input, |ui| contents(ui));
        // There is no graphics card for the fonts.
        output.textures_delta.clear();
        output
    }

    // hazard: H4
    #[test]
    fn a_stop_that_is_confirmed_before_its_frame_stays_so() {
        let (mut app, ctx) = (app(), egui::Context::default());
        let input = press(Key::Escape, ViewportId::ROOT);
        app.take_keys(&input);
        // Both connections have it: the second finds the rig stopped.
        for tick in [9, 12] {
            let result = Ok(haptic_ipc::StateReply {
                state: haptic_ipc::RigState::Stopped,
                tick,
            });
            let after = Duration::from_millis(3);
            app.hear(Update::Stop(StopNews::Answered { after, result }));
        }
        draw(&ctx, input, |ui| app.show(ui));
        let report = &app.model.daemon.stop;
        assert!(matches!(report, StopReport::Confirmed { tick: 9, .. }), "{report:?}");
    }

    // hazard: H28
    #[test]
    fn space_stops_outside_the_field_and_where_no_frame_comes() {
        let (mut app, ctx, mut text) = (app(), egui::Context::default(), String::new());
        let root = ViewportId::ROOT;
        for has_field in [true, false] {
            let before = Instant::now();
            let output = draw(&ctx, RawInput::default(), |ui| {
                let field = ui.text_edit_singleline(&mut text);
                if has_field {
                    field.request_focus();
                } else {
                    field.surrender_focus();
                }
                app.show(ui);
            });
            let next = output.viewport_output[&root].repaint_delay;
            assert!(!has_field || next <= FRAME_PERIOD, "{next:?}");
            let stops = |key, window, now| app.has_stop_key(&press(key, window), now);
            assert_eq!(stops(Key::Space, root, before), !has_field);
            assert!(stops(Key::Escape, root, before));
            assert!(stops(Key::Space, crate::study::subject_window_id(), before));
            let much_later = Instant::now() + Duration::from_millis(300);
            assert!(stops(Key::Space, root, much_later), "no frame comes");
        }
    }
}
