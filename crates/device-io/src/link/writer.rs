//! The thread that writes to a device whose writes block, and its end on the real-time thread.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]
#![allow(unsafe_code, reason = "scheduling has no safe wrapper")]

use super::health::{LinkCounters, LinkError, add};
use super::mailbox::{Newest, Post, mailbox};
use super::session::Outgoing;
use crate::device::{DeviceError, Written};
use crate::protocol::message::{FromHost, is_newer};
use rtrb::{Consumer, Producer};
use rustix::event::{EventfdFlags, eventfd};
use rustix::fd::OwnedFd;
use rustix::io::Errno;
use std::sync::Arc;
use std::sync::atomic::Ordering::{Acquire, Relaxed, Release};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64};
use std::thread::JoinHandle;

/// Longest time in which a device takes nothing, ns; after that it counts as gone.
const STUCK_NS: u64 = 100_000_000;

/// Enough to empty the mailbox and write a report. All of the daemon's memory is locked, so no more
/// is asked for.
const STACK_BYTES: usize = 128 * 1024;

/// The part that both sides see.
#[derive(Debug)]
struct Shared {
    /// Counts up at every post.
    wakeup: OwnedFd,
    /// The mailbox holds the last messages.
    quit: AtomicBool,
    ended: AtomicBool,
    /// Sequence of the newest message that was sent or skipped.
    done: AtomicU32,
    /// Number of messages that newer ones have replaced.
    skipped: AtomicU64,
}

/// The command that is posted at present, post by post.
#[derive(Clone, Copy, Debug)]
struct PostedCommand {
    /// Of both motors.
    forces_mn: (i32, Option<i32>),
    enabled: bool,
    /// Sequence of the first of these commands.
    since: u32,
    /// Whether the device has taken one of them. Kept, as sequences wrap around while a rig rests.
    taken: bool,
}

/// The posting end. Only [`Drop`] waits.
#[derive(Debug)]
pub(super) struct Writer {
    shared: Arc<Shared>,
    posts: Producer<Post>,
    thread: Option<JoinHandle<()>>,
    posted: u32,
    saying: Option<PostedCommand>,
    /// The writer's progress when it last moved, and the time of that on our clock, ns.
    moved: (u32, u64),
    skipped: u64,
}

impl Writer {
    /// Starts a writer that sends by a function. The function may block; its error ends the writer.
    pub(super) fn start<E>(
        now_ns: u64,
        send: impl FnMut(FromHost) -> Result<(), E> + Send + 'static,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            wakeup: eventfd(0, EventfdFlags::CLOEXEC)?,
            quit: AtomicBool::new(false),
            ended: AtomicBool::new(false),
            done: AtomicU32::new(0),
            skipped: AtomicU64::new(0),
        });
        let (posts, waiting) = mailbox();
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("device writer".to_owned())
            .stack_size(STACK_BYTES)
            .spawn(move || run(&theirs, waiting, send))?;
        Ok(Self {
            shared,
            posts,
            thread: Some(thread),
            posted: 0,
            saying: None,
            moved: (0, now_ns),
            skipped: 0,
        })
    }

    /// Posts what is sent; the newest replace what was not sent yet. It makes one system call,
    /// which does not wait: for that a count would have to reach 2^64. A command is therefore never
    /// taken in its first post, but in a later post of the same command.
    ///
    /// # Errors
    /// The writer has failed, or the device takes nothing.
    pub(super) fn post(
        &mut self,
        outgoing: Outgoing,
        now_ns: u64,
        counters: &LinkCounters,
    ) -> Result<Written, DeviceError> {
        let done = self.shared.done.load(Relaxed);
        // A writer without work counts as one that moves.
        if done != self.moved.0 || done == self.posted {
            self.moved = (done, now_ns);
        }
        let mut stuck = now_ns.saturating_sub(self.moved.1) > STUCK_NS;
        let skipped = self.shared.skipped.load(Relaxed);
        add(
            &counters.not_sent,
            skipped.wrapping_sub(std::mem::replace(&mut self.skipped, skipped)),
        );
        if let Some(saying) = &mut self.saying {
            saying.taken |= !is_newer(saying.since, done);
        }
        let says = match outgoing {
            Outgoing::Sent { enable, command } => {
                stuck |= !self.say(enable, command);
                true
            }
            Outgoing::Withheld { repeats } => repeats,
        };
        if stuck {
            counters.note_error(LinkError::Stuck, now_ns);
            return Err(DeviceError::Disconnected);
        }
        self.check()?;
        Ok(match self.saying {
            Some(PostedCommand { taken: true, .. }) if says => Written::Taken,
            _ => Written::Later,
        })
    }

    /// Whether there was room for it.
    fn say(&mut self, enable: Option<FromHost>, command: FromHost) -> bool {
        if let FromHost::Command {
            sequence,
            force_mn,
            second_mn,
            enabled,
        } = command
        {
            self.posted = sequence;
            // A command behind an enable is a new one: the writer may have sent the enable alone.
            let is_same = enable.is_none()
                && self
                    .saying
                    .is_some_and(|saying| (saying.forces_mn, saying.enabled) == ((force_mn, second_mn), enabled));
            if !is_same {
                self.saying = Some(PostedCommand {
                    forces_mn: (force_mn, second_mn),
                    enabled,
                    since: sequence,
                    taken: false,
                });
            }
        }
        let has_room = self.posts.push((enable, command)).is_ok();
        if rustix::io::write(&self.shared.wakeup, &1_u64.to_ne_bytes()).is_err() {
            // A signal interrupted it; the next command rings again.
        }
        has_room
    }

    /// # Errors
    /// The writer has failed.
    pub(super) fn check(&self) -> Result<(), DeviceError> {
        if self.shared.ended.load(Acquire) {
            Err(DeviceError::Disconnected)
        } else {
            Ok(())
        }
    }
}

