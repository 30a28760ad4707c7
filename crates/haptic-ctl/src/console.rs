//! The person at the terminal: answers before each step, signals that end a program, and colours.

use crate::failure::Failure;
use crate::hint;
use clap::builder::styling::{AnsiColor, Style};
use rustix::process::Signal;
use std::io::{self, BufRead, IsTerminal, Write};
use std::time::Duration;
use tokio::signal::unix::{self, SignalKind, signal};
use tokio::sync::mpsc;

/// Questions go to standard error, so that standard output has only the findings.
pub(crate) struct Console {
    /// Lines as they are typed; `None` without a terminal.
    lines: Option<mpsc::UnboundedReceiver<String>>,
}

impl Console {
    /// Fails where there is no terminal to ask at.
    pub(crate) fn new(command: &str, yes: bool) -> Result<Self, Failure> {
        if yes {
            return Ok(Self { lines: None });
        }
        if !std::io::stdin().is_terminal() {
            return Err(Failure::Usage(format!(
                "{command} asks before each step, and standard input is not a terminal: --yes answers every question"
            )));
        }
        let (typed, lines) = mpsc::unbounded_channel();
        // The thread may wait for a key for ever; the program ends without it.
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines().map_while(Result::ok) {
                if typed.send(line).is_err() {
                    return;
                }
            }
        });
        Ok(Self { lines: Some(lines) })
    }

    pub(crate) fn asks(&self) -> bool {
        self.lines.is_some()
    }

    /// Prints a line; a closed output is ignored.
    pub(crate) fn say(&self, text: &str) {
        drop(writeln!(std::io::stderr().lock(), "{}", hint::addressed(text)));
    }

    pub(crate) fn prompt(&self, question: &str, choices: &str) {
        let mut out = std::io::stderr().lock();
        let asked = if choices.is_empty() {
            write!(out, "{question} ")
        } else {
            write!(out, "{question} [{choices}] ")
        };
        drop(asked.and_then(|()| out.flush()));
    }

    /// Whether the next line says yes, as the end of the input does not; nothing where no line comes within a time.
    pub(crate) async fn answer(&mut self, time: Duration) -> Option<bool> {
        let Some(lines) = &mut self.lines else {
            return Some(false);
        };
        let line = tokio::time::timeout(time, lines.recv()).await.ok()?.unwrap_or_default();
        Some(["y", "yes"].contains(&line.trim().to_lowercase().as_str()))
    }
}

/// An interrupt, a request to end and a hang-up: caught from here on.
pub(crate) struct Signals([(unix::Signal, Signal); 3]);

impl Signals {
    pub(crate) fn new() -> io::Result<Self> {
        Ok(Self([
            (signal(SignalKind::interrupt())?, Signal::INT),
            (signal(SignalKind::terminate())?, Signal::TERM),
            (signal(SignalKind::hangup())?, Signal::HUP),
        ]))
    }

    /// The next one. Safe to drop half-way.
    pub(crate) async fn next(&mut self) -> Signal {
        let [(interrupt, int), (terminate, term), (hang_up, hup)] = &mut self.0;
        tokio::select! {
            _ = interrupt.recv() => *int,
            _ = terminate.recv() => *term,
            _ = hang_up.recv() => *hup,
        }
    }
}

pub(crate) const GOOD: Style = AnsiColor::Green.on_default();
pub(crate) const DOUBTFUL: Style = AnsiColor::Yellow.on_default();
pub(crate) const BAD: Style = AnsiColor::Red.on_default().bold();

/// Whether colour was forbidden.
pub(crate) fn is_forbidden() -> bool {
    std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
}

/// The text in a style, where standard output shows it.
pub(crate) fn paint(text: &str, style: Style) -> String {
    if is_forbidden() || !std::io::stdout().is_terminal() {
        return text.to_owned();
    }
    format!("{style}{text}{style:#}")
}
