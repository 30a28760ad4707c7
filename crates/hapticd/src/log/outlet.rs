//! A queue that never blocks, in front of a descriptor that may.

use crate::threads;
use crossbeam::queue::ArrayQueue;
use rustix::event::{PollFd, PollFlags, poll};
use rustix::fd::AsFd;
use rustix::io::{Errno, write};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::SeqCst;
use std::thread::Thread;
use std::time::{Duration, Instant};

/// Which lines are kept when they come faster than they are written.
#[derive(Clone, Copy, Debug)]
pub(super) enum Backlog {
    /// The oldest, at most this many.
    Oldest(usize),
    /// Only the newest.
    Newest,
}

/// The queue, and the progress of its writer.
#[derive(Debug)]
struct Queue {
    lines: ArrayQueue<String>,
    backlog: Backlog,
    /// Lines lost since the last notice.
    lost: AtomicU64,
    /// Lines put into the queue, and lines written or lost.
    enqueued: AtomicU64,
    done: AtomicU64,
    /// Start of the current write, ms after `since`, plus one; 0 between writes.
    writing_since_ms: AtomicU64,
    since: Instant,
}

impl Queue {
    fn now_ms(&self) -> u64 {
        u64::try_from(self.since.elapsed().as_millis()).unwrap_or(u64::MAX - 1) + 1
    }
}

/// Writes lines to a descriptor on a thread of its own; its users never wait.
#[derive(Debug)]
pub(super) struct Outlet {
    queue: Arc<Queue>,
    writer: Thread,
}

impl Outlet {
    /// Starts the thread that writes to a descriptor; `lost` is the notice of a number of lost
    /// lines.
    ///
    /// # Errors
    /// The system has no thread left.
    pub(super) fn start(
        name: &str,
        descriptor: impl AsFd + Send + 'static,
        backlog: Backlog,
        lost: impl Fn(u64) -> String + Send + 'static,
    ) -> std::io::Result<Self> {
        let room = match backlog {
            Backlog::Oldest(lines) => lines,
            Backlog::Newest => 1,
        };
        let queue = Arc::new(Queue {
            lines: ArrayQueue::new(room),
            backlog,
            lost: AtomicU64::new(0),
            enqueued: AtomicU64::new(0),
            done: AtomicU64::new(0),
            writing_since_ms: AtomicU64::new(0),
            since: Instant::now(),
        });
        let to_write = Arc::clone(&queue);
        let writer = threads::start(name, 128 * 1024, move || run(&to_write, &descriptor, &lost))?;
        Ok(Self { queue, writer })
    }

    /// Queues a line, or counts it as lost.
    pub(super) fn enqueue(&self, line: String) {
        let queue = &*self.queue;
        queue.enqueued.fetch_add(1, SeqCst);
        let is_lost = match queue.backlog {
            Backlog::Oldest(_) => queue.lines.push(line).is_err(),
            Backlog::Newest => queue.lines.force_push(line).is_some(),
        };
        if is_lost {
            queue.lost.fetch_add(1, SeqCst);
            queue.done.fetch_add(1, SeqCst);
        }
        self.writer.unpark();
    }

    /// Whether lines are still to be written, and no write has been blocked for longer than
    /// `blocked_after`.
    pub(super) fn is_busy(&self, blocked_after: Duration) -> bool {
        let queue = &*self.queue;
        let writing_since_ms = queue.writing_since_ms.load(SeqCst);
        let is_blocked = writing_since_ms != 0
            && u128::from(queue.now_ms().saturating_sub(writing_since_ms)) > blocked_after.as_millis();
        // The notice of lost lines counts as well.
        let is_reported = queue.lost.load(SeqCst) == 0 || matches!(queue.backlog, Backlog::Newest);
        let is_done = queue.done.load(SeqCst) == queue.enqueued.load(SeqCst) && is_reported;
        !is_blocked && !is_done
    }
}

fn run(queue: &Queue, descriptor: &impl AsFd, lost: &impl Fn(u64) -> String) {
    loop {
        while let Some(line) = queue.lines.pop() {
            timed_write(queue, descriptor, line.as_bytes());
            queue.done.fetch_add(1, SeqCst);
        }
        // The lost lines came after those in the queue, so the notice belongs here.
        let count = queue.lost.swap(0, SeqCst);
        let notice = if count > 0 { lost(count) } else { String::new() };
        if notice.is_empty() {
            std::thread::park();
        } else {
            timed_write(queue, descriptor, notice.as_bytes());
        }
    }
}