impl Drop for Writer {
    /// Waits until the last post was sent or has failed: an old conversation must not disturb a new
    /// one with the device.
    fn drop(&mut self) {
        self.shared.quit.store(true, Release);
        while rustix::io::write(&self.shared.wakeup, &1_u64.to_ne_bytes()) == Err(Errno::INTR) {}
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            // It has panicked, and printed that itself.
        }
    }
}

/// Tells the end of the writer, however it comes.
struct Ended<'a>(&'a AtomicBool);

impl Drop for Ended<'_> {
    fn drop(&mut self) {
        self.0.store(true, Release);
    }
}

fn run<E>(shared: &Shared, mut waiting: Consumer<Post>, mut send: impl FnMut(FromHost) -> Result<(), E>) {
    let _ended = Ended(&shared.ended);
    rise();
    let mut sent = None;
    loop {
        match rustix::io::read(&shared.wakeup, &mut [0; 8]) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(_) => return,
        }
        // Before the mailbox, so that every earlier post is seen.
        let last = shared.quit.load(Acquire);
        let mut newest = Newest::take(&mut waiting);
        if last
            && let Some(FromHost::Command {
                sequence,
                second_mn,
                enabled: true,
                ..
            }) = newest.command.or(sent)
        {
            // It is off, also where the mailbox had no room for it.
            newest.enable = None;
            newest.command = Some(FromHost::Command {
                sequence: sequence.wrapping_add(1),
                force_mn: 0,
                second_mn: second_mn.map(|_| 0),
                enabled: false,
            });
        }
        for message in [newest.enable, newest.command].into_iter().flatten() {
            if send(message).is_err() {
                return;
            }
        }
        shared
            .skipped
            .store(shared.skipped.load(Relaxed) + newest.skipped, Relaxed);
        if let Some(FromHost::Command { sequence, .. }) = newest.command {
            shared.done.store(sequence, Relaxed);
        }
        sent = newest.command.or(sent);
        if last {
            return;
        }
    }
}

