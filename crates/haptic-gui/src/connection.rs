//! The daemon at the other end of two channels: this is the only file of the panel that does I/O.
//!
//! One thread connects, listens, and connects again for as long as the panel lives; another sends, so that a daemon that
//! does not read cannot freeze the window. A stop overtakes whatever waits to be sent. One that could not be sent, or whose
//! answer was lost with the connection, is kept and is the first thing said to the next daemon that answers: too much of
//! a stop is safe, too little is not.

use crate::beat::Beat;
use crate::intent::Intent;
use crate::recording::Taking;
use crate::update::{Answer, Update};
use haptic_ipc::{
    Client, ClientError, ErrorCode, Event, Receiver, Request, Sender, ServerLine, StateEvent, Topic, WireError,
};
use serde::de::DeserializeOwned;
use std::cell::Cell;
use std::collections::HashMap;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Time between batches of samples, ms. Each batch is one repaint, so this is also the frame time: 30 a second.
const BATCH_MS: u32 = 34;

/// Changes made before the panel listened that it asks for.
const PAST_CHANGES: usize = 20;

/// How patient the connection is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// Wait between two attempts to connect.
    pub retry: Duration,
    /// After how long a silent daemon is given up. It reports on its timing every second, so silence is trouble.
    pub silence: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self {
            retry: Duration::from_millis(500),
            silence: Duration::from_secs(5),
        }
    }
}

/// A connection that mends itself.
#[derive(Debug)]
pub struct Connection {
    intents: mpsc::Sender<Intent>,
    updates: mpsc::Receiver<Update>,
}

impl Connection {
    /// Starts to connect to the socket that `locate` names, asked anew before each attempt: the daemon may be started later
    /// and elsewhere. `repaint` is called from another thread whenever there is news to draw, with how long it may wait: what
    /// comes in one after the other is drawn at once, 30 times a second at most.
    ///
    /// # Errors
    /// The system has no thread left.
    pub fn start(
        locate: impl Fn() -> PathBuf + Send + 'static,
        patience: Patience,
        repaint: impl Fn(Duration) + Send + 'static,
    ) -> io::Result<Self> {
        let (intents, asked) = mpsc::channel();
        let (news, updates) = mpsc::channel();
        let shared = Arc::new(Shared::default());
        let listener = Listener {
            shared: Arc::clone(&shared),
            news,
            repaint: Box::new(repaint),
            patience,
            beat: Cell::default(),
        };
        thread::Builder::new()
            .name("listen".to_owned())
            // The only way out is that nobody wants the news any more.
            .spawn(move || listener.run(&locate).unwrap_or(()))?;
        thread::Builder::new()
            .name("ask".to_owned())
            .spawn(move || ask(&asked, &shared))?;
        Ok(Self { intents, updates })
    }

    /// Sends an intent. What comes of it is heard as [`Update::Answered`], or, when the connection is lost first, as
    /// [`Update::Disconnected`].
    pub fn send(&self, intent: Intent) {
        // The asking thread lives as long as `self`; were it gone, so would be the connection, which is told elsewhere.
        self.intents.send(intent).unwrap_or(());
    }

    /// The news since last time, without waiting.
    pub fn updates(&self) -> impl Iterator<Item = Update> + '_ {
        self.updates.try_iter()
    }

    /// The next piece of news, waiting for it at most `limit`.
    #[must_use]
    pub fn wait(&self, limit: Duration) -> Option<Update> {
        self.updates.recv_timeout(limit).ok()
    }
}

/// What both threads use.
#[derive(Debug, Default)]
struct Shared {
    outgoing: Mutex<Outgoing>,
    /// Signalled with [`Outgoing::hurries`].
    hurry: Condvar,
}

#[derive(Debug, Default)]
struct Outgoing {
    sender: Option<Sender>,
    /// What the answers to come belong to.
    asked: HashMap<u64, Asked>,
    /// A stop is still to be sent.
    stop_waits: bool,
    /// A stop was asked for since the last attempt to connect: the next is due at once.
    hurries: bool,
    /// The recording that is being made.
    taking: Option<Taking>,
    /// News that the listening thread has not told yet.
    untold: Vec<Update>,
    advice: Follow<u64>,
    scene: Follow<u64>,
    /// By law and parameters: the table is another where those are.
    description: Follow<(String, Vec<String>)>,
}

