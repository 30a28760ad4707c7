//! `top`: everything that moves, live on a terminal, with keys to stop, engage and release.
//!
//! Nothing here keeps a stop waiting. One connection listens, one asks and one is for stops alone,
//! each in a task of its own; the picture has a thread ([`picture`]), for a terminal may take none
//! for as long as it likes.

mod curve;
mod draw;
mod loops;
mod model;
mod picture;

use crate::console::Signals;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::stop;
use crossterm::event::{self, Event as TerminalEvent, KeyEvent, KeyEventKind};
use crossterm::terminal::enable_raw_mode;
use haptic_ipc::{Request, StateReply, Status, SubscribeReply, Topic, socket_path};
use model::{Intent, Model, lock};
use picture::Picture;
use rustix::process::Signal;
use serde::de::DeserializeOwned;
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

/// How often it is asked for what no event reports: the link, the thread, the clients.
const STATUS_EVERY: Duration = Duration::from_millis(500);

/// How long a request that may bring force waits for its answer.
const WITHDRAWN_AFTER: Duration = Duration::from_secs(2);

enum Answer {
    Status(Box<Status>),
    Moved(Intent, StateReply),
    /// A stop has no answer yet.
    Late,
    Refused(Intent, Failure),
}

pub(crate) async fn run(daemon: &mut Daemon, socket: Option<&Path>) -> Result<(), Failure> {
    if !std::io::stdout().is_terminal() || !std::io::stdin().is_terminal() {
        return Err(Failure::Usage(
            "top needs a terminal; `haptic-ctl log --follow` and `haptic-ctl status` can be piped".to_owned(),
        ));
    }
    let mut signals = Signals::new()?;
    let _: SubscribeReply = daemon
        .ask(Request::Subscribe {
            topics: vec![Topic::State, Topic::Timing, Topic::Samples],
            rate_hz: Some(model::RATE_HZ),
            batch_ms: Some(40),
        })
        .await?;
    let mut screen = Screen::start(daemon, socket).await?;
    let ended = screen.follow(daemon, &mut signals).await;
    screen.picture.end().await;
    ended
}

/// What is shown, and the tasks behind it.
struct Screen {
    model: Arc<Mutex<Model>>,
    picture: Picture,
    keys: mpsc::Receiver<KeyEvent>,
    /// Requests other than stops.
    asking: mpsc::Sender<(Intent, u64)>,
    /// Stops.
    stopping: mpsc::Sender<(Intent, u64)>,
    answers: mpsc::Receiver<Answer>,
    /// Stops so far.
    stops: Arc<AtomicU64>,
    status_pending: bool,
    /// When the last event came.
    last_event: Instant,
}

impl Screen {
    /// Connects, and takes the terminal.
    async fn start(daemon: &Daemon, socket: Option<&Path>) -> Result<Self, Failure> {
        let (answering, answers) = mpsc::channel(8);
        let stops = Arc::new(AtomicU64::new(0));
        let asking = answered(Asker::connect(socket).await?, answering.clone(), Arc::clone(&stops));
        let stopping = answered(Asker::connect(socket).await?, answering, Arc::clone(&stops));
        let mut title = daemon.hello().server.clone();
        if let Some(rig) = socket_path::name_of(&socket_path::for_client(socket)) {
            title = format!("rig {rig}, {title}");
        }
        let model = Arc::new(Mutex::new(Model::new(&title)));
        // No key is lost to the shell's line while the terminal does not yet take a picture.
        enable_raw_mode()?;
        let picture = Picture::start(Arc::clone(&model));
        let (typing, keys) = mpsc::channel(8);
        std::thread::spawn(move || read_keys(&typing));
        Ok(Self {
            model,
            picture,
            keys,
            asking,
            stopping,
            answers,
            stops,
            status_pending: false,
            last_event: Instant::now(),
        })
    }

    /// Shows what happens and does what the keys say, until a key, a signal or a failure ends it.
    async fn follow(&mut self, daemon: &mut Daemon, signals: &mut Signals) -> Result<(), Failure> {
        let mut status = tokio::time::interval(STATUS_EVERY);
        loop {
            tokio::select! {
                event = daemon.regular_event() => match event {
                    Ok(event) => {
                        self.last_event = Instant::now();
                        lock(&self.model).take(event);
                    }
                    Err(failure) => return Err(lock(&self.model).lost(failure)),
                },
                Some(key) = self.keys.recv() => {
                    if self.key(key).is_break() {
                        return Ok(());
                    }
                }
                Some(answer) = self.answers.recv() => self.answer(answer),
                _ = status.tick() => if !self.status_pending {
                    self.status_pending = self.asking.try_send((Intent::Look, 0)).is_ok();
                } else if self.last_event.elapsed() >= STATUS_EVERY {
                    lock(&self.model).silent(self.last_event.elapsed());
                    self.picture.draw_now();
                },
                failure = self.picture.failed() => return Err(failure),
                signal = signals.next() => return Err(match signal {
                    Signal::INT => Failure::Interrupted,
                    other => Failure::Silent(128 + u8::try_from(other.as_raw()).unwrap_or_default()),
                }),
            }
        }
    }

