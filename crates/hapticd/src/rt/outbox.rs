//! The path out of the real-time thread: one ring, with a record of every tick, the answers, scenes that are rendered
//! no more, and the servo's state when it is asked for.
//!
//! It is rtrb's, wait-free on both sides. When records find no room they are dropped and counted, and the count travels
//! in the next one: records pushed plus records dropped are the ticks. They leave room for all else: an answer or a
//! scene is never lost, as nothing is freed on the real-time thread.

use crate::rt::handoff::{Outcome, Stopped};
use crate::rt::schedule::ScheduledScene;
use crate::rt::space::CompiledIn;
use haptic_core::MotionEnd;
use haptic_core::sample_clock::ClockError;
use haptic_core::servo::{Fault, InputWord};
use haptic_core::snapshot::Snapshot;
use haptic_ipc::{MAX_SCHEDULED_CHANGES, RigState, SampleY};
use std::collections::VecDeque;
use std::iter::{once, once_with};

/// One tick as the real-time thread saw it.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(test, derive(Default))]
pub(crate) struct TickRecord {
    pub(crate) tick: u64,
    pub(crate) deadline_ns: u64,
    pub(crate) began_ns: u64,
    pub(crate) ended_ns: u64,
    pub(crate) device_round_trip_ns: u64,
    pub(crate) missed_periods: u64,
    /// Records dropped so far.
    pub(crate) dropped: u64,
    pub(crate) revision: u64,
    /// Time since the tick before, ns.
    pub(crate) elapsed_ns: u64,
    /// When the sample was taken, on the device's clock, ns; zero without a sample.
    pub(crate) device_time_ns: u64,
    /// Position as the device reported it, m; zero without a sample.
    pub(crate) sample_position: f64,
    pub(crate) device_sequence: u32,
    /// Samples so far that were not rendered, because no hand can have made them.
    pub(crate) samples_forgotten: u64,
    /// Steps of the scene's ramp that are rendered.
    pub(crate) ramp_steps: u16,
    /// What is wrong with the device's clock, for who wants to engage.
    pub(crate) clock_error: Option<ClockError>,
    /// What else the servo was stepped with.
    pub(crate) input_word: InputWord,
    pub(crate) device_position: f64,
    pub(crate) device_velocity: f64,
    pub(crate) block_position: f64,
    pub(crate) block_velocity: f64,
    pub(crate) coupling_force: f64,
    pub(crate) command_force: f64,
    /// Energy that sampling made and the rig did not take up, J.
    pub(crate) energy_excess: f64,
    pub(crate) contact: i8,
    /// How a motion of the rig's own has ended, for as long as it takes the place of the scene.
    pub(crate) motion_end: Option<MotionEnd>,
    pub(crate) state: RigState,
    pub(crate) fault: Option<Fault>,
}

/// State of the servo before a tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TickSnapshot {
    pub(crate) tick: u64,
    pub(crate) snapshot: Snapshot,
}

/// What leaves the loop.
#[derive(Debug)]
pub(crate) enum FromLoop {
    /// What the record that follows has of a second axis.
    Y(SampleY),
    Record(TickRecord),
    /// A scene is rendered from this tick on.
    Rendered {
        revision: u64,
        tick: u64,
    },
    /// A command was carried out or refused, or limits were taken.
    Done {
        serial: u64,
        outcome: Outcome,
    },
    /// Stops up to this number have ended.
    Stopped {
        stops: u64,
        stopped: Stopped,
    },
    /// A scene that is rendered no more.
    Retired(CompiledIn),
    /// A scheduled change on which its claim is decided.
    Decided(ScheduledScene),
    /// A snapshot that was asked for.
    Snapshot(Box<Option<TickSnapshot>>),
}

// Three cache lines: what a tick costs here is known and does not creep up.
const _: () = assert!(size_of::<FromLoop>() <= 192);

/// Entries that the ring holds in the daemon: more than eight seconds at 1 kHz, where a tick has one; of two axes it
/// has two.
pub(crate) const RECORDS: usize = 8192;

/// Entries that a scheduled change may lead to, and any other but a record: itself, an answer, and two scenes.
pub(crate) const ROOM_OF_ONE: usize = 4;

/// Room that records leave to all else: all that can be scheduled, and more than the control thread leaves there
/// between two looks. So a scheduled change never waits for room.
const RESERVED: usize = ROOM_OF_ONE * (MAX_SCHEDULED_CHANGES + 16);

