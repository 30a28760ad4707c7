//! The daemon's log on standard error and, with `--demo`, its status line on standard output.
//!
//! Either may be a pipe that nobody reads or a terminal held with Ctrl-S, where a write blocks. So
//! no thread of the daemon writes by itself: a line goes into a bounded queue, which a thread of
//! its own writes out. When the queue is full the line is dropped and counted, and the count is
//! written as soon as there is room. The end of the process waits for that thread only for a
//! moment.
//!
//! Under systemd the lines go to its journal with fields of their own: the priority, 3 for a fault down to 6, and of an
//! event its operation, fault, tick, client and message id, so that the journal can be searched by them.

mod journald;
mod outlet;

use haptic_ipc::JournalEntry;
use outlet::{Backlog, Outlet};
use rustix::fs::fstat;
use std::backtrace::{Backtrace, BacktraceStatus};
use std::fmt::Write;
use std::os::fd::{AsFd, OwnedFd};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Most lines that wait for standard error.
const BACKLOG_LINES: usize = 256;

/// Longest message, bytes; a longer one is cut. With [`BACKLOG_LINES`] this bounds the memory held
/// for a reader that does not read.
const MAX_LINE: usize = 4096;

/// Time after which the end of the process no longer waits for a write.
const BLOCKED_AFTER: Duration = Duration::from_millis(200);

/// Severity of a line, as in syslog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    Error,
    Warning,
    Info,
}

impl Level {
    /// The severity's number in syslog and for the service manager.
    const fn priority(self) -> u8 {
        match self {
            Self::Error => 3,
            Self::Warning => 4,
            Self::Info => 6,
        }
    }
}

/// Both outlets of the process.
#[derive(Debug)]
struct Log {
    messages: Outlet,
    /// The status line of the demo: only the newest matters.
    status_line: Outlet,
    form: Form,
}

/// How a message is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// Lines for people.
    Plain,
    /// Lines with their priority, for a service manager that reads standard error.
    WithPriority,
    Journal,
}

static LOG: OnceLock<Log> = OnceLock::new();

/// Starts the log. Before that, lines are written directly.
///
/// # Errors
/// The system has no thread left.
pub(crate) fn start() -> std::io::Result<()> {
    let (descriptor, form) = match is_journal().then(journald::connect) {
        Some(Ok(journal)) => (OwnedFd::from(journal), Form::Journal),
        Some(Err(_)) => (standard_error()?, Form::WithPriority),
        None => (standard_error()?, Form::Plain),
    };
    let lost = move |lost| {
        let plural = if lost == 1 { "line" } else { "lines" };
        let message = format!("{lost} {plural} lost: nobody read standard error");
        entry(Level::Warning, &message, &[], form)
    };
    let log = Log {
        messages: Outlet::start("log", descriptor, Backlog::Oldest(BACKLOG_LINES), lost)?,
        status_line: Outlet::start("status-line", std::io::stdout(), Backlog::Newest, |_| String::new())?,
        form,
    };
    if LOG.set(log).is_ok() {
        std::panic::set_hook(Box::new(|panic| {
            let thread = std::thread::current();
            let mut message = format!("thread {} panicked", thread.name().unwrap_or("without a name"));
            if let Some(location) = panic.location() {
                write!(message, " at {location}").unwrap_or_default();
            }
            write!(message, ": {}", panic.payload_as_str().unwrap_or("no message")).unwrap_or_default();
            let backtrace = Backtrace::capture();
            if backtrace.status() == BacktraceStatus::Captured {
                write!(message, "\n{backtrace}").unwrap_or_default();
            }
            say_at(Level::Error, &message);
        }));
    }
    Ok(())
}

fn standard_error() -> std::io::Result<OwnedFd> {
    std::io::stderr().as_fd().try_clone_to_owned()
}

/// Logs a line of severity [`Level::Info`].
pub(crate) fn say(line: &str) {
    say_at(Level::Info, line);
}

pub(crate) fn say_at(level: Level, line: &str) {
    enqueue(level, line, &[]);
}

/// Logs why the process ends, and waits until that is written, at most for `limit`. The journal asks the sender of an
/// entry for its unit, and a process that has ended has none: so the line goes to standard error, which is the unit's.
pub(crate) fn say_last(line: &str, limit: Duration) {
    let outlet = LOG.get().filter(|log| log.form == Form::Journal).and_then(|_| {
        let started = Outlet::start("last-line", standard_error().ok()?, Backlog::Newest, |_| String::new());
        started.ok()
    });
    let Some(outlet) = outlet else {
        return say_at(Level::Error, line);
    };
    outlet.enqueue(entry(Level::Error, line, &[], Form::WithPriority));
    wait_while(limit, || outlet.is_busy(BLOCKED_AFTER));
}

