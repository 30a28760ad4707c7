//! The thread that connects and listens.

use super::asker::Job;
use super::shared::{Asked, Patience, Shared};
use super::silence::Silence;
use crate::intent::{BATCH_MS, Intent};
use crate::record::Recorder;
use crate::stop::{Guide, Stops};
use crate::study::StudyLink;
use crate::update::{Answer, StopNews, Update};
use crate::update_sender::{PanelGone, UpdateSender};
use haptic_ipc::socket_path::{Environment, NamedSocket};
use haptic_ipc::{
    Client, ClientError, ErrorCode, Event, Receiver, Request, SceneShape, ServerLine, WireError, socket_path,
};
use serde::de::DeserializeOwned;
use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::sync::{Arc, mpsc};
use std::time::Instant;
use std::{fmt, io};

/// Entries of the journal that the panel asks for at first.
const PAST_CHANGES: usize = 20;

/// Why a conversation ended.
enum End {
    PanelGone,
    Lost(String),
}

impl From<PanelGone> for End {
    fn from(_: PanelGone) -> Self {
        Self::PanelGone
    }
}

impl From<ClientError> for End {
    fn from(error: ClientError) -> Self {
        Self::Lost(error.to_string())
    }
}

/// What depends on the scene and is asked for again.
#[derive(Debug, Default)]
struct Following {
    advice: Follow<u64>,
    scene: Follow<u64>,
    /// By law and names of parameters, which decide the rows of the table.
    description: Follow<SceneShape>,
}

pub(super) struct Listener {
    shared: Arc<Shared>,
    stops: Arc<Stops>,
    recorder: Arc<Recorder>,
    study: Arc<StudyLink>,
    jobs: mpsc::Sender<Job>,
    guide: Guide,
    updates: UpdateSender,
    patience: Patience,
    /// Number of the conversation, from 1.
    conversation: u64,
    is_connected: bool,
    following: Following,
    /// The other rigs that the panel knows.
    rigs: Vec<NamedSocket>,
}

impl Listener {
    pub(super) fn new(
        shared: Arc<Shared>,
        stops: Arc<Stops>,
        (recorder, study): (Arc<Recorder>, Arc<StudyLink>),
        jobs: mpsc::Sender<Job>,
        guide: Guide,
        updates: UpdateSender,
        patience: Patience,
    ) -> Self {
        Self {
            shared,
            stops,
            recorder,
            study,
            jobs,
            guide,
            updates,
            patience,
            conversation: 0,
            is_connected: false,
            following: Following::default(),
            rigs: Vec::new(),
        }
    }

    pub(super) fn run(mut self, locate: &impl Fn() -> PathBuf) -> Result<(), PanelGone> {
        let mut path = locate();
        let mut reported = None;
        self.updates.send(Update::Connecting { path: path.clone() })?;
        loop {
            self.guide.lead_to(path.clone(), false);
            let reason = match self.converse(&path) {
                End::PanelGone => return Err(PanelGone),
                End::Lost(reason) => reason,
            };
            let was_connected = self.hang_up();
            let lost = Update::Disconnected {
                path: path.clone(),
                reason,
            };
            if was_connected {
                self.study.hear(&lost);
            }
            if was_connected || reported.as_ref() != Some(&lost) {
                self.updates.send(lost.clone())?;
                reported = Some(lost);
            } else {
                // Nothing new to draw, but it fails once the panel is closed.
                self.updates.send_undrawn(lost)?;
            }
            self.tell_of_rigs(&path)?;
            self.shared.pause(self.patience.retry);
            path = self.shared.chosen().unwrap_or_else(locate);
        }
    }

    /// Tells which other rigs have sockets. It connects to none: that would start their daemons.
    fn tell_of_rigs(&mut self, path: &Path) -> Result<(), PanelGone> {
        let mut rigs = Environment::of_process().all(None);
        rigs.retain(|rig| rig.path != path);
        if rigs != self.rigs {
            self.updates.send(Update::Rigs(rigs.clone()))?;
            self.rigs = rigs;
        }
        Ok(())
    }