/// The real-time end.
#[derive(Debug)]
pub(crate) struct Producer {
    entries: rtrb::Producer<FromLoop>,
    dropped: u64,
}

/// The control end.
#[derive(Debug)]
pub(crate) struct Consumer {
    entries: rtrb::Consumer<FromLoop>,
    /// What the record that was taken last has of a second axis.
    y: Option<SampleY>,
    answers: Answers,
    snapshots: VecDeque<TickSnapshot>,
}

/// What the loop has answered so far, the newest of each kind.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Answers {
    rendered: Option<(u64, u64)>,
    done: Option<(u64, Outcome)>,
    stopped: Option<(u64, Stopped)>,
    /// Scheduled changes that have come back.
    pub(crate) decided: usize,
}

/// The two ends, with room for so many records.
pub(crate) fn outbox(records: usize) -> (Producer, Consumer) {
    let (to_control, from_loop) = rtrb::RingBuffer::new(records + RESERVED);
    let producer = Producer {
        entries: to_control,
        dropped: 0,
    };
    let consumer = Consumer {
        entries: from_loop,
        y: None,
        answers: Answers::default(),
        snapshots: VecDeque::new(),
    };
    (producer, consumer)
}

impl Producer {
    /// Leaves a record, with the count of those dropped before it, or drops and counts it. What it has of a second axis
    /// goes before it.
    #[inline]
    pub(crate) fn push(&mut self, y: Option<SampleY>, record: impl FnOnce() -> TickRecord) {
        let Ok(room) = self.entries.write_chunk_uninit(RESERVED + 1 + usize::from(y.is_some())) else {
            self.dropped += 1;
            return;
        };
        let dropped = self.dropped;
        // Written where it stays: a record is three cache lines.
        let record = once_with(|| FromLoop::Record(TickRecord { dropped, ..record() }));
        match y {
            None => room.fill_from_iter(record),
            Some(y) => room.fill_from_iter(once(FromLoop::Y(y)).chain(record)),
        };
    }

    /// Number of entries that there is room for.
    #[inline]
    pub(crate) fn room(&self) -> usize {
        self.entries.slots()
    }

    /// Leaves an entry for which there is room.
    #[inline]
    pub(crate) fn send(&mut self, entry: FromLoop) {
        if let Err(rtrb::PushError::Full(entry)) = self.entries.push(entry) {
            // The room was checked before; a leak is better than freeing here.
            std::mem::forget(entry);
        }
    }
}

impl Consumer {
    /// The oldest record. Takes the answers before it, and frees what was handed back.
    pub(crate) fn pop(&mut self) -> Option<TickRecord> {
        while let Ok(entry) = self.entries.pop() {
            let answers = &mut self.answers;
            match entry {
                FromLoop::Y(y) => self.y = Some(y),
                FromLoop::Record(record) => return Some(record),
                FromLoop::Rendered { revision, tick } => answers.rendered = Some((revision, tick)),
                FromLoop::Done { serial, outcome } => answers.done = Some((serial, outcome)),
                FromLoop::Stopped { stops, stopped } => answers.stopped = Some((stops, stopped)),
                FromLoop::Retired(scene) => drop(scene),
                FromLoop::Decided(change) => {
                    drop(change);
                    answers.decided += 1;
                }
                FromLoop::Snapshot(snapshot) => self.snapshots.extend(*snapshot),
            }
        }
        None
    }

    /// What the record that was taken last has of a second axis.
    pub(crate) fn y(&self) -> Option<SampleY> {
        self.y
    }

    /// The oldest snapshot before the records that were taken.
    pub(crate) fn pop_snapshot(&mut self) -> Option<TickSnapshot> {
        self.snapshots.pop_front()
    }

    /// The answers that were taken so far.
    pub(crate) fn answers(&self) -> Answers {
        self.answers
    }
}

impl Answers {
    /// The tick that first rendered `revision` or a later one.
    pub(crate) fn applied(&self, revision: u64) -> Option<u64> {
        let (_, tick) = self.rendered.filter(|(rendered, _)| *rendered >= revision)?;
        Some(tick)
    }

    /// How the command with this serial number ended.
    pub(crate) fn command(&self, serial: u64) -> Option<Outcome> {
        let (_, outcome) = self.done.filter(|(done, _)| *done == serial)?;
        Some(outcome)
    }

