//! The daemon's log on standard error and, with `--demo`, its status line on standard output.
//!
//! Either may be a pipe that nobody reads or a terminal held with Ctrl-S, where a write blocks. So
//! no thread of the daemon writes by itself: a line goes into a bounded queue, which a thread of
//! its own writes out. When the queue is full the line is dropped and counted, and the count is
//! written as soon as there is room. The end of the process waits for that thread only for a
//! moment.
//!
//! Under systemd each line begins with its priority, `<3>` for a fault down to `<6>`, so that the
//! journal can be searched by it.

mod outlet;

use haptic_ipc::JournalEntry;
use nix::sys::signal::SigSet;
use outlet::{Backlog, Outlet};
use rustix::fs::fstat;
use std::backtrace::{Backtrace, BacktraceStatus};
use std::fmt::Write;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Most lines that wait for standard error.
const BACKLOG_LINES: usize = 256;

/// Longest message, bytes; a longer one is cut. With [`BACKLOG_LINES`] this bounds the memory held
/// for a reader that does not read.
const LONGEST_LINE: usize = 4096;

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
    /// Whether standard error is the journal of a service manager.
    with_priorities: bool,
}

static LOG: OnceLock<Log> = OnceLock::new();

/// Starts the log. Before that, lines are written directly.
///
/// # Errors
/// The system has no thread left.
pub(crate) fn start() -> std::io::Result<()> {
    let with_priorities = is_journal();
    let log = Log {
        messages: Outlet::start("log", std::io::stderr(), Backlog::Oldest(BACKLOG_LINES), move |lost| {
            let plural = if lost == 1 { "line" } else { "lines" };
            text(
                Level::Warning,
                &format!("{lost} {plural} lost: nobody read standard error"),
                with_priorities,
            )
        })?,
        status_line: Outlet::start("status-line", std::io::stdout(), Backlog::Newest, |_| String::new())?,
        with_priorities,
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

/// Logs a line of severity [`Level::Info`].
pub(crate) fn say(line: &str) {
    say_at(Level::Info, line);
}

/// Logs a line.
pub(crate) fn say_at(level: Level, line: &str) {
    match LOG.get() {
        Some(log) => log.messages.put(text(level, line, log.with_priorities)),
        // Only unit tests come here.
        None => eprint!("{}", text(level, line, false)),
    }
}

/// Shows the status line of the demo.
pub(crate) fn show(line: String) {
    if let Some(log) = LOG.get() {
        log.status_line.put(line);
    }
}

/// Logs an entry of the journal, unless it is a change of the scene: there may be a thousand of
/// those a second.
pub(crate) fn journal(entry: &JournalEntry) {
    let level = match entry.op.as_str() {
        "set" | "undo" | "redo" | "scene.load" | "scene.save" => return,
        "engage" | "release" | "reset" | "connected" | "commission.begin" | "commission.store" | "identify.begin"
        | "identify.store" => Level::Info,
        "stop" | "lease_lapsed" | "disconnected" => Level::Warning,
        // A fault, and everything unknown.
        _ => Level::Error,
    };
    say_at(level, &entry.to_string());
}

/// Waits until the log is written, at most for `limit`, and not for a write that is blocked.
pub(crate) fn flush(limit: Duration) {
    let Some(log) = LOG.get() else { return };
    let began = Instant::now();
    while began.elapsed() < limit && (log.messages.is_busy(BLOCKED_AFTER) || log.status_line.is_busy(BLOCKED_AFTER)) {
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A message as it is written, each of its lines with its priority if `with_priorities` is set.
fn text(level: Level, message: &str, with_priorities: bool) -> String {
    let cut = message.floor_char_boundary(LONGEST_LINE);
    let mut text = String::with_capacity(cut + 32);
    for (index, line) in message[..cut].lines().enumerate() {
        if with_priorities {
            write!(text, "<{}>", level.priority()).unwrap_or_default();
        }
        text.push_str(if index == 0 { "hapticd: " } else { "" });
        text.push_str(line);
        text.push_str(if cut < message.len() { "..." } else { "" });
        text.push('\n');
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

/// Blocks all signals in a thread that writes. A write itself can raise a signal that would stop or
/// kill the whole process with its loop: SIGTTOU in the background of a terminal, SIGXFSZ at the
/// limit of a file's size. With the signal blocked the write succeeds or fails. Other signals are
/// for other threads.
fn block_signals() {
    // After a failure they stay as they were.
    SigSet::all().thread_block().unwrap_or_default();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_has_its_priority_on_each_line_and_is_cut_between_two_letters() {
        assert_eq!(text(Level::Info, "one\ntwo", false), "hapticd: one\ntwo\n");
        assert_eq!(text(Level::Error, "one\ntwo", true), "<3>hapticd: one\n<3>two\n");
        assert_eq!(text(Level::Warning, "one", true), "<4>hapticd: one\n");
        let long = text(Level::Info, &format!("x{}", "é".repeat(LONGEST_LINE)), true);
        assert!(long.len() < LONGEST_LINE + 32 && long.ends_with("é...\n"), "{long}");
    }

    #[test]
    fn every_entry_of_the_journal_can_be_logged() {
        // The log is not started here: the lines go to standard error directly.
        for op in ["set", "stop", "fault", "disconnected", "something new"] {
            journal(&JournalEntry::of(op));
        }
    }
}
