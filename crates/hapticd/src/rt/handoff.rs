//! From the control thread to the real-time thread, and the answers: single words and one mailbox,
//! so that neither side can make the real-time side wait. What leaves it in numbers goes through
//! the [outbox](super::outbox).
//!
//! | what | how | why it is wait-free for the real-time side |
//! |---|---|---|
//! | new scene | an owned pointer in a [`SceneMailbox`] | one load while nothing is new, one swap when something is |
//! | commands, stop, quit | atomic words | one load each |
//! | answers | atomic words | plain stores |
#![allow(
    unsafe_code,
    reason = "the mailbox owns what its pointer points to; see SceneMailbox"
)]

use super::atomic::{AtomicBool, AtomicPtr, AtomicU64, Ordering};
use haptic_core::sample_clock::ClockError;
use haptic_core::servo::{Command, CompiledScene};
use haptic_ipc::RigState;
use std::ptr;

/// Holds the newest scene until the real-time thread takes it.
///
/// The pointer in it is null or owned by the mailbox: the thread that swaps it out owns the scene. Nothing
/// is read through a pointer that is still in the mailbox.
#[derive(Debug)]
pub(crate) struct SceneMailbox {
    slot: AtomicPtr<CompiledScene>,
    /// Scenes posted so far: the cheap sign that something is new.
    posted: AtomicU64,
}

impl SceneMailbox {
    pub(crate) fn new() -> Self {
        Self {
            slot: AtomicPtr::new(ptr::null_mut()),
            posted: AtomicU64::new(0),
        }
    }

    /// Leaves a scene; one that was not taken yet is dropped, here, on the control thread.
    pub(crate) fn post(&self, scene: CompiledScene) {
        drop(self.swap(Box::into_raw(Box::new(scene))));
        self.posted.fetch_add(1, Ordering::Release);
    }

    /// Whether a scene was posted after the `seen` first ones.
    pub(crate) fn has_new(&self, seen: u64) -> bool {
        self.posted.load(Ordering::Acquire) != seen
    }

    /// Takes the newest scene, if one was posted after the `seen` first ones.
    pub(crate) fn take_new(&self, seen: &mut u64) -> Option<Box<CompiledScene>> {
        let posted = self.posted.load(Ordering::Acquire);
        if posted == *seen {
            return None;
        }
        *seen = posted;
        self.take()
    }

    /// Takes the newest scene, if there is one.
    pub(crate) fn take(&self) -> Option<Box<CompiledScene>> {
        self.swap(ptr::null_mut())
    }

    fn swap(&self, new: *mut CompiledScene) -> Option<Box<CompiledScene>> {
        let old = self.slot.swap(new, Ordering::AcqRel);
        // SAFETY: a pointer in the slot is null or came from `Box::into_raw` in `post`; the swap
        // took it out, so it is this thread's alone.
        (!old.is_null()).then(|| unsafe { Box::from_raw(old) })
    }
}

impl Drop for SceneMailbox {
    fn drop(&mut self) {
        drop(self.take());
    }
}

/// Stands for every connection to a device.
pub(crate) const ANY_CONNECTION: u64 = u64::MAX;

/// Everything that the two threads share but the telemetry ring.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) scenes: SceneMailbox,
    /// Stops asked for so far.
    stops: AtomicU64,
    quit: AtomicBool,
    /// Whether a snapshot of the servo is asked for.
    snapshot: AtomicBool,
    command: AtomicU64,
    /// The connection to a device for which the newest command to engage holds.
    admitted: AtomicU64,
    /// When the first lease lapses, ns on the monotonic clock; never, where it is the largest number.
    lease_until_ns: AtomicU64,
    /// When the control thread last gave a sign of life, ns on the monotonic clock; the largest
    /// number before it has begun to.
    heartbeat_ns: AtomicU64,
    pub(crate) answers: Answers,
}

/// A command as one word: a serial number, the number of stops known to who sent it, and the command itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CommandWord {
    pub(crate) serial: u32,
    /// Modulo 2^24; more stops cannot come in the millisecond for which it matters.
    pub(crate) stops_known: u32,
    pub(crate) command: Command,
}

const STOPS_MASK: u32 = 0x00ff_ffff;