/// How far something that follows from the scene has been asked for.
#[derive(Debug)]
struct Follow<K> {
    /// What it follows, as of the newest news.
    newest: Option<K>,
    /// What that was when it was last asked for.
    asked: Option<K>,
    /// It is not answered yet. Asked once at a time, the daemon cannot be swamped by a slider that is dragged.
    is_unanswered: bool,
    /// The daemon has none.
    is_missing: bool,
}

impl<K> Default for Follow<K> {
    fn default() -> Self {
        Self {
            newest: None,
            asked: None,
            is_unanswered: false,
            is_missing: false,
        }
    }
}

impl<K: Clone + PartialEq> Follow<K> {
    /// Whether it is to be asked for now.
    fn is_due(&mut self) -> bool {
        if self.is_missing || self.is_unanswered || self.newest == self.asked {
            return false;
        }
        self.asked.clone_from(&self.newest);
        self.is_unanswered = true;
        true
    }

    fn answered(&mut self, result: &Result<serde_json::Value, WireError>) {
        self.is_unanswered = false;
        self.is_missing = result.as_ref().is_err_and(|error| error.code == ErrorCode::UnknownOp);
    }
}

#[derive(Debug)]
enum Asked {
    Intent(Intent),
    Describe,
    Subscribe,
    Advise,
    Scene,
    Library,
    Journal,
    Status,
}

impl Shared {
    fn outgoing(&self) -> MutexGuard<'_, Outgoing> {
        // The state is whole between any two statements, so a panic elsewhere does not spoil it.
        self.outgoing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Outgoing {
    /// Sends a request, or says why not.
    fn send(&mut self, request: Request, asked: Asked) -> Result<(), ClientError> {
        let sender = self.sender.as_mut().ok_or(ClientError::Closed)?;
        let id = sender.send(request)?;
        self.asked.insert(id, asked);
        Ok(())
    }

    /// Begins a recording, or ends it.
    fn record(&mut self, intent: Intent) {
        let ended = self.taking.take().map(Taking::end);
        self.untold.extend(ended.map(Update::Recording));
        if let Intent::Record { folder, metadata } = intent {
            match Taking::begin(&folder, *metadata) {
                Ok(taking) => {
                    self.untold.push(Update::Recording(taking.news()));
                    self.taking = Some(taking);
                }
                Err(news) => self.untold.push(Update::Recording(news)),
            }
        }
    }

    /// Writes an event into the recording that is being made.
    fn keep(&mut self, event: &Event) {
        let Some(taking) = &mut self.taking else {
            return;
        };
        let news = match taking.hear(event) {
            Ok(()) => taking.news(),
            Err(news) => {
                self.taking = None;
                news
            }
        };
        self.untold.push(Update::Recording(news));
    }

    /// Hears of the scene in force.
    fn hear(&mut self, state: &StateEvent) {
        let revision = self.advice.newest.max(Some(state.revision));
        (self.advice.newest, self.scene.newest) = (revision, revision);
        let shape = (state.law.clone(), state.params.keys().cloned().collect());
        if self.description.asked.is_none() {
            // That of the first news was asked for with the greeting.
            self.description.asked = Some(shape.clone());
        }
        self.description.newest = Some(shape);
    }

    /// Asks for what follows from a scene that is new.
    fn follow(&mut self) -> Result<(), ClientError> {
        if self.description.is_due() {
            self.send(Request::Describe {}, Asked::Describe)?;
        }
        if self.scene.is_due() {
            self.send(Request::get(), Asked::Scene)?;
        }
        if self.advice.is_due() {
            self.send(Request::Advise {}, Asked::Advise)?;
        }
        Ok(())
    }
}

/// Sends what the user asks for until the panel is gone.
fn ask(intents: &mpsc::Receiver<Intent>, shared: &Shared) {
    while let Ok(first) = intents.recv() {
        let mut waiting: Vec<Intent> = std::iter::once(first).chain(intents.try_iter()).collect();
        if waiting.contains(&Intent::Stop) {
            // The stop goes first, and nothing that was asked around it may bring the force back.
            waiting.retain(|intent| !intent.is_void_after_stop());
            waiting.insert(0, Intent::Stop);
        }
        for intent in waiting {
            let mut outgoing = shared.outgoing();
            let Some(request) = intent.request() else {
                outgoing.record(intent);
                continue;
            };
            let sent = outgoing.send(request, Asked::Intent(intent.clone()));
            // Anything but a stop is void with its connection, and the listening thread tells of the loss.
            if sent.is_err() && intent == Intent::Stop {
                outgoing.stop_waits = true;
                outgoing.hurries = true;
                shared.hurry.notify_all();
            }
        }
    }
}

/// Nobody wants the news any more.
#[derive(Debug)]
struct PanelGone;

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

struct Listener {
    shared: Arc<Shared>,
    news: mpsc::Sender<Update>,
    repaint: Box<dyn Fn(Duration) + Send>,
    beat: Cell<Beat>,
    patience: Patience,
}

impl Listener {
    fn run(&self, locate: &impl Fn() -> PathBuf) -> Result<(), PanelGone> {
        let mut path = locate();
        let mut told = None;
        self.tell(Update::Connecting { path: path.clone() })?;
        loop {
            let reason = match self.converse(&path) {
                End::PanelGone => return Err(PanelGone),
                End::Lost(reason) => reason,
            };
            let was_connected = self.hang_up();
            let untold = std::mem::take(&mut self.shared.outgoing().untold);
            untold.into_iter().try_for_each(|update| self.tell(update))?;
            let lost = Update::Disconnected { path, reason };
            if was_connected || told.as_ref() != Some(&lost) {
                self.tell(lost.clone())?;
                told = Some(lost);
            } else {
                // Nothing new to draw, but the way to learn that the panel is gone.
                self.news.send(lost).map_err(|_| PanelGone)?;
            }
            self.pause();
            path = locate();
        }
    }

