//! What the panel knows: a fold over the daemon's news.

mod stop;

pub(crate) use stop::StopReport;

use crate::intent::Intent;
use crate::notice::{self, Notice};
use crate::plots::Shown;
use crate::recording::{Loaded, Opened, RecordingNews, amount};
use crate::scene::SceneModel;
use crate::scope::Scope;
use crate::update::{Answer, Update};
use egui::Rect;
use haptic_core::Scene;
use haptic_ipc::{Event, RigState, SamplesEvent, StateReply, Status, Timing, WireError};
use haptic_lab::recording::{Metadata, Totals};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Over so much of the past the share of time at the force limit is counted, s.
pub(crate) const CLIPPING_OVER_S: f64 = 10.0;

/// A force this near to the limit is cut by it.
const AT_THE_LIMIT: f64 = 0.999;

/// Everything that the panel shows.
#[derive(Debug)]
pub struct Model {
    link: Link,
    rig: Option<Rig>,
    scene: SceneModel,
    scope: Scope,
    timing: Option<Timing>,
    status: Option<Status>,
    /// Share of the last seconds in which the force was cut by its limit.
    clipping: Option<f64>,
    /// What became of the last export, recording, or file to be opened.
    pub(crate) file_news: Option<Notice>,
    /// The recording that is being made.
    recording: Option<Taken>,
    /// The recording that is looked at.
    opened: Option<Opened>,
    /// The recording to open, as it is typed.
    pub(crate) open_path: String,
    /// Its field is to take the keyboard.
    pub(crate) open_was_pressed: bool,
    /// Those that the user has chosen where there is no room for all.
    pub(crate) plots_shown: Shown,
    /// Those that were drawn.
    pub(crate) plots_seen: &'static [Shown],
    pub(crate) plots_area: Rect,
    /// Whether the user wants to see the histograms; nothing where he has not said.
    pub(crate) histograms_shown: Option<bool>,
    /// The folder to export to, as it is typed.
    pub(crate) export_folder: String,
    losses: Losses,
    stop: StopReport,
    /// Why the daemon refused to engage, release or reset.
    refusal: Option<String>,
}

/// The way to the daemon.
#[derive(Debug)]
pub(crate) enum Link {
    Connecting { path: PathBuf },
    Connected { path: PathBuf, server: String },
    Lost { path: PathBuf, reason: String },
}

/// The rig, as the daemon last described it.
#[derive(Debug)]
pub(crate) struct Rig {
    pub(crate) state: RigState,
    pub(crate) fault: Option<String>,
    /// The tick at which this was so.
    pub(crate) tick: u64,
}

/// The recording that is being made.
#[derive(Debug)]
pub(crate) struct Taken {
    pub(crate) path: PathBuf,
    /// What is written.
    pub(crate) totals: Totals,
    /// Samples that are missing because the disk did not keep up.
    pub(crate) behind: u64,
}

/// What was lost on the way here.
#[derive(Debug, Default)]
pub(crate) struct Losses {
    /// Rows that the daemon could not send to this panel.
    pub(crate) rows: u64,
    /// Lines that this program cannot read, and why not.
    pub(crate) unreadable: u64,
    pub(crate) unreadable_reason: String,
}

impl Default for Model {
    fn default() -> Self {
        Self {
            link: Link::Connecting { path: PathBuf::new() },
            rig: None,
            scene: SceneModel::default(),
            scope: Scope::default(),
            timing: None,
            status: None,
            clipping: None,
            file_news: None,
            recording: None,
            opened: None,
            open_path: String::new(),
            open_was_pressed: false,
            plots_shown: Shown::default(),
            plots_seen: &[Shown::OverTime],
            plots_area: Rect::NOTHING,
            histograms_shown: None,
            export_folder: std::env::var("HOME").unwrap_or_default(),
            losses: Losses::default(),
            stop: StopReport::Settled,
            refusal: None,
        }
    }
}