    /// How stop number `stop`, or a later one, has ended.
    pub(crate) fn stop(&self, stop: u64) -> Option<Stopped> {
        let (_, stopped) = self.stopped.filter(|(stops, _)| *stops >= stop)?;
        Some(stopped)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::rt::handoff::StopConfirmation;
    use crate::rt::tick::tests::compiled;
    use haptic_core::Scene;

    pub(crate) fn record(tick: u64) -> TickRecord {
        TickRecord {
            tick,
            deadline_ns: tick * 1_000_000,
            began_ns: tick * 1_000_000 + 50,
            ended_ns: tick * 1_000_000 + 1050,
            device_round_trip_ns: 200,
            revision: 1,
            elapsed_ns: 1_000_000,
            device_time_ns: tick * 1_000_000,
            state: RigState::Idle,
            ..TickRecord::default()
        }
    }

    #[test]
    fn a_full_queue_drops_counts_and_tells() {
        let (mut producer, mut consumer) = outbox(8);
        for tick in 0..20 {
            producer.push(None, || record(tick));
        }
        let kept: Vec<u64> = std::iter::from_fn(|| consumer.pop())
            .map(|record| record.tick)
            .collect();
        assert_eq!(kept, [0, 1, 2, 3, 4, 5, 6, 7]);
        producer.push(None, || record(20));
        let next = consumer.pop().expect("there is room again");
        assert_eq!((next.tick, next.dropped), (20, 12));
        assert_eq!(kept.len() as u64 + next.dropped, 20, "kept and dropped are the ticks");
    }

    #[test]
    fn record_that_comes_after_a_look_keeps_its_second_axis() {
        let (mut producer, mut consumer) = outbox(8);
        let y = SampleY {
            device_position_m: 0.01,
            ..SampleY::default()
        };
        producer.send(FromLoop::Y(y));
        assert!(consumer.pop().is_none(), "the record is still on its way");
        producer.send(FromLoop::Record(record(1)));
        assert!(consumer.pop().is_some());
        assert_eq!(consumer.y(), Some(y));
    }

    #[test]
    fn records_leave_room_for_answers_and_scenes() {
        let (mut producer, mut consumer) = outbox(8);
        for tick in 0..20 {
            producer.push(None, || record(tick));
        }
        assert_eq!(producer.room(), RESERVED);
        let (mut of_two_axes, _consumer) = outbox(9);
        for tick in 0..20 {
            of_two_axes.push(Some(SampleY::default()), || record(tick));
        }
        assert_eq!(of_two_axes.room(), RESERVED + 1, "both axes go, or neither");
        let outcome = Outcome {
            tick: 9,
            state: RigState::Idle,
            refused: false,
        };
        for serial in 1..RESERVED as u64 {
            producer.send(FromLoop::Done { serial, outcome });
        }
        producer.send(FromLoop::Retired(compiled(&Scene::paper(), 1).into()));
        assert_eq!(producer.room(), 0);
        assert_eq!(std::iter::from_fn(|| consumer.pop()).count(), 8);
        assert_eq!(consumer.answers().command(RESERVED as u64 - 1), Some(outcome));
        assert_eq!(producer.room(), RESERVED + 8);
    }

    #[test]
    fn answers_hold_for_one_command_and_for_earlier_stops_and_scenes() {
        let outcome = |tick, refused| Outcome {
            tick,
            state: RigState::Releasing,
            refused,
        };
        let done = |serial, outcome| FromLoop::Done { serial, outcome };
        let stopped = Stopped {
            tick: 10,
            state: RigState::Stopped,
            confirmation: StopConfirmation::Unconfirmed,
            written_ns: 100,
            confirmed_ns: 1000,
        };
        let (mut producer, mut consumer) = outbox(1);
        producer.send(done(1, outcome(71, false)));
        producer.send(done(2, outcome(72, true)));
        producer.send(FromLoop::Stopped { stops: 2, stopped });
        producer.send(FromLoop::Rendered { revision: 5, tick: 77 });
        assert!(consumer.pop().is_none());
        let answers = consumer.answers();
        assert_eq!(
            [1, 2, 3].map(|serial| answers.command(serial)),
            [None, Some(outcome(72, true)), None]
        );
        assert_eq!(
            [1, 2, 3].map(|stop| answers.stop(stop)),
            [Some(stopped), Some(stopped), None]
        );
        assert_eq!(
            [4, 5, 6].map(|revision| answers.applied(revision)),
            [Some(77), Some(77), None]
        );
    }
}
