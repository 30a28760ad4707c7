//! What the panel shows: facts of the daemon, tapes of samples, and the user's view of both. Pages and
//! plots take the part that they need; [`Model`] alone folds the news into all of them.

use crate::daemon::Daemon;
use crate::intent::Intent;
use crate::notice::{self, Notice};
use crate::page::Page;
use crate::plots::scope::Scope;
use crate::record::{Loaded, RecordingNews};
use crate::tape::Tape;
use crate::tapes::{Tapes, WhatIf};
use crate::update::{Answer, Update};
use crate::view::{Reading, View};
use egui::Rect;
use haptic_core::Scene;
use haptic_core::scene::SceneFile;
use haptic_ipc::{Event, WireError};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Shortest time between two frames that show new samples.
const FASTEST: Duration = crate::update_sender::MIN_PERIOD;

/// Longest time between two frames of a running plot, whose numbers run with it.
const SLOWEST: Duration = Duration::from_millis(100);

/// The same while no plot runs.
const STANDING: Duration = Duration::from_secs(1);

/// Everything that the panel shows.
#[derive(Debug, Default)]
pub struct Model {
    pub(crate) daemon: Daemon,
    pub(crate) tapes: Tapes,
    pub(crate) view: View,
}

impl Model {
    /// A panel without any news.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes a piece of news.
    pub fn apply(&mut self, update: Update) {
        let change = self.daemon.take(&update);
        let Self { daemon, tapes, view } = self;
        view.tuning.take_scene_change(&change);
        match update {
            Update::Connected { .. } => {
                view.tuning.forget();
                view.fitting.lose_daemon();
                if let Some(note) = &mut view.note {
                    note.tick = None;
                }
                tapes.end_live();
            }
            Update::Disconnected { .. } => {
                view.tuning.lose_daemon();
                view.fitting.lose_daemon();
                tapes.end_live();
            }
            Update::Described(_) => view.tuning.take_parameters(&daemon.mirror.scene.parameters),
            Update::Journal(result) => {
                for entry in result.iter().flat_map(|reply| &reply.entries) {
                    tapes.mark_journal(entry);
                }
            }
            Update::Status(Ok(_)) => tapes.update_clipping(daemon.force_limit_n()),
            // The mirror has them. An older daemon refuses some; the rest of the panel does without.
            Update::Connecting { .. }
            | Update::Rigs(_)
            | Update::Subscribed(_)
            | Update::Scene(_)
            | Update::Library(_)
            | Update::Status(Err(_))
            | Update::Advised(_)
            | Update::NoSample(_)
            | Update::Unreadable { .. } => {}
            Update::Recording(news) => self.take_recording(news),
            Update::Opened { path, result } => self.take_opened(path, result),
            Update::Listed { folder, listed } => view.recordings.take(&folder, &listed),
            Update::ListRead { folder, result } => view.recordings.end(&folder, result),
            Update::Headings { path, result } => view.fitting.take_headings(path, result),
            Update::Identifying { number, share } => view.fitting.take_share(number, share),
            Update::Identified { number, result } => view.fitting.take_found(number, result),
            Update::WhatIf { number, result } => {
                if let Some(why) = tapes.take_what_if(number, result) {
                    view.file_notice = Some(Notice::new(Err(why)));
                } else if let WhatIf::Shown(_) = &tapes.what_if {
                    view.file_notice = None;
                }
            }
            Update::Stop(news) => daemon.take_stop(news),
            Update::Busy(what) => view.file_notice = Some(Notice::new(Ok(what))),
            Update::Reading { path, share } => view.reading = Some(Reading { path, share }),
            Update::DialogClosed(outcome) => view.close_dialog(outcome),
            Update::Exported(result) => {
                let outcome = result.map(|path| format!("Written: {}", path.display()));
                view.file_notice = Some(Notice::new(outcome));
            }
            Update::Remembered(Ok(())) => {}
            Update::Remembered(Err(why)) => view.show_settings_error(why),
            Update::Event(event) => self.take_event(event),
            Update::Answered { intent, result } => self.take_answer(&intent, result),
            Update::Study(news) => {
                if let Some(task) = view.study.take(news) {
                    view.page = Page::of(task);
                }
            }
        }
    }