/// Logs a message with fields for the journal.
fn enqueue(level: Level, message: &str, fields: &[(&str, &str)]) {
    match LOG.get() {
        Some(log) => log.messages.enqueue(entry(level, message, fields, log.form)),
        // Only unit tests come here.
        None => eprint!("{}", entry(level, message, fields, Form::Plain)),
    }
}

/// Shows the status line of the demo.
pub(crate) fn show(line: String) {
    if let Some(log) = LOG.get() {
        log.status_line.enqueue(line);
    }
}

/// Logs an entry of the journal, unless it is a change of the scene: there may be a thousand of
/// those a second.
pub(crate) fn journal(entry: &JournalEntry) {
    let level = match entry.op.as_str() {
        "set" | "undo" | "redo" | "scene.load" | "scene.save" => return,
        "engage" | "release" | "reset" | "connected" | "commission.begin" | "commission.store" | "identify.begin"
        | "identify.store" | "reload" => Level::Info,
        "stop" | "lease_lapsed" | "disconnected" => Level::Warning,
        // A fault, and everything unknown.
        _ => Level::Error,
    };
    let number = |value: u64| value.to_string();
    let (tick, revision) = (entry.tick.map(number), number(entry.revision));
    let by = entry.by.as_ref().map(ToString::to_string);
    let fields = [
        (
            "MESSAGE_ID",
            Some(journald::message_id(&entry.op, entry.fault.as_deref())),
        ),
        ("HAPTICD_OP", Some(entry.op.as_str())),
        ("HAPTICD_FAULT", entry.fault.as_deref()),
        ("HAPTICD_TICK", tick.as_deref()),
        ("HAPTICD_BY", by.as_deref()),
        ("HAPTICD_REVISION", Some(revision.as_str())),
    ];
    let fields: Vec<(&str, &str)> = fields
        .into_iter()
        .filter_map(|(name, value)| Some((name, value?)))
        .collect();
    enqueue(level, &entry.to_string(), &fields);
}

/// Waits until the log is written, at most for `limit`, and not for a write that is blocked.
pub(crate) fn flush(limit: Duration) {
    let Some(log) = LOG.get() else { return };
    wait_while(limit, || {
        log.messages.is_busy(BLOCKED_AFTER) || log.status_line.is_busy(BLOCKED_AFTER)
    });
}

fn wait_while(limit: Duration, is_busy: impl Fn() -> bool) {
    let began = Instant::now();
    while began.elapsed() < limit && is_busy() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A message as it is written.
fn entry(level: Level, message: &str, fields: &[(&str, &str)], form: Form) -> String {
    let cut = message.floor_char_boundary(MAX_LINE);
    let dots = if cut < message.len() { "..." } else { "" };
    let message = &message[..cut];
    if form == Form::Journal {
        return journald::entry(level.priority(), &format!("{message}{dots}"), fields);
    }
    let mut text = String::with_capacity(cut + 32);
    for (index, line) in message.lines().enumerate() {
        if form == Form::WithPriority {
            write!(text, "<{}>", level.priority()).unwrap_or_default();
        }
        let name = if index == 0 { "hapticd: " } else { "" };
        writeln!(text, "{name}{line}{dots}").unwrap_or_default();
    }
    text
}

/// Whether standard error is a service manager's journal: the manager names the device and inode of
/// that stream.
fn is_journal() -> bool {
    let Ok(named) = std::env::var("JOURNAL_STREAM") else {
        return false;
    };
    fstat(std::io::stderr()).is_ok_and(|found| named == format!("{}:{}", found.st_dev, found.st_ino))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn message_has_its_priority_on_each_line() {
        let text = |level, message: &str, form| entry(level, message, &[], form);
        assert_eq!(text(Level::Info, "one\ntwo", Form::Plain), "hapticd: one\ntwo\n");
        assert_eq!(
            text(Level::Error, "one\ntwo", Form::WithPriority),
            "<3>hapticd: one\n<3>two\n"
        );
        assert_eq!(text(Level::Warning, "one", Form::WithPriority), "<4>hapticd: one\n");
        let long = text(Level::Info, &format!("x{}", "é".repeat(MAX_LINE)), Form::WithPriority);
        assert!(long.len() < MAX_LINE + 32 && long.ends_with("é...\n"), "{long}");
    }
}