impl Model {
    /// A panel that has heard nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes a piece of news.
    pub fn apply(&mut self, update: Update) {
        match update {
            Update::Connecting { path } => self.link = Link::Connecting { path },
            Update::Connected { path, hello } => {
                self.forget();
                let server = hello.server;
                self.link = Link::Connected { path, server };
            }
            Update::Disconnected { path, reason } => {
                self.forget();
                self.link = Link::Lost { path, reason };
                // What is on its way is told by its own news. What was known of the rig is void.
                match self.stop {
                    StopReport::Confirmed { .. } => self.stop = StopReport::Settled,
                    StopReport::Failed { .. } => self.stop = stop::no_connection(),
                    _ => {}
                }
            }
            Update::Described(description) => self.scene.take_description(description),
            Update::Scene(Ok(reply)) => self.scene.take_scene(*reply),
            // An older daemon does not say how it is; the rest of the panel does without.
            Update::Scene(Err(_)) | Update::Status(Err(_)) => {}
            Update::Library(result) => self.scene.take_library(result),
            Update::Journal(result) => self.scene.take_journal(result),
            Update::Status(Ok(status)) => {
                self.clipping = self.share_at_limit(&status);
                self.status = Some(*status);
            }
            Update::Recording(news) => self.take_recording(news),
            Update::Opened { path, result } => self.take_opened(path, result),
            Update::Stop(news) => self.take_stop(news),
            Update::Busy(what) => self.file_news = Some(Notice::new(Ok(what))),
            Update::Exported(result) => {
                let told = result.map(|path| format!("Written: {}", path.display()));
                self.file_news = Some(Notice::new(told));
            }
            Update::Advised(result) => self.scene.advised.take(result, self.scene.revision),
            // A topic of a later daemon.
            Update::Event(Event::Unknown) => {}
            Update::Event(Event::Log(entry)) => self.scene.take_entry(*entry),
            Update::Event(Event::State(event)) => {
                let (state, fault, tick) = (event.state, event.fault.clone(), event.tick);
                self.scene.take_state(event);
                self.take_rig(state, fault, tick);
            }
            Update::Event(Event::Timing(timing)) => self.timing = Some(*timing),
            Update::Event(Event::Samples(batch)) => self.take_samples(&batch),
            Update::Answered { intent, result } => self.take_answer(&intent, result),
            Update::Unreadable { reason } => {
                self.losses.unreadable += 1;
                self.losses.unreadable_reason = reason;
            }
        }
    }

