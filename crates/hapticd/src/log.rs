//! What the daemon says on standard error and, with `--demo`, on standard output.
//!
//! Either may be a pipe that nobody reads or a terminal held with Ctrl-S, where a write waits for
//! as long as that lasts. So no thread of the daemon writes by itself: a line goes into a bounded
//! queue, from which a thread of its own writes it. Where the queue is full the line is lost and
//! counted, and the count is written once there is room again. The end of the process waits for
//! that thread for a moment only.
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

/// Lines that may wait for standard error.
const BACKLOG_LINES: usize = 256;

/// Longest line, bytes; a longer one is cut. With the lines that may wait this bounds what is held
/// for a reader that does not read.
const LONGEST_LINE: usize = 4096;

/// How long one write may take before the end of the process no longer waits for it.
const BLOCKED_AFTER: Duration = Duration::from_millis(200);

/// How urgent a line is, as syslog has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    Error,
    Warning,
    Info,
}

impl Level {
    /// The number that syslog and the service manager know it by.
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
    /// The status line of the demo: only the newest is of interest.
    status_line: Outlet,
    /// Whether standard error is the journal of a service manager.
    with_priorities: bool,
}

static LOG: OnceLock<Log> = OnceLock::new();

/// Starts the log. Before that, lines are written at once.
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

/// A line on standard error, of ordinary urgency.
pub(crate) fn say(line: &str) {
    say_at(Level::Info, line);
}

/// A line on standard error.
pub(crate) fn say_at(level: Level, line: &str) {
    match LOG.get() {
        Some(log) => log.messages.put(text(level, line, log.with_priorities)),
        // Only tests of a part come here: nothing moves.
        None => eprint!("{}", text(level, line, false)),
    }
}

/// The newest status line of the demo, as it is to be written.
pub(crate) fn show(line: String) {
    if let Some(log) = LOG.get() {
        log.status_line.put(line);
    }
}

/// An entry of the journal, unless it is only a change of the scene, of which there may be a
/// thousand a second.
pub(crate) fn journal(entry: &JournalEntry) {
    let level = match entry.op.as_str() {
        "set" | "undo" | "redo" | "scene.load" | "scene.save" => return,
        "engage" | "release" | "reset" | "connected" | "commission.begin" | "commission.store" => Level::Info,
        "stop" | "lease_lapsed" | "disconnected" => Level::Warning,
        // A fault, and whatever else the daemon finds wrong.
        _ => Level::Error,
    };
    say_at(level, &entry.to_string());
}

/// Waits until what was said is written, for so long at most, and not for a write that is blocked.
pub(crate) fn flush(limit: Duration) {
    let Some(log) = LOG.get() else { return };
    let began = Instant::now();
    while began.elapsed() < limit && (log.messages.is_busy(BLOCKED_AFTER) || log.status_line.is_busy(BLOCKED_AFTER)) {
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A message as it is written: each of its lines with the priority where somebody reads that.
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

/// Whether standard error leads to a service manager's journal: it names the device and inode of
/// the stream that it made.
fn is_journal() -> bool {
    let Ok(named) = std::env::var("JOURNAL_STREAM") else {
        return false;
    };
    fstat(std::io::stderr()).is_ok_and(|found| named == format!("{}:{}", found.st_dev, found.st_ino))
}

/// Blocks all signals in a thread that writes. Those that a write itself may bring would stop or
/// kill the whole process, loop and all: a background process that writes to its terminal, a file
/// that may grow no further; blocked, the write goes through or fails. All others are for other
/// threads.
fn block_signals() {
    // Where that fails they are as they were.
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
    fn changes_of_the_scene_are_not_said_and_all_else_is() {
        // Nothing is started here: what is said goes to standard error, and this holds that it does
        // not panic.
        for op in ["set", "stop", "fault", "disconnected", "something new"] {
            journal(&JournalEntry::of(op));
        }
    }
}