fn timed_write(queue: &Queue, descriptor: &impl AsFd, bytes: &[u8]) {
    queue.writing_since_ms.store(queue.now_ms(), SeqCst);
    write_all(descriptor, bytes);
    queue.writing_since_ms.store(0, SeqCst);
}

/// Writes all bytes, however long that takes. An error is ignored: there is nobody to report it to.
///
/// The standard library's handles are not used: they would hold a lock while the write is blocked,
/// and the end of the process flushes their buffers.
fn write_all(descriptor: &impl AsFd, mut bytes: &[u8]) {
    while !bytes.is_empty() {
        match write(descriptor, bytes) {
            Ok(0) => return,
            Ok(written) => bytes = &bytes[written..],
            Err(Errno::INTR) => {}
            // Another process with this pipe or terminal has made it non-blocking.
            Err(Errno::AGAIN) => {
                if poll(&mut [PollFd::new(descriptor, PollFlags::OUT)], None).is_err() {
                    std::thread::sleep(Duration::from_millis(10));
                }
            }
            Err(_) => return,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead, BufReader};

    /// Bytes of a line that no pipe holds.
    const LONG: usize = 2 * 1024 * 1024;

    fn notice(lost: u64) -> String {
        format!("{lost} lost\n")
    }

    fn wait_for(what: &str, reached: impl Fn() -> bool) {
        let began = Instant::now();
        while !reached() {
            assert!(began.elapsed() < Duration::from_secs(30), "waited in vain for {what}");
            std::thread::yield_now();
        }
    }

    /// An outlet whose first line is more than any pipe holds, once it is being written; and the end to read.
    fn blocked(backlog: Backlog, lost: fn(u64) -> String) -> (Outlet, BufReader<impl std::io::Read>) {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        let outlet = Outlet::start("log", writer, backlog, lost).expect("a thread");
        outlet.enqueue("x".repeat(LONG - 1) + "\n");
        wait_for("the write to begin", || {
            outlet.queue.lines.is_empty() && outlet.queue.writing_since_ms.load(SeqCst) > 0
        });
        (outlet, BufReader::new(reader))
    }

    // hazard: H1
    #[test]
    fn log_lines_lost_to_an_unread_pipe_are_counted_and_reported() {
        let (outlet, reader) = blocked(Backlog::Oldest(4), notice);
        let began = Instant::now();
        for index in 0..10 {
            outlet.enqueue(format!("{index}\n"));
        }
        println!("ten lines, with the pipe full: {:?}", began.elapsed());
        wait_for("the write to count as blocked", || {
            !outlet.is_busy(Duration::from_millis(1))
        });

        let mut lines = reader.lines().map(|line| line.expect("text"));
        assert_eq!(lines.next().map(|line| line.len() + 1), Some(LONG));
        let printed: Vec<String> = lines.by_ref().take(5).collect();
        assert_eq!(printed, ["0", "1", "2", "3", "6 lost"]);
        outlet.enqueue("after\n".to_owned());
        assert_eq!(lines.next().as_deref(), Some("after"));
        wait_for("the end of it", || !outlet.is_busy(Duration::MAX));
    }

    // hazard: H1
    #[test]
    fn of_status_lines_only_the_newest_waits() {
        let (outlet, reader) = blocked(Backlog::Newest, |_| String::new());
        for index in 0..10 {
            outlet.enqueue(format!("{index}\n"));
        }
        let mut lines = reader.lines().map(|line| line.expect("text"));
        lines.next();
        assert_eq!(lines.next().as_deref(), Some("9"));
        wait_for("the end of it", || !outlet.is_busy(Duration::MAX));
    }

    #[test]
    fn a_reader_that_has_gone_keeps_nobody() {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let outlet = Outlet::start("log", writer, Backlog::Oldest(4), notice).expect("a thread");
        outlet.enqueue("nobody reads this\n".to_owned());
        wait_for("the end of it", || !outlet.is_busy(Duration::MAX));
    }
}