    fn tell(&self, update: Update) -> Result<(), PanelGone> {
        self.news.send(update).map_err(|_| PanelGone)?;
        let mut beat = self.beat.get();
        (self.repaint)(beat.wait(Instant::now()));
        self.beat.set(beat);
        Ok(())
    }

    /// Talks to the daemon at `path` until one of them goes.
    fn converse(&self, path: &Path) -> End {
        let lost = self.listen(path);
        lost.err().unwrap_or(End::PanelGone)
    }

    fn listen(&self, path: &Path) -> Result<std::convert::Infallible, End> {
        let client = Client::connect(path)?;
        let hello = client.hello().clone();
        let (sender, mut receiver) = client.split();
        receiver.set_timeout(Some(self.patience.silence))?;
        self.introduce(sender)?;
        self.tell(Update::Connected {
            path: path.to_path_buf(),
            hello,
        })?;
        loop {
            let update = self.next(&mut receiver)?;
            let untold = std::mem::take(&mut self.shared.outgoing().untold);
            for update in untold.into_iter().chain(update) {
                self.tell(update)?;
            }
        }
    }

    /// Hands over the sending half and asks for everything that the panel shows.
    fn introduce(&self, sender: Sender) -> Result<(), ClientError> {
        let mut outgoing = self.shared.outgoing();
        outgoing.sender = Some(sender);
        if outgoing.stop_waits {
            outgoing.send(Request::Stop {}, Asked::Intent(Intent::Stop))?;
            outgoing.stop_waits = false;
        }
        outgoing.send(Request::Describe {}, Asked::Describe)?;
        let subscribe = Request::Subscribe {
            topics: vec![Topic::State, Topic::Timing, Topic::Samples, Topic::Log],
            // Every tick: a spike of a single one must be seen.
            rate_hz: None,
            batch_ms: Some(BATCH_MS),
        };
        outgoing.send(subscribe, Asked::Subscribe)?;
        outgoing.send(Request::SceneList {}, Asked::Library)?;
        let log = Request::Log {
            after: None,
            limit: Some(PAST_CHANGES),
        };
        outgoing.send(log, Asked::Journal)
    }