    /// Talks to the daemon at `path` until one of them goes.
    fn converse(&mut self, path: &Path) -> End {
        let client = match Client::connect(path) {
            Ok(client) => client,
            Err(error) => return error.into(),
        };
        let hello = client.hello().clone();
        self.stops.greeted(&hello.session);
        let (sender, mut receiver) = client.split();
        self.conversation += 1;
        self.is_connected = true;
        let lost = (|| -> Result<Infallible, End> {
            self.do_next(Job::Introduce {
                conversation: self.conversation,
                sender,
                requests: introduction(),
            });
            let connected = Update::Connected {
                path: path.to_path_buf(),
                hello,
                ctl_options: socket_path::options_to(path),
            };
            self.study.hear(&connected);
            self.updates.send(connected)?;
            self.guide.lead_to(path.to_path_buf(), true);
            let mut silence = Silence::new(Instant::now());
            loop {
                if let Some(update) = self.next(&mut receiver, &mut silence)? {
                    self.study.hear(&update);
                    if !matches!(update, Update::Event(Event::Samples(_))) {
                        self.follow();
                    }
                    self.updates.send(update)?;
                }
                if let Some(lasts) = silence.news(Instant::now()) {
                    self.updates.send(Update::NoSample(lasts))?;
                }
            }
        })();
        // The other half may be blocked in a write to a daemon that does not read.
        receiver.hang_up();
        lost.err().unwrap_or(End::PanelGone)
    }

    fn do_next(&self, job: Job) {
        // The asking thread lives as long as the panel.
        self.jobs.send(job).unwrap_or(());
    }

    fn ask(&self, request: Request, asked: Asked) {
        self.do_next(Job::Ask {
            conversation: self.conversation,
            request,
            asked,
        });
    }

    fn next(&mut self, receiver: &mut Receiver, silence: &mut Silence) -> Result<Option<Update>, End> {
        let longest = self.patience.silence;
        receiver.set_timeout(Some(silence.wait(Instant::now()).min(longest)))?;
        let received = receiver.receive();
        let now = Instant::now();
        if !matches!(received, Err(ClientError::Io(_))) {
            silence.hear(matches!(received, Ok(ServerLine::Event(Event::Samples(_)))), now);
        }
        match received {
            Ok(ServerLine::Event(event)) => {
                self.recorder.keep(&event);
                if let Event::Timing(_) = &event {
                    // Once a second, as often as the timing.
                    self.ask(Request::Status {}, Asked::Status);
                }
                Ok(Some(Update::Event(event)))
            }
            Ok(ServerLine::Answer { id, result }) => {
                let asked = id.and_then(|id| self.shared.asked().remove(&(self.conversation, id)));
                match &asked {
                    Some(Asked::Advise) => self.following.advice.answered(&result),
                    Some(Asked::Scene) => self.following.scene.answered(&result),
                    Some(Asked::Describe) => self.following.description.answered(&result),
                    Some(Asked::Intent(Intent::Save { .. })) if result.is_ok() => {
                        self.ask(Request::SceneList {}, Asked::Library);
                        self.ask(Request::Status {}, Asked::Status);
                    }
                    _ => {}
                }
                asked.map_or(Ok(None), |asked| self.answered(asked, result))
            }
            Ok(ServerLine::Hello(_)) => Ok(None),
            Err(ClientError::BadAnswer(error)) => Ok(Some(Update::Unreadable {
                reason: error.to_string(),
            })),
            Err(ClientError::Io(error))
                if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) =>
            {
                if silence.since_line(now) < longest {
                    return Ok(None);
                }
                let longest = longest.as_secs_f64();
                Err(End::Lost(format!("the daemon sent nothing for {longest} s")))
            }
            Err(error) => Err(error.into()),
        }
    }

    fn answered(&self, asked: Asked, result: Result<serde_json::Value, WireError>) -> Result<Option<Update>, End> {
        match asked {
            Asked::Subscribe => {
                let reply =
                    result.map_err(|error| End::Lost(format!("the daemon refused the subscription: {error}")))?;
                let reply = serde_json::from_value(reply).map_err(ClientError::BadAnswer)?;
                Ok(Some(Update::Subscribed(Box::new(reply))))
            }
            Asked::Describe => {
                let description = result
                    .map_err(|error| End::Lost(format!("the daemon refused to describe its parameters: {error}")))?;
                let description = serde_json::from_value(description).map_err(ClientError::BadAnswer)?;
                Ok(Some(Update::Described(description)))
            }
            // It shows in the samples.
            Asked::Intent(Intent::Hand { .. }) if result.is_ok() => Ok(None),
            Asked::Advise => Ok(Some(Update::Advised(read(result, "a request for advice")))),
            Asked::Scene => Ok(Some(Update::Scene(
                read(result, "a request for the scene").map(Box::new),
            ))),
            Asked::Library => Ok(Some(Update::Library(read(result, "a request for the library")))),
            Asked::Journal => Ok(Some(Update::Journal(read(result, "a request for the log")))),
            Asked::Status => Ok(Some(Update::Status(
                read(result, "a request for the status").map(Box::new),
            ))),
            Asked::Stop(number) => Ok(self.stopped(number, result)),
            Asked::Intent(intent) => {
                let result = result.map_err(|refusal| intent.refused(refusal));
                let answer = match intent.itself() {
                    Intent::Set { .. }
                    | Intent::Load { .. }
                    | Intent::Try { .. }
                    | Intent::TrialScene { .. }
                    | Intent::Foresee { .. }
                    | Intent::Undo
                    | Intent::Redo
                    | Intent::TakeBack { .. } => read(result, &intent).map(Answer::Changed),
                    Intent::Lease { .. } => read(result, &intent).map(Answer::Leased),
                    Intent::Save { .. } => read(result, &intent).map(Answer::Saved),
                    Intent::Compare { .. } => read(result, &intent).map(Answer::Differs),
                    Intent::WhatIfSaved { .. } => read(result, &intent).map(|reply| Answer::Scene(Box::new(reply))),
                    _ => read(result, &intent).map(Answer::State),
                };
                Ok(Some(Update::Answered { intent, result: answer }))
            }
        }
    }

    /// Takes the answer to a stop: once it is here, the path of stops has nothing left to report.
    fn stopped(&self, number: u64, result: Result<serde_json::Value, WireError>) -> Option<Update> {
        self.stops.settle(number);
        let after = self.stops.pressed_at().elapsed();
        let result = read(result, Intent::Stop);
        // The outcome of an older stop says nothing of the newest.
        (number == self.stops.pressed()).then(|| Update::Stop(StopNews::Answered { after, result }))
    }

    /// Asks for what depends on a new scene.
    fn follow(&mut self) {
        let (revision, shape) = self
            .study
            .with_daemon(|daemon| (daemon.revision(), daemon.scene.shape().cloned()));
        // The first description was asked for after the greeting.
        self.following.description.note_asked(shape.clone());
        if self.following.description.is_due(shape) {
            self.ask(Request::Describe {}, Asked::Describe);
        }
        if self.following.scene.is_due(revision) {
            self.ask(Request::get(), Asked::Scene);
        }
        if self.following.advice.is_due(revision) {
            self.ask(Request::Advise {}, Asked::Advise);
        }
    }

    /// Ends a conversation; returns whether there was one.
    fn hang_up(&mut self) -> bool {
        self.shared.asked().clear();
        // Samples of another daemon belong to another recording.
        self.recorder.end();
        self.following = Following::default();
        std::mem::take(&mut self.is_connected)
    }
}