    /// Does what a key says; breaks where that is the end.
    fn key(&mut self, key: KeyEvent) -> ControlFlow<()> {
        let intent = Intent::of(key);
        let is_stop = intent == Some(Intent::Stop);
        // What waits behind another answer must not bring the force back after the stop.
        let before = self.stops.fetch_add(u64::from(is_stop), Ordering::Relaxed);
        let queue = if is_stop { &self.stopping } else { &self.asking };
        if is_stop {
            // The answer to the stop before it is none to this one.
            lock(&self.model).stop_sent();
        }
        match intent {
            Some(Intent::Quit) => return ControlFlow::Break(()),
            // Nothing brings force by itself, when the daemon goes on.
            Some(intent) if intent.may_bring_force() && lock(&self.model).is_silent() => {
                lock(&self.model).unsent(intent, "not sent");
            }
            Some(intent) if queue.try_send((intent, before)).is_err() => lock(&self.model).hung(),
            Some(_) => {}
            None => lock(&self.model).help_key(key),
        }
        self.picture.draw_now();
        ControlFlow::Continue(())
    }

    fn answer(&mut self, answer: Answer) {
        match answer {
            Answer::Status(newest) => {
                self.status_pending = false;
                let mut model = lock(&self.model);
                model.daemon.status = Some(newest);
                model.answers();
                return;
            }
            Answer::Moved(intent, reply) => lock(&self.model).moved(intent, &reply),
            Answer::Late => lock(&self.model).late(),
            Answer::Refused(intent, failure) => {
                self.status_pending &= intent != Intent::Look;
                lock(&self.model).refused(intent, &failure);
            }
        }
        self.picture.draw_now();
    }
}

fn read_keys(typing: &mpsc::Sender<KeyEvent>) {
    while let Ok(read) = event::read() {
        if let TerminalEvent::Key(key) = read
            && key.kind != KeyEventKind::Release
            && typing.blocking_send(key).is_err()
        {
            return;
        }
    }
}

/// A connection that asks, made again after one that was given up.
struct Asker {
    socket: Option<PathBuf>,
    daemon: Option<Daemon>,
}

impl Asker {
    async fn connect(socket: Option<&Path>) -> Result<Self, Failure> {
        Ok(Self {
            daemon: Some(Daemon::connect(socket).await?),
            socket: socket.map(Path::to_path_buf),
        })
    }

    async fn ask<R: DeserializeOwned>(&mut self, request: Request) -> Result<R, Failure> {
        let daemon = match &mut self.daemon {
            Some(daemon) => daemon,
            None => self.daemon.insert(Daemon::connect(self.socket.as_deref()).await?),
        };
        daemon.ask(request).await
    }

    /// Asks for what may bring force, and withdraws it with the connection where no answer comes soon: a daemon that
    /// goes on later must not carry it out then.
    async fn ask_now(&mut self, request: Request) -> Result<StateReply, Failure> {
        let asked = tokio::time::timeout(WITHDRAWN_AFTER, self.ask(request)).await;
        let answer = asked.unwrap_or(Err(Failure::NoAnswer(WITHDRAWN_AFTER)));
        self.daemon.take_if(|_| matches!(answer, Err(Failure::NoAnswer(_))));
        answer
    }
}

/// Asks on a connection of its own what is sent to it, one request after the other. Each comes with the number of
/// stops before it: one that switches the force is void after another stop.
fn answered(mut asker: Asker, answering: mpsc::Sender<Answer>, stops: Arc<AtomicU64>) -> mpsc::Sender<(Intent, u64)> {
    let (asking, mut asked) = mpsc::channel::<(Intent, u64)>(8);
    tokio::spawn(async move {
        while let Some((intent, before)) = asked.recv().await {
            if intent.is_void(before, stops.load(Ordering::Relaxed)) {
                continue;
            }
            let answer = match intent.request() {
                None => continue,
                Some(request @ Request::Status {}) => {
                    asker.ask(request).await.map(|status| Answer::Status(Box::new(status)))
                }
                Some(request) if intent.may_bring_force() => {
                    let reply = asker.ask_now(request).await;
                    reply.map(|reply| Answer::Moved(intent, reply))
                }
                Some(request) => {
                    let reply = asker.ask(request);
                    tokio::pin!(reply);
                    let soon = tokio::time::timeout(stop::ALARM, &mut reply);
                    let reply = match soon.await {
                        Ok(reply) => reply,
                        Err(_) => {
                            if intent == Intent::Stop && answering.send(Answer::Late).await.is_err() {
                                return;
                            }
                            reply.await
                        }
                    };
                    reply.map(|reply| Answer::Moved(intent, reply))
                }
            };
            let answer = answer.unwrap_or_else(|failure| Answer::Refused(intent, failure));
            if answering.send(answer).await.is_err() {
                return;
            }
        }
    });
    asking
}
