//! `top`: everything that moves, live on a terminal, with keys to stop, engage and release.
//!
//! One connection listens; another asks, in a task of its own, so that no answer that is late keeps
//! the keys or the picture waiting.

mod curve;
mod draw;
mod loops;
mod model;
mod theme;

use crate::colour;
use crate::daemon::Daemon;
use crate::failure::Failure;
use haptic_ipc::{Request, StateReply, Status, SubscribeReply, Topic};
use model::{Intent, Model};
use ratatui::crossterm::event::{self, Event as TerminalEvent, KeyEventKind};
use std::io::IsTerminal;
use std::path::Path;
use std::time::Duration;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::mpsc;

/// Pictures a second that a person can still follow.
const REDRAW_EVERY: Duration = Duration::from_millis(100);
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
    Refused(Failure),
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
    let (asking, asked) = mpsc::channel(8);
    let (answering, mut answers) = mpsc::channel(8);
    tokio::spawn(answer(Daemon::connect(socket).await?, asked, answering));
    let mut model = Model::new(daemon.hello().server.clone());
    // Also puts the terminal back if anything panics.
    let mut terminal = ratatui::try_init()?;
    let _restored = Restore;
    let (typing, mut keys) = mpsc::channel(8);
    std::thread::spawn(move || read_keys(&typing));
    let mut redraw = tokio::time::interval(REDRAW_EVERY);
    let mut status = tokio::time::interval(STATUS_EVERY);
    let mut status_pending = false;
    loop {
        tokio::select! {
            event = daemon.regular_event() => {
                model.take(event?);
                continue;
            }
            Some(key) = keys.recv() => match model.key(key) {
                Some(Intent::Quit) => return Ok(()),
                Some(intent) if asking.try_send(intent).is_err() => model.hung(),
                Some(_) => {}
                None => {}
            },
            Some(answer) = answers.recv() => match answer {
                Answer::Status(newest) => {
                    status_pending = false;
                    model.status = Some(*newest);
                    continue;
                }
                Answer::Moved(intent, reply) => model.moved(intent, &reply),
                Answer::Refused(failure) => {
                    status_pending = false;
                    model.refused(&failure);
                }
            },
            _ = status.tick() => {
                if !status_pending {
                    status_pending = asking.try_send(Intent::Look).is_ok();
                }
                continue;
            }
            _ = redraw.tick() => {}
            _ = interrupt.recv() => return Err(Failure::Interrupted),
            _ = terminate.recv() => return Err(Failure::Silent(128 + 15)),
            _ = hang_up.recv() => return Err(Failure::Silent(128 + 1)),
        }
        let theme = theme::Theme::new(!colour::is_forbidden());
        terminal.draw(|frame| draw::draw(frame, &model, theme))?;
    }
}

/// Puts the terminal back, however the program is left.
struct Restore;

impl Drop for Restore {
    fn drop(&mut self) {
        ratatui::restore();
    }
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

async fn answer(mut daemon: Daemon, mut asked: mpsc::Receiver<Intent>, answering: mpsc::Sender<Answer>) {
    while let Some(intent) = asked.recv().await {
        let answer = match intent.request() {
            None => continue,
            Some(request @ Request::Status {}) => {
                daemon.ask(request).await.map(|status| Answer::Status(Box::new(status)))
            }
            Some(request) => daemon.ask(request).await.map(|reply| Answer::Moved(intent, reply)),
        };
        if answering.send(answer.unwrap_or_else(Answer::Refused)).await.is_err() {
            return;
        }
    }
}