/// The first requests: everything that the panel shows.
fn introduction() -> Vec<(Request, Asked)> {
    let batch_ms = BATCH_MS;
    let subscribe = Intent::Stream { batch_ms }.request();
    let log = Request::Log {
        after: None,
        limit: Some(PAST_CHANGES),
    };
    let mut requests = vec![(Request::Describe {}, Asked::Describe)];
    requests.extend(subscribe.map(|subscribe| (subscribe, Asked::Subscribe)));
    requests.extend([(Request::SceneList {}, Asked::Library), (log, Asked::Journal)]);
    requests
}

fn read<T: DeserializeOwned>(
    result: Result<serde_json::Value, WireError>,
    asked: impl fmt::Display,
) -> Result<T, WireError> {
    serde_json::from_value(result?).map_err(|error| unreadable(asked, &error))
}

/// An unreadable answer counts as a refusal.
fn unreadable(asked: impl fmt::Display, error: &serde_json::Error) -> WireError {
    let message = format!("the daemon's answer to {asked} cannot be read: {error}");
    WireError::new(ErrorCode::Unknown, message)
}

/// The state of a request that is repeated whenever the scene changes.
#[derive(Debug)]
struct Follow<K> {
    /// What it depends on, when it was last asked.
    asked: Option<K>,
    /// It has no answer yet. One request at a time: a dragged slider does not swamp the daemon.
    is_unanswered: bool,
    /// The daemon does not know the request.
    is_missing: bool,
}

impl<K> Default for Follow<K> {
    fn default() -> Self {
        Self {
            asked: None,
            is_unanswered: false,
            is_missing: false,
        }
    }
}

impl<K: Clone + PartialEq> Follow<K> {
    /// It was asked for before anything was known.
    fn note_asked(&mut self, newest: Option<K>) {
        if self.asked.is_none() {
            self.asked = newest;
        }
    }

    /// Whether to ask for what depends on `newest` now; then it counts as asked.
    fn is_due(&mut self, newest: Option<K>) -> bool {
        if self.is_missing || self.is_unanswered || newest == self.asked {
            return false;
        }
        self.asked = newest;
        self.is_unanswered = true;
        true
    }

    fn answered(&mut self, result: &Result<serde_json::Value, WireError>) {
        self.is_unanswered = false;
        self.is_missing = result.as_ref().is_err_and(|error| error.code == ErrorCode::UnknownOp);
    }
}
