//! The way out of the real-time thread: a record of every tick, scenes that are rendered no more, and the
//! servo's state when it is asked for.
//!
//! Three queues of rtrb, each with one producer and one consumer, which are wait-free on both sides.
//! When the records find no room they are dropped and counted, and the count travels in the next
//! one: records pushed plus records dropped are the ticks. A scene without room stays with the
//! producer, as nothing is freed on the real-time thread.

use haptic_core::servo::{CompiledScene, Fault, InputWord};
use haptic_core::snapshot::Snapshot;
use haptic_ipc::{MAX_SCHEDULED_CHANGES, RigState};

/// One tick as the real-time thread saw it.
#[derive(Clone, Copy, Debug)]
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
    pub(crate) state: RigState,
    pub(crate) fault: Option<Fault>,
}

// Three cache lines: what a tick costs here is known and does not creep up.
const _: () = assert!(size_of::<TickRecord>() <= 192);

/// State of the servo before a tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TickSnapshot {
    pub(crate) tick: u64,
    pub(crate) snapshot: Snapshot,
}

/// Snapshots that the queue holds: the next is asked for once the one before has come.
const SNAPSHOTS: usize = 2;

/// Records that the queue holds: more than eight seconds at 1 kHz.
const RECORDS: usize = 8192;

/// Scenes that the queue holds: all that can be scheduled, and more than the control thread leaves there
/// between two looks. So a scheduled change never waits for room.
pub(crate) const SCENES: usize = MAX_SCHEDULED_CHANGES + 16;

/// The real-time end.
#[derive(Debug)]
pub(crate) struct Producer {
    records: rtrb::Producer<TickRecord>,
    dropped: u64,
    scenes: rtrb::Producer<Box<CompiledScene>>,
    snapshots: rtrb::Producer<TickSnapshot>,
}

/// The control end.
#[derive(Debug)]
pub(crate) struct Consumer {
    records: rtrb::Consumer<TickRecord>,
    scenes: rtrb::Consumer<Box<CompiledScene>>,
    snapshots: rtrb::Consumer<TickSnapshot>,
}

/// The two ends.
pub(crate) fn outbox() -> (Producer, Consumer) {
    with_capacity(RECORDS)
}

pub(crate) fn with_capacity(records: usize) -> (Producer, Consumer) {
    let (to_records, from_records) = rtrb::RingBuffer::new(records);
    let (to_scenes, from_scenes) = rtrb::RingBuffer::new(SCENES);
    let (to_snapshots, from_snapshots) = rtrb::RingBuffer::new(SNAPSHOTS);
    let producer = Producer {
        records: to_records,
        dropped: 0,
        scenes: to_scenes,
        snapshots: to_snapshots,
    };
    let consumer = Consumer {
        records: from_records,
        scenes: from_scenes,
        snapshots: from_snapshots,
    };
    (producer, consumer)
}

impl Producer {
    /// Leaves a record, with the count of those dropped before it, or drops and counts it.
    #[inline]
    pub(crate) fn push(&mut self, record: impl FnOnce() -> TickRecord) {
        let dropped = self.dropped;
        // Asked first, so that the record is made where it stays.
        if self.records.is_full() || self.records.push(TickRecord { dropped, ..record() }).is_err() {
            self.dropped += 1;
        }
    }

    /// Leaves the servo's state before a tick, if there is room for it.
    pub(crate) fn push_snapshot(&mut self, tick: u64, snapshot: Snapshot) {
        self.snapshots.push(TickSnapshot { tick, snapshot }).unwrap_or_default();
    }

    /// Whether this number of scenes can be handed back.
    pub(crate) fn has_room_for_scenes(&self, scenes: usize) -> bool {
        self.scenes.slots() >= scenes
    }

    /// Hands back a scene that is rendered no more.
    pub(crate) fn retire(&mut self, scene: Box<CompiledScene>) {
        if let Err(rtrb::PushError::Full(scene)) = self.scenes.push(scene) {
            // The room was checked before the scene was taken; a leak is better than freeing here.
            std::mem::forget(scene);
        }
    }
}

impl Consumer {
    /// The oldest record.
    pub(crate) fn pop(&mut self) -> Option<TickRecord> {
        self.records.pop().ok()
    }

    /// The oldest snapshot.
    pub(crate) fn pop_snapshot(&mut self) -> Option<TickSnapshot> {
        self.snapshots.pop().ok()
    }

    /// Frees the scenes that were handed back.
    pub(crate) fn drop_retired(&mut self) {
        while self.scenes.pop().is_ok() {}
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn record(tick: u64) -> TickRecord {
        TickRecord {
            tick,
            deadline_ns: tick * 1_000_000,
            began_ns: tick * 1_000_000 + 50,
            ended_ns: tick * 1_000_000 + 1050,
            device_round_trip_ns: 200,
            missed_periods: 0,
            dropped: 0,
            revision: 1,
            elapsed_ns: 1_000_000,
            device_time_ns: tick * 1_000_000,
            sample_position: 0.0,
            device_sequence: 0,
            input_word: InputWord::default(),
            device_position: 0.0,
            device_velocity: 0.0,
            block_position: 0.0,
            block_velocity: 0.0,
            coupling_force: 0.0,
            command_force: 0.0,
            energy_excess: 0.0,
            contact: 0,
            state: RigState::Idle,
            fault: None,
        }
    }

    #[test]
    fn a_full_queue_drops_counts_and_tells() {
        let (mut producer, mut consumer) = with_capacity(8);
        for tick in 0..20 {
            producer.push(|| record(tick));
        }
        let kept: Vec<u64> = std::iter::from_fn(|| consumer.pop())
            .map(|record| record.tick)
            .collect();
        assert_eq!(kept, [0, 1, 2, 3, 4, 5, 6, 7]);
        producer.push(|| record(20));
        let next = consumer.pop().expect("there is room again");
        assert_eq!((next.tick, next.dropped), (20, 12));
        assert_eq!(kept.len() as u64 + next.dropped, 20, "kept and dropped are the ticks");
    }
}