    fn next(&self, receiver: &mut Receiver) -> Result<Option<Update>, End> {
        match receiver.receive() {
            Ok(ServerLine::Event(event)) => {
                let mut outgoing = self.shared.outgoing();
                outgoing.keep(&event);
                match &event {
                    Event::State(state) => {
                        outgoing.hear(state);
                        outgoing.follow()?;
                    }
                    // Once a second, as often as this is news.
                    Event::Timing(_) => outgoing.send(Request::Status {}, Asked::Status)?,
                    _ => {}
                }
                drop(outgoing);
                Ok(Some(Update::Event(event)))
            }
            Ok(ServerLine::Answer { id, result }) => {
                let mut outgoing = self.shared.outgoing();
                let asked = id.and_then(|id| outgoing.asked.remove(&id));
                match &asked {
                    Some(Asked::Advise) => outgoing.advice.answered(&result),
                    Some(Asked::Scene) => outgoing.scene.answered(&result),
                    Some(Asked::Describe) => outgoing.description.answered(&result),
                    Some(Asked::Intent(Intent::Save { .. })) if result.is_ok() => {
                        outgoing.send(Request::SceneList {}, Asked::Library)?;
                    }
                    _ => {}
                }
                outgoing.follow()?;
                drop(outgoing);
                asked.map_or(Ok(None), |asked| answered(asked, result))
            }
            Ok(ServerLine::Hello(_)) => Ok(None),
            Err(ClientError::BadAnswer(error)) => Ok(Some(Update::Unreadable {
                reason: error.to_string(),
            })),
            Err(ClientError::Io(error))
                if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) =>
            {
                let silence = self.patience.silence.as_secs_f64();
                Err(End::Lost(format!("the daemon said nothing for {silence} s")))
            }
            Err(error) => Err(error.into()),
        }
    }

    /// Ends a conversation; says whether there was one. A stop that was not answered is kept for the next.
    fn hang_up(&self) -> bool {
        let mut outgoing = self.shared.outgoing();
        let stop_was_unanswered = outgoing
            .asked
            .values()
            .any(|asked| matches!(asked, Asked::Intent(Intent::Stop)));
        outgoing.stop_waits |= stop_was_unanswered;
        outgoing.asked.clear();
        // What follows from another daemon would be another recording.
        let ended = outgoing.taking.take().map(Taking::end);
        outgoing.untold.extend(ended.map(Update::Recording));
        outgoing.advice = Follow::default();
        outgoing.scene = Follow::default();
        outgoing.description = Follow::default();
        outgoing.sender.take().is_some()
    }

    /// Waits before the next attempt, but not when a stop is asked for meanwhile.
    fn pause(&self) {
        let outgoing = self.shared.outgoing();
        let calm = |outgoing: &mut Outgoing| !outgoing.hurries;
        let waited = self
            .shared
            .hurry
            .wait_timeout_while(outgoing, self.patience.retry, calm);
        let (mut outgoing, _) = waited.unwrap_or_else(PoisonError::into_inner);
        outgoing.hurries = false;
    }
}

/// What an answer means to the panel.
fn answered(asked: Asked, result: Result<serde_json::Value, WireError>) -> Result<Option<Update>, End> {
    match asked {
        Asked::Subscribe => {
            result.map_err(|error| End::Lost(format!("the daemon refused the subscription: {error}")))?;
            Ok(None)
        }
        Asked::Describe => {
            let description =
                result.map_err(|error| End::Lost(format!("the daemon refused to describe its parameters: {error}")))?;
            let description = serde_json::from_value(description).map_err(ClientError::BadAnswer)?;
            Ok(Some(Update::Described(description)))
        }
        Asked::Advise => Ok(Some(Update::Advised(read(result, "a request for advice")))),
        Asked::Scene => Ok(Some(Update::Scene(
            read(result, "a request for the scene").map(Box::new),
        ))),
        Asked::Library => Ok(Some(Update::Library(read(result, "a request for the library")))),
        Asked::Journal => Ok(Some(Update::Journal(read(result, "a request for the log")))),
        Asked::Status => Ok(Some(Update::Status(
            read(result, "a request for the status").map(Box::new),
        ))),
        Asked::Intent(intent) => {
            let answer = match intent {
                Intent::Set { .. } | Intent::Load { .. } | Intent::Undo | Intent::Redo | Intent::TakeBack { .. } => {
                    read(result, &intent).map(Answer::Changed)
                }
                Intent::Save { .. } => read(result, &intent).map(Answer::Saved),
                Intent::Compare { .. } => read(result, &intent).map(Answer::Differs),
                _ => read(result, &intent).map(Answer::State),
            };
            Ok(Some(Update::Answered { intent, result: answer }))
        }
    }
}

fn read<T: DeserializeOwned>(
    result: Result<serde_json::Value, WireError>,
    asked: impl fmt::Display,
) -> Result<T, WireError> {
    serde_json::from_value(result?).map_err(|error| unreadable(asked, &error))
}

/// An answer that cannot be read is as good as a refusal.
fn unreadable(asked: impl fmt::Display, error: &serde_json::Error) -> WireError {
    let message = format!("the daemon's answer to {asked} cannot be read: {error}");
    WireError::new(ErrorCode::Unknown, message)
}