/// Bits of a command word below its serial number.
const SERIAL_SHIFT: u32 = 32;

impl CommandWord {
    pub(super) fn pack(self) -> u64 {
        let code = self.command.code();
        u64::from(self.serial) << SERIAL_SHIFT | u64::from(self.stops_known & STOPS_MASK) << 8 | u64::from(code)
    }

    pub(super) fn unpack(word: u64) -> Option<Self> {
        #[expect(clippy::cast_possible_truncation, reason = "the fields as packed")]
        Some(Self {
            serial: (word >> SERIAL_SHIFT) as u32,
            stops_known: (word >> 8) as u32 & STOPS_MASK,
            command: Command::from_code(word as u8)?,
        })
    }

    /// Whether a stop has come since the command was sent.
    pub(crate) fn overtaken_by(&self, stops: u64) -> bool {
        stops & u64::from(STOPS_MASK) != u64::from(self.stops_known)
    }
}

impl Shared {
    pub(crate) fn new() -> Self {
        Self {
            scenes: SceneMailbox::new(),
            stops: AtomicU64::new(0),
            quit: AtomicBool::new(false),
            snapshot: AtomicBool::new(false),
            command: AtomicU64::new(0),
            admitted: AtomicU64::new(ANY_CONNECTION),
            lease_until_ns: AtomicU64::new(u64::MAX),
            heartbeat_ns: AtomicU64::new(u64::MAX),
            answers: Answers::new(),
        }
    }

    /// Sets when the rig is released unless that time is postponed.
    pub(crate) fn lease_until(&self, until_ns: u64) {
        self.lease_until_ns.store(until_ns, Ordering::Release);
    }

    /// Whether a lease has lapsed.
    pub(crate) fn has_lapsed(&self, now_ns: u64) -> bool {
        now_ns > self.lease_until_ns.load(Ordering::Acquire)
    }

    /// The control thread's sign of life: it hears stops at this time.
    pub(crate) fn heartbeat(&self, now_ns: u64) {
        self.heartbeat_ns.store(now_ns, Ordering::Release);
    }

    /// For how long the control thread has given no sign of life, ns.
    pub(crate) fn silent_ns(&self, now_ns: u64) -> u64 {
        now_ns.saturating_sub(self.heartbeat_ns.load(Ordering::Acquire))
    }

    /// Asks for zero force at once; returns the number that this stop has.
    pub(crate) fn stop(&self) -> u64 {
        self.stops.fetch_add(1, Ordering::AcqRel) + 1
    }

    /// Stops asked for so far.
    pub(crate) fn stops(&self) -> u64 {
        self.stops.load(Ordering::Acquire)
    }

    /// Asks the loop to end.
    pub(crate) fn quit(&self) {
        self.quit.store(true, Ordering::Release);
    }

    /// Whether the loop shall end.
    pub(crate) fn quitting(&self) -> bool {
        self.quit.load(Ordering::Acquire)
    }

    /// Asks for a snapshot of the servo after the tick that is under way.
    pub(crate) fn ask_for_snapshot(&self) {
        self.snapshot.store(true, Ordering::Release);
    }

    /// Whether one is asked for.
    pub(crate) fn is_snapshot_asked_for(&self) -> bool {
        self.snapshot.load(Ordering::Acquire)
    }

    /// It was given.
    pub(crate) fn snapshot_given(&self) {
        self.snapshot.store(false, Ordering::Release);
    }

    /// Says for which connection to a device the next command to engage holds. To be said before
    /// the command is sent.
    pub(crate) fn admit(&self, connection: u64) {
        self.admitted.store(connection, Ordering::Release);
    }

    /// Whether a command to engage holds for a connection.
    pub(crate) fn is_admitted(&self, connection: u64) -> bool {
        let admitted = self.admitted.load(Ordering::Acquire);
        admitted == ANY_CONNECTION || admitted == connection
    }

    /// Leaves a command of a sender that knew of `stops_known` stops. The one before must have been
    /// answered or withdrawn.
    pub(crate) fn send(&self, serial: u32, command: Command, stops_known: u64) {
        #[expect(clippy::cast_possible_truncation, reason = "modulo 2^24")]
        let stops_known = stops_known as u32 & STOPS_MASK;
        let word = CommandWord {
            serial,
            stops_known,
            command,
        };
        self.command.store(word.pack(), Ordering::Release);
    }