    /// Whether it is a recording that the user looks at, and never was a daemon.
    pub(crate) fn is_at_recording(&self) -> bool {
        let has_recording = self.tapes.opened().is_some() || self.view.reading.is_some();
        has_recording && !self.daemon.was_connected
    }

    /// Whether the rig, or the opened recording, has two axes.
    pub(crate) fn has_plane(&self) -> bool {
        let status = self.daemon.mirror.status.as_ref();
        status.is_some_and(|status| status.device.axes == 2)
            || self.tapes.live().is_plane()
            || self.tapes.opened_tape().is_some_and(Tape::is_plane)
    }

    /// Whether the panel is connected to a daemon.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.daemon.is_connected()
    }

    /// Sets the length of time that the plots show, s.
    pub fn show_span(&mut self, span_s: f64) {
        let scope = self.view.scope_mut(&self.tapes);
        scope.zoom(scope.span_s() / span_s, 0.0);
    }

    /// A stop was pressed at `now`, and sent elsewhere: what is typed by half is dropped, and the outcome shown.
    pub(crate) fn press_stop(&mut self, now: Instant) {
        self.view.tuning.discard_typing();
        let state = self
            .daemon
            .rig()
            .map(|rig| rig.state)
            .filter(|_| self.daemon.takes_commands());
        self.daemon.stop.press(now, self.daemon.is_connected(), state);
    }

    /// The page that is shown.
    #[must_use]
    pub const fn page(&self) -> Page {
        self.view.page
    }

    /// Turns to a page.
    pub fn turn_to(&mut self, page: Page) {
        self.view.page = page;
    }

    /// The time between two frames that show new samples: in which a running plot moves by a pixel, and a second where
    /// no plot runs, for the numbers.
    #[must_use]
    pub fn pace(&self) -> Duration {
        let scope = self.view.scope(&self.tapes);
        match self.view.page {
            Page::Task | Page::Perception if self.view.study.state().is_none() => return STANDING,
            // The subject's window has the processor.
            Page::Task | Page::Perception => return SLOWEST,
            Page::Identify => return STANDING,
            Page::Tune | Page::Record | Page::Plane if !scope.follows() => return STANDING,
            Page::Tune | Page::Record | Page::Plane => {}
        }
        // About a half of the area is a plot over time.
        let columns = f64::from(self.view.layout.area.width().max(2.0) / 2.0);
        Duration::from_secs_f64(scope.span_s() / columns).clamp(FASTEST, SLOWEST)
    }

    /// Where the plots were drawn, points.
    #[must_use]
    pub fn plots_area(&self) -> Rect {
        self.view.layout.area
    }

    /// What to send at `now`, and the time until more is due. [`ui`](crate::ui) asks for it by itself; a
    /// hidden window must ask as well, because a try goes back while nobody looks.
    #[must_use = "an intent that is not sent has no effect"]
    pub fn due(&mut self, now: Instant) -> (Vec<Intent>, Option<Duration>) {
        let View { tuning, fitting, .. } = &mut self.view;
        let (mut intents, wait) = tuning.due(now, self.daemon.mirror.scene.revision);
        intents.extend(self.tapes.due());
        let active = self.daemon.mirror.scene.whole.as_ref();
        intents.extend(fitting.due(self.daemon.is_connected(), tuning.trial.is_active(), active));
        tuning.note_sent(&intents);
        (intents, wait)
    }

    /// Drops the messages whose time is over at `now`. Returns the time until the next one is over.
    pub(crate) fn expire_messages(&mut self, now: Instant) -> Option<Duration> {
        let file = notice::expire(&mut self.view.file_notice, now);
        let report = notice::expire(&mut self.view.tuning.report, now);
        let fitting = notice::expire(&mut self.view.fitting.report, now);
        let study = notice::expire(&mut self.view.study.report, now);
        let stop = self.daemon.stop.age(now);
        let messages = file.into_iter().chain(report).chain(fitting).chain(study);
        messages.chain(stop).min()
    }

    fn take_event(&mut self, event: Event) {
        let Self { tapes, view, .. } = self;
        match event {
            Event::Log(entry) => tapes.mark_journal(&entry),
            Event::Samples(batch) => {
                let ended = tapes.extend(&batch);
                view.scope.take_samples(&batch.rows, ended, tapes);
            }
            _ => {}
        }
    }

    fn take_opened(&mut self, path: PathBuf, result: Result<Box<Loaded>, String>) {
        self.view.reading.take_if(|reading| reading.path == path);
        match result {
            Ok(mut loaded) => {
                loaded.opened.path = path;
                self.view.recorded.open(&loaded.tape);
                // Nobody is taken away from a study.
                if !self.view.page.is_of_studies() || self.view.study.state().is_none() {
                    self.view.page = Page::Record;
                }
                self.tapes.open(*loaded);
                self.view.file_notice = None;
            }
            Err(why) => self.view.file_notice = Some(Notice::new(Err(why))),
        }
    }

    fn take_recording(&mut self, news: RecordingNews) {
        if let RecordingNews::Ended { path, .. } = &news {
            self.view.open_path = path.display().to_string();
            self.view.recordings.note_change();
        }
        if let Some(outcome) = self.tapes.take_recording(news) {
            self.view.file_notice = Some(Notice::new(outcome));
        }
    }

    fn take_answer(&mut self, intent: &Intent, result: Result<Answer, WireError>) {
        let intent = intent.itself();
        if matches!(
            intent,
            Intent::Set { .. } | Intent::Load { .. } | Intent::Try { .. } | Intent::Undo | Intent::Redo
        ) {
            self.daemon.note_change(intent, &result);
        }
        if matches!(intent, Intent::Hand { .. }) {
            // No command to the rig: the strip says it.
            self.view.hand.refusal = result.err().map(|refused| refused.message);
            return;
        }
        if matches!(intent, Intent::TrialScene { .. }) {
            // The study says why it was refused.
            return;
        }
        if let Intent::WhatIfSaved { number, path, name } = intent {
            let scene = match result {
                Ok(Answer::Scene(reply)) => Ok(SceneFile {
                    name: name.clone(),
                    ..reply.scene.into()
                }),
                Ok(_) => return,
                Err(refused) => Err(refused.message),
            };
            if let Some(why) = self.tapes.take_scene(*number, path, scene) {
                self.view.file_notice = Some(Notice::new(Err(why)));
            }
            return;
        }
        let View { tuning, fitting, .. } = &mut self.view;
        let others = fitting.take_answer(intent, result);
        let others = others.and_then(|result| tuning.take_answer(intent, result));
        if let Some(result) = others {
            self.daemon.take_outcome(result);
        }
    }
}

/// The scene of the samples in sight: the active one, or that of the newest sample of a recording.
pub(crate) fn scene_seen<'a>(daemon: &'a Daemon, tapes: &'a Tapes, scope: &Scope) -> Option<&'a Scene> {
    let Some(opened) = tapes.opened().filter(|_| !scope.is_of_rig()) else {
        return daemon.mirror.scene.whole.as_ref();
    };
    let newest = scope.tape(tapes).at(scope.seen(tapes).to_s)?;
    opened.scene_at(newest.tick)
}

/// Whether the scene of what is seen has a block; it is thought to have one until the scene is known.
pub(crate) fn has_block(model: &Model) -> bool {
    let Model { daemon, tapes, view } = model;
    scene_seen(daemon, tapes, view.scope(tapes)).is_none_or(|scene| scene.block.is_some())
}
