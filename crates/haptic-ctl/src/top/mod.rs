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
mod theme;

use crate::daemon::Daemon;
use crate::failure::Failure;
use crossterm::event::{self, Event as TerminalEvent, KeyEventKind};
use crossterm::terminal::enable_raw_mode;
use haptic_ipc::{Request, StateReply, Status, SubscribeReply, Topic};
use model::{Intent, Model};
use picture::Picture;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::mpsc;

/// How often it is asked for what no event tells: the link, the thread, the clients.
const STATUS_EVERY: Duration = Duration::from_millis(500);

pub(crate) fn requests() -> Vec<Request> {
    vec![
        Request::Subscribe {
            topics: vec![Topic::State, Topic::Timing, Topic::Samples],
            rate_hz: Some(model::RATE_HZ),
            batch_ms: Some(40),
        },
        Request::Status {},
    ]
}

/// What was answered.
enum Answer {
    Status(Box<Status>),
    Moved(Intent, StateReply),
    Refused(Intent, Failure),
}

pub(crate) async fn run(daemon: &mut Daemon, socket: Option<&Path>) -> Result<(), Failure> {
    if !std::io::stdout().is_terminal() || !std::io::stdin().is_terminal() {
        return Err(Failure::Usage(
            "top needs a terminal; `haptic-ctl events` and `haptic-ctl status` can be piped".to_owned(),
        ));
    }
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    let mut hang_up = signal(SignalKind::hangup())?;
    for request in requests().into_iter().take(1) {
        let _: SubscribeReply = daemon.ask(request).await?;
    }
    let (answering, mut answers) = mpsc::channel(8);
    let stops = Arc::new(AtomicU64::new(0));
    let asking = answered(Daemon::connect(socket).await?, answering.clone(), Arc::clone(&stops));
    let stopping = answered(Daemon::connect(socket).await?, answering, Arc::clone(&stops));
    let model = Arc::new(Mutex::new(Model::new(daemon.hello().server.clone())));
    // No key is lost to the shell's line while the terminal does not yet take a picture.
    enable_raw_mode()?;
    let mut picture = Picture::start(Arc::clone(&model));
    let (typing, mut keys) = mpsc::channel(8);
    std::thread::spawn(move || read_keys(&typing));
    let mut status = tokio::time::interval(STATUS_EVERY);
    let mut status_pending = false;
    let ended = loop {
        tokio::select! {
            event = daemon.regular_event() => match event {
                Ok(event) => lock(&model).take(event),
                Err(failure) => break Err(failure),
            },
            Some(key) = keys.recv() => {
                let intent = Intent::of(key);
                let is_stop = intent == Some(Intent::Stop);
                // What waits behind another answer must not bring the force back after the stop.
                let before = stops.fetch_add(u64::from(is_stop), Ordering::Relaxed);
                let way = if is_stop { &stopping } else { &asking };
                match intent {
                    Some(Intent::Quit) => break Ok(()),
                    Some(intent) if way.try_send((intent, before)).is_err() => lock(&model).hung(),
                    Some(_) => {}
                    None => lock(&model).help_key(key),
                }
                picture.draw_now();
            }
            Some(answer) = answers.recv() => match answer {
                Answer::Status(newest) => {
                    status_pending = false;
                    lock(&model).status = Some(*newest);
                }
                Answer::Moved(intent, reply) => {
                    lock(&model).moved(intent, &reply);
                    picture.draw_now();
                }
                Answer::Refused(intent, failure) => {
                    status_pending &= intent != Intent::Look;
                    lock(&model).refused(&failure);
                    picture.draw_now();
                }
            },
            _ = status.tick() => if !status_pending {
                status_pending = asking.try_send((Intent::Look, 0)).is_ok();
            },
            failure = picture.failed() => break Err(failure),
            _ = interrupt.recv() => break Err(Failure::Interrupted),
            _ = terminate.recv() => break Err(Failure::Silent(128 + 15)),
            _ = hang_up.recv() => break Err(Failure::Silent(128 + 1)),
        }
    };
    picture.end().await;
    ended
}

/// The model, whatever became of a thread that had it.
fn lock(model: &Mutex<Model>) -> MutexGuard<'_, Model> {
    model.lock().unwrap_or_else(PoisonError::into_inner)
}

fn read_keys(typing: &mpsc::Sender<event::KeyEvent>) {
    while let Ok(read) = event::read() {
        if let TerminalEvent::Key(key) = read
            && key.kind != KeyEventKind::Release
            && typing.blocking_send(key).is_err()
        {
            return;
        }
    }
}

/// Asks on a connection of its own what is sent to it, one request after the other. Each comes with the number of
/// stops before it: one that switches the force is void after another stop.
fn answered(mut daemon: Daemon, answering: mpsc::Sender<Answer>, stops: Arc<AtomicU64>) -> mpsc::Sender<(Intent, u64)> {
    let (asking, mut asked) = mpsc::channel::<(Intent, u64)>(8);
    tokio::spawn(async move {
        while let Some((intent, before)) = asked.recv().await {
            if intent.is_void(before, stops.load(Ordering::Relaxed)) {
                continue;
            }
            let answer = match intent.request() {
                None => continue,
                Some(request @ Request::Status {}) => {
                    daemon.ask(request).await.map(|status| Answer::Status(Box::new(status)))
                }
                Some(request) => daemon.ask(request).await.map(|reply| Answer::Moved(intent, reply)),
            };
            let answer = answer.unwrap_or_else(|failure| Answer::Refused(intent, failure));
            if answering.send(answer).await.is_err() {
                return;
            }
        }
    });
    asking
}