    /// Takes the newest command back, which has this serial number. The real-time thread may be
    /// carrying it out at this moment; once that is done it can be seen in the answers.
    pub(crate) fn withdraw(&self, serial: u32) {
        self.command.store(u64::from(serial) << SERIAL_SHIFT, Ordering::Release);
    }

    /// Makes the loop look for a setup that was sent, by a word that is not a command. The command before must
    /// have been answered or withdrawn.
    pub(crate) fn announce_setup(&self, serial: u32) {
        self.withdraw(serial);
    }

    /// The newest command as a word, for [`CommandWord::unpack`]. Each command changes it, also one
    /// that was withdrawn before anybody looked.
    pub(crate) fn command_word(&self) -> u64 {
        self.command.load(Ordering::Acquire)
    }
}

/// What the real-time thread has done. Written there, at the end of a tick, read by the control thread.
#[derive(Debug)]
pub(crate) struct Answers {
    revision: AtomicU64,
    revision_tick: AtomicU64,
    /// Steps of the newest scene's ramp that are rendered.
    steps: AtomicU64,
    command_serial: AtomicU64,
    command_tick: AtomicU64,
    command_outcome: AtomicU64,
    stops: AtomicU64,
    stop_tick: AtomicU64,
    stop_state: AtomicU64,
    stop_written_ns: AtomicU64,
    stop_confirmed_ns: AtomicU64,
    /// Samples that no hand can have made.
    forgotten: AtomicU64,
    /// 0, or one more than the number of a [`ClockError`].
    clock_error: AtomicU64,
    /// Times that other limits were taken, and the tick of the last time.
    limits: AtomicU64,
    limits_tick: AtomicU64,
}

/// How a stop ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stopped {
    pub(crate) tick: u64,
    pub(crate) state: RigState,
    pub(crate) confirmation: StopConfirmation,
    /// When the zero force had been written, ns on the monotonic clock.
    pub(crate) written_ns: u64,
    /// When the device was known to have its motor off, ns on the monotonic clock.
    pub(crate) confirmed_ns: u64,
}

/// Whether a device has confirmed a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StopConfirmation {
    /// It has its motor off.
    Confirmed,
    /// It was sent the zero force, and has not said in time that its motor is off.
    Unconfirmed,
    /// No device was connected.
    NoDevice,
}

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Outcome {
    pub(crate) tick: u64,
    pub(crate) state: RigState,
    pub(crate) refused: bool,
}

const REFUSED: u64 = 0x100;
const CONFIRMED: u64 = 0x100;
const UNCONFIRMED: u64 = 0x200;

pub(super) fn state_from(code: u64) -> RigState {
    RigState::ALL
        .into_iter()
        .find(|state| *state as u64 == code & 0xff)
        .unwrap_or(RigState::Faulted)
}

impl Answers {
    fn new() -> Self {
        Self {
            revision: AtomicU64::new(0),
            revision_tick: AtomicU64::new(0),
            steps: AtomicU64::new(0),
            command_serial: AtomicU64::new(0),
            command_tick: AtomicU64::new(0),
            command_outcome: AtomicU64::new(0),
            stops: AtomicU64::new(0),
            stop_tick: AtomicU64::new(0),
            stop_state: AtomicU64::new(0),
            stop_written_ns: AtomicU64::new(0),
            stop_confirmed_ns: AtomicU64::new(0),
            forgotten: AtomicU64::new(0),
            clock_error: AtomicU64::new(0),
            limits: AtomicU64::new(0),
            limits_tick: AtomicU64::new(0),
        }
    }

    pub(crate) fn scene_applied(&self, revision: u64, tick: u64) {
        self.revision_tick.store(tick, Ordering::Relaxed);
        self.revision.store(revision, Ordering::Release);
    }

    pub(crate) fn set_ramp_step(&self, steps: usize) {
        self.steps.store(steps as u64, Ordering::Relaxed);
    }

    /// The steps of the newest scene's ramp that are rendered.
    pub(crate) fn steps(&self) -> usize {
        usize::try_from(self.steps.load(Ordering::Relaxed)).unwrap_or(usize::MAX)
    }