    /// Whether a daemon is there to talk to.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        matches!(self.link, Link::Connected { .. })
    }

    /// Shows so long a while, s.
    pub fn show_span(&mut self, span_s: f64) {
        let factor = self.scope.span_s() / span_s;
        self.scope.zoom(factor, 0.0);
    }

    /// Where the plots were drawn, points.
    #[must_use]
    pub fn plots_area(&self) -> Rect {
        self.plots_area
    }

    pub(crate) fn link(&self) -> &Link {
        &self.link
    }

    pub(crate) fn rig(&self) -> Option<&Rig> {
        self.rig.as_ref()
    }

    pub(crate) fn scene(&self) -> &SceneModel {
        &self.scene
    }

    pub(crate) fn scene_mut(&mut self) -> &mut SceneModel {
        &mut self.scene
    }

    pub(crate) fn scope(&self) -> &Scope {
        &self.scope
    }

    pub(crate) fn scope_mut(&mut self) -> &mut Scope {
        &mut self.scope
    }

    /// The scene of what is looked at.
    pub(crate) fn scene_seen(&self) -> Option<&Scene> {
        scene_seen(&self.scope, self.opened.as_ref(), &self.scene)
    }

    /// What the plots need, which is not all of the model.
    pub(crate) fn scope_and_scene(&mut self) -> (&mut Scope, Option<&Scene>) {
        let scene = scene_seen(&self.scope, self.opened.as_ref(), &self.scene);
        (&mut self.scope, scene)
    }

    /// The recording that is being made.
    pub(crate) fn recording(&self) -> Option<&Taken> {
        self.recording.as_ref()
    }

    pub(crate) fn opened(&self) -> Option<&Opened> {
        self.opened.as_ref()
    }

    /// Looks at the live rig again.
    pub(crate) fn close_recording(&mut self) {
        self.scope.close();
        self.opened = None;
    }

    /// What stands at the head of a recording that begins now; nothing before the daemon has said what it takes.
    pub(crate) fn metadata(&self) -> Option<Metadata> {
        let status = self.status.as_ref().filter(|_| self.is_connected())?;
        Some(Metadata {
            server: status.server.clone(),
            device: status.device.description.clone(),
            loop_rate_hz: status.rate_hz,
            rate_hz: status.rate_hz,
            // The clock is that of whoever writes it.
            started_unix_s: 0.0,
            revision: self.scene.revision?,
            scene: self.scene.in_force.clone()?,
        })
    }

    /// Share of the last seconds in which the force was cut by its limit; nothing while no force is on.
    pub(crate) fn clipping(&self) -> Option<f64> {
        self.clipping
    }

    pub(crate) fn timing(&self) -> Option<&Timing> {
        self.timing.as_ref()
    }

    pub(crate) fn losses(&self) -> &Losses {
        &self.losses
    }

    pub(crate) fn stop(&self) -> &StopReport {
        &self.stop
    }

    pub(crate) fn refusal(&self) -> Option<&str> {
        self.refusal.as_deref()
    }

    /// What is to be sent at `now`, and how long until more is. [`ui`](crate::ui) asks for it by itself; a window that is hidden
    /// must, for a try goes back though nobody looks.
    #[must_use = "what is not sent has no effect"]
    pub fn due(&mut self, now: Instant) -> (Vec<Intent>, Option<Duration>) {
        let (intents, wait) = self.scene.due(now);
        self.scene.asked(&intents);
        (intents, wait)
    }

    /// Lets go of what has been said for long enough at `now`; gives how long until there is more of that.
    pub(crate) fn let_go(&mut self, now: Instant) -> Option<Duration> {
        let news = notice::let_go(&mut self.file_news, now);
        let report = notice::let_go(&mut self.scene.report, now);
        let stop = self.age_stop(now);
        news.into_iter().chain(report).chain(stop).min()
    }

    /// What was known of a daemon is void with its connection.
    fn forget(&mut self) {
        self.rig = None;
        self.scene.forget();
        self.scope.lose_live();
        (self.timing, self.status, self.clipping) = (None, None, None);
        self.losses = Losses::default();
        self.refusal = None;
    }

    fn take_opened(&mut self, path: PathBuf, result: Result<Box<Loaded>, String>) {
        match result {
            Ok(loaded) => {
                let Loaded { tape, mut opened } = *loaded;
                opened.path = path;
                self.opened = Some(opened);
                self.scope.open(tape);
                self.file_news = None;
            }
            Err(why) => self.file_news = Some(Notice::new(Err(why))),
        }
    }

    fn take_recording(&mut self, news: RecordingNews) {
        let told = match news {
            RecordingNews::Going { path, totals } => {
                let behind = self.recording.as_ref().map_or(0, |taken| taken.behind);
                self.recording = Some(Taken { path, totals, behind });
                return;
            }
            RecordingNews::Behind { path, lost } => {
                let taken = self.recording.get_or_insert_with(|| Taken {
                    path,
                    totals: Totals::default(),
                    behind: 0,
                });
                taken.behind = lost;
                return;
            }
            RecordingNews::Ended { path, totals } => {
                self.open_path = path.display().to_string();
                Ok(format!("Recorded {}: {}", path.display(), amount(&totals)))
            }
            RecordingNews::Failed { why } => Err(why),
        };
        self.recording = None;
        self.file_news = Some(Notice::new(told));
    }

    fn take_samples(&mut self, batch: &SamplesEvent) {
        self.losses.rows = self.losses.rows.saturating_add(batch.dropped);
        self.scope.extend(&batch.rows);
    }

    /// Share of the last seconds with force on in which it was at its limit, or at that of the device.
    fn share_at_limit(&self, status: &Status) -> Option<f64> {
        let device = status.device.link.as_ref().and_then(|link| link.device.as_ref());
        let limit = device.map_or(f64::INFINITY, |device| device.force_limit_n);
        let limit = AT_THE_LIMIT * limit.min(status.device.force_limit_n);
        let newest = self.scope.last()?.t_s;
        let live = self.scope.live().within(newest - CLIPPING_OVER_S, newest);
        let (mut with_force, mut at_limit) = (0.0, 0.0);
        for sample in live.filter(|sample| sample.state.is_live()) {
            with_force += 1.0;
            at_limit += f64::from(u8::from(sample.command_force_n.abs() >= limit));
        }
        (with_force > 0.0).then(|| at_limit / with_force)
    }

    fn take_rig(&mut self, state: RigState, fault: Option<String>, tick: u64) {
        let known = self.rig.as_ref();
        if known.is_some_and(|known| tick < known.tick) {
            return;
        }
        let is_change = known.is_none_or(|known| known.state != state);
        let was_halted = known.is_some_and(|known| is_halted(known.state));
        // An answer carries no reason; the event that follows it does.
        let fault = fault.or_else(|| known.filter(|_| !is_change).and_then(|known| known.fault.clone()));
        // The tick at which the state began, so that a later event in it does not move "stopped at tick".
        let tick = known.filter(|_| !is_change).map_or(tick, |known| known.tick);
        self.rig = Some(Rig { state, fault, tick });
        if is_change {
            self.refusal = None;
        }
        let is_told = matches!(self.stop, StopReport::Unheard { .. } | StopReport::Confirmed { .. });
        if was_halted && !is_halted(state) && is_told {
            // Somebody has reset it, and goes by what the device does now.
            self.stop = StopReport::Settled;
        }
        // The force is off after all, whoever took it away.
        if is_halted(state) && matches!(self.stop, StopReport::Failed { .. }) {
            self.stop = StopReport::Settled;
        }
    }

    fn take_answer(&mut self, intent: &Intent, result: Result<Answer, WireError>) {
        if *intent == Intent::Stop {
            self.take_stop_answer(None, result);
            return;
        }
        match self.scene.take_answer(intent, result) {
            Some(Ok(Answer::State(StateReply { state, tick }))) => self.take_rig(state, None, tick),
            Some(Err(error)) => self.refusal = Some(error.message),
            Some(Ok(_)) | None => {}
        }
    }
}

fn scene_seen<'a>(scope: &Scope, opened: Option<&'a Opened>, rig: &'a SceneModel) -> Option<&'a Scene> {
    match opened {
        Some(opened) if scope.is_of_recording() => {
            let newest = scope.tape().at(scope.seen().to_s);
            newest.and_then(|sample| opened.scene_at(sample.tick))
        }
        _ => rig.in_force.as_ref(),
    }
}

/// Whether a person or a check has taken the force away until a reset.
pub(crate) fn is_halted(state: RigState) -> bool {
    matches!(state, RigState::Stopped | RigState::Faulted)
}