/// Asks for the lowest real-time priority: above all ordinary threads, so that a busy machine does
/// not hold commands back, and below the loop. If this is refused, so was the loop's, which tells
/// the remedy.
fn rise() {
    // The kernel's structure is this number. The call itself, as musl has only a stub of its function.
    let lowest: libc::c_int = 1;
    // SAFETY: a structure of this function, read by the kernel; 0 is this thread alone.
    unsafe { libc::syscall(libc::SYS_sched_setscheduler, 0, libc::SCHED_FIFO, &raw const lowest) };
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;
    use std::time::{Duration, Instant};

    const MS: u64 = 1_000_000;

    fn posting(sequence: u32, enabled: bool) -> Outgoing {
        Outgoing::Sent {
            enable: None,
            command: command(sequence, enabled),
        }
    }

    /// Of two motors: no force is none of both.
    fn command(sequence: u32, enabled: bool) -> FromHost {
        FromHost::Command {
            sequence,
            force_mn: if enabled { 1000 } else { 0 },
            second_mn: Some(if enabled { -500 } else { 0 }),
            enabled,
        }
    }

    /// A writer whose device takes each message only once it is let, and what it was sent.
    fn held() -> (Writer, mpsc::Sender<()>, mpsc::Receiver<FromHost>) {
        let (lets, go) = mpsc::channel::<()>();
        let (sends, sent) = mpsc::channel();
        let writer = Writer::start(0, move |message| {
            sends.send(message).map_err(drop)?;
            go.recv_timeout(Duration::from_secs(10)).map_err(drop)
        })
        .expect("a thread");
        (writer, lets, sent)
    }

    /// Waits until something is so, on a machine that may be busy.
    fn until(mut done: impl FnMut() -> bool) {
        let began = Instant::now();
        while !done() {
            assert!(began.elapsed() < Duration::from_secs(10));
            std::thread::yield_now();
        }
    }

    #[test]
    fn the_last_word_is_what_was_posted_last() {
        for k in 0..200 {
            let (sends, sent) = mpsc::channel();
            let counters = LinkCounters::default();
            let mut writer = Writer::start(0, move |message| sends.send(message)).expect("a thread");
            for sequence in 1..=k {
                writer.post(posting(sequence, true), 0, &counters).expect("well");
            }
            writer.post(posting(k + 1, false), 0, &counters).expect("well");
            drop(writer);
            let sent: Vec<FromHost> = sent.try_iter().collect();
            assert_eq!(sent.last(), Some(&command(k + 1, false)));
        }
    }

    #[test]
    fn last_word_is_off_though_there_was_no_room_for_it() {
        let (mut writer, lets, sent) = held();
        let counters = LinkCounters::default();
        writer.post(posting(1, true), 0, &counters).expect("well");
        sent.recv().expect("it is sent");
        let given_up = (2..1000).find(|sequence| writer.post(posting(*sequence, true), 0, &counters).is_err());
        for _ in 0..3 {
            lets.send(()).expect("it waits");
        }
        drop(writer);
        // The last that found room has the number before.
        let off = given_up.map(|sequence| command(sequence, false));
        assert_eq!(sent.try_iter().last(), off);
    }

    #[test]
    fn command_counts_as_taken_once_device_has_it() {
        let (mut writer, lets, sent) = held();
        let counters = LinkCounters::default();
        let mut sequence = 0;
        let mut post = |enabled: bool| {
            sequence += 1;
            writer.post(posting(sequence, enabled), 0, &counters)
        };
        // The writer holds a force while the zero force is posted, again and again.
        assert_eq!(post(true), Ok(Written::Later));
        sent.recv().expect("it is sent");
        for _ in 0..5 {
            assert_eq!(post(false), Ok(Written::Later));
        }
        lets.send(()).expect("it waits");
        let zero = sent.recv().expect("it is sent");
        assert!(matches!(zero, FromHost::Command { enabled: false, .. }), "{zero:?}");
        assert_eq!(post(false), Ok(Written::Later), "the device has not taken it yet");
        lets.send(()).expect("it waits");
        until(|| {
            // What was posted in between goes, too.
            lets.send(()).expect("it waits");
            post(false) == Ok(Written::Taken)
        });
        assert_eq!(post(false), Ok(Written::Taken), "and it stays so");
        assert_eq!(post(true), Ok(Written::Later), "another command");
        drop(lets);
    }

    #[test]
    fn another_force_of_the_second_motor_is_another_command() {
        let counters = LinkCounters::default();
        let mut writer = Writer::start(0, |_| Ok::<(), ()>(())).expect("a thread");
        let (mut sequence, enable) = (0, None);
        let mut post = |second_mn| {
            sequence += 1;
            let command = FromHost::Command {
                sequence,
                force_mn: 1000,
                second_mn: Some(second_mn),
                enabled: true,
            };
            writer.post(Outgoing::Sent { enable, command }, 0, &counters)
        };
        until(|| post(500) == Ok(Written::Taken));
        assert_eq!(post(501), Ok(Written::Later));
    }

    #[test]
    fn taken_command_stays_taken_at_sequence_wraparound() {
        let counters = LinkCounters::default();
        let mut writer = Writer::start(0, |_| Ok::<(), ()>(())).expect("a thread");
        until(|| writer.post(posting(1, false), 0, &counters) == Ok(Written::Taken));
        for sequence in [1 << 30, (1 << 31) + 5, 3 << 30, u32::MAX] {
            until(|| writer.shared.done.load(Relaxed) == writer.posted);
            let written = writer.post(posting(sequence, false), 0, &counters);
            assert_eq!(written, Ok(Written::Taken), "{sequence}");
        }
    }

    #[test]
    fn what_is_not_sent_is_counted() {
        let (mut writer, lets, sent) = held();
        let counters = LinkCounters::default();
        writer.post(posting(1, true), 0, &counters).expect("well");
        sent.recv().expect("the first goes at once");
        for sequence in 2..=10 {
            writer.post(posting(sequence, true), 0, &counters).expect("well");
        }
        lets.send(()).expect("it waits");
        assert_eq!(sent.recv(), Ok(command(10, true)), "the newest in place of nine");
        lets.send(()).expect("it waits");
        // Its count is there when it has done that.
        let mut sequence = 10;
        until(|| {
            sequence += 1;
            writer.post(posting(sequence, true), 0, &counters).ok();
            counters.not_sent.load(Relaxed) >= 8
        });
        drop(lets);
    }

    #[test]
    fn a_device_that_takes_nothing_is_given_up() {
        let (mut writer, lets, sent) = held();
        let counters = LinkCounters::default();
        // Where nothing was posted, nothing is late.
        writer.post(posting(1, true), 1000 * MS, &counters).expect("well");
        sent.recv().expect("it is sent");
        writer.post(posting(2, true), 1100 * MS, &counters).expect("well");
        let stuck = writer.post(posting(3, true), 1101 * MS, &counters);
        assert_eq!(stuck, Err(DeviceError::Disconnected));
        drop(lets);
    }

    #[test]
    fn a_failure_is_reported() {
        let counters = LinkCounters::default();
        let mut writer = Writer::start(0, |_| Err(())).expect("a thread");
        writer.check().expect("well");
        if writer.post(posting(1, true), 0, &counters).is_err() {
            // It was quick to fail.
        }
        until(|| writer.check().is_err());
        let after = writer.post(posting(2, true), 0, &counters);
        assert_eq!(after, Err(DeviceError::Disconnected));
    }

    /// Policy and priority of the calling thread, as the kernel has them.
    fn scheduling() -> (i32, i32) {
        let mut parameters = libc::sched_param { sched_priority: -1 };
        // SAFETY: 0 is the calling thread; the structure is written by the kernel.
        let policy = unsafe {
            assert_eq!(libc::sched_getparam(0, &raw mut parameters), 0);
            libc::sched_getscheduler(0)
        };
        (policy, parameters.sched_priority)
    }

    /// Whether a thread of this process may have a real-time priority.
    fn may_be_real_time() -> bool {
        let lowest = libc::sched_param { sched_priority: 1 };
        std::thread::spawn(move || {
            // SAFETY: as in `rise`, on a thread that ends at once.
            unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const lowest) == 0 }
        })
        .join()
        .expect("it ends")
    }

    // hazard: P12
    #[test]
    fn writer_gets_lowest_real_time_priority_before_sending() {
        let (sender, receiver) = mpsc::channel();
        let counters = LinkCounters::default();
        let mut writer = Writer::start(0, move |_| sender.send(scheduling())).expect("a thread");
        writer.post(posting(1, true), 0, &counters).expect("well");
        let scheduled = receiver.recv_timeout(Duration::from_secs(30)).expect("it sends");
        if may_be_real_time() {
            assert_eq!(scheduled, (libc::SCHED_FIFO, 1));
        } else {
            assert_eq!(scheduled, (libc::SCHED_OTHER, 0), "refused, it runs as it was");
            test_run::skip("SCHED_FIFO", "ulimit -r, or CAP_SYS_NICE");
        }
    }
}