    /// The tick that first rendered `revision` or a later one.
    pub(crate) fn applied(&self, revision: u64) -> Option<u64> {
        (self.revision.load(Ordering::Acquire) >= revision).then(|| self.revision_tick.load(Ordering::Relaxed))
    }

    pub(crate) fn command_done(&self, serial: u32, outcome: Outcome) {
        self.command_tick.store(outcome.tick, Ordering::Relaxed);
        let refused = if outcome.refused { REFUSED } else { 0 };
        self.command_outcome
            .store(outcome.state as u64 | refused, Ordering::Relaxed);
        self.command_serial.store(u64::from(serial), Ordering::Release);
    }

    /// How the command with this serial number ended.
    pub(crate) fn command(&self, serial: u32) -> Option<Outcome> {
        (self.command_serial.load(Ordering::Acquire) == u64::from(serial)).then(|| {
            let word = self.command_outcome.load(Ordering::Relaxed);
            Outcome {
                tick: self.command_tick.load(Ordering::Relaxed),
                state: state_from(word),
                refused: word & REFUSED != 0,
            }
        })
    }

    pub(crate) fn stopped(&self, stops: u64, stopped: Stopped) {
        self.stop_tick.store(stopped.tick, Ordering::Relaxed);
        self.stop_written_ns.store(stopped.written_ns, Ordering::Relaxed);
        self.stop_confirmed_ns.store(stopped.confirmed_ns, Ordering::Relaxed);
        let confirmation = match stopped.confirmation {
            StopConfirmation::Confirmed => CONFIRMED,
            StopConfirmation::Unconfirmed => UNCONFIRMED,
            StopConfirmation::NoDevice => 0,
        };
        self.stop_state
            .store(stopped.state as u64 | confirmation, Ordering::Relaxed);
        self.stops.store(stops, Ordering::Release);
    }

    /// How stop number `stop`, or a later one, has ended.
    pub(crate) fn stop(&self, stop: u64) -> Option<Stopped> {
        (self.stops.load(Ordering::Acquire) >= stop).then(|| {
            let word = self.stop_state.load(Ordering::Relaxed);
            Stopped {
                tick: self.stop_tick.load(Ordering::Relaxed),
                state: state_from(word),
                confirmation: match word & (CONFIRMED | UNCONFIRMED) {
                    CONFIRMED => StopConfirmation::Confirmed,
                    UNCONFIRMED => StopConfirmation::Unconfirmed,
                    _ => StopConfirmation::NoDevice,
                },
                written_ns: self.stop_written_ns.load(Ordering::Relaxed),
                confirmed_ns: self.stop_confirmed_ns.load(Ordering::Relaxed),
            }
        })
    }

    /// Other limits hold from this tick on.
    pub(crate) fn limits_taken(&self, tick: u64) {
        self.limits_tick.store(tick, Ordering::Relaxed);
        self.limits.fetch_add(1, Ordering::Release);
    }

    /// Times that other limits were taken, and the tick of the last time.
    pub(crate) fn limits(&self) -> (u64, u64) {
        let times = self.limits.load(Ordering::Acquire);
        (times, self.limits_tick.load(Ordering::Relaxed))
    }

    /// Publishes the number of samples that were not rendered, because no hand can have made them.
    pub(crate) fn set_samples_forgotten(&self, samples: u64) {
        self.forgotten.store(samples, Ordering::Relaxed);
    }

    /// Publishes what is wrong with the device's clock.
    pub(crate) fn set_clock_error(&self, error: Option<ClockError>) {
        let number = error.map_or(0, |error| error as u64 + 1);
        self.clock_error.store(number, Ordering::Relaxed);
    }

    /// What is wrong with the device's clock, for who wants to engage.
    pub(crate) fn clock_error(&self) -> Option<ClockError> {
        let number = self.clock_error.load(Ordering::Relaxed);
        ClockError::ALL.into_iter().find(|error| *error as u64 + 1 == number)
    }

    /// Samples that were not rendered, because no hand can have made them.
    pub(crate) fn samples_forgotten(&self) -> u64 {
        self.forgotten.load(Ordering::Relaxed)
    }
}
