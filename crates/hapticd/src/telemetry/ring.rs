//! The ring through which every tick's record leaves the real-time thread.
//!
//! The real-time thread is the only producer. It pushes only while two slots are free, so that it never meets a slot which the consumer
//! is half-way through, and never waits; when the ring is full the record is dropped and counted, and the count travels in
//! the next one. Records pushed plus records dropped are the ticks.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use crate::rig_state::Fault;
use crate::rt::outbox::Outbox;
use haptic_ipc::RigState;
use std::sync::Arc;

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

// Two cache lines: what a tick costs here is known and does not creep up.
const _: () = assert!(size_of::<TickRecord>() <= 128);

/// Records that the ring holds: more than eight seconds at 1 kHz.
const CAPACITY: usize = 8192;

/// The real-time end.
#[derive(Debug)]
pub(crate) struct Producer {
    ring: Arc<Outbox<TickRecord>>,
    dropped: u64,
}

/// The control end.
#[derive(Debug)]
pub(crate) struct Consumer {
    ring: Arc<Outbox<TickRecord>>,
}

/// A ring with its two ends.
pub(crate) fn ring() -> (Producer, Consumer) {
    with_capacity(CAPACITY)
}

pub(crate) fn with_capacity(capacity: usize) -> (Producer, Consumer) {
    let ring = Arc::new(Outbox::new(capacity));
    let producer = Producer {
        ring: Arc::clone(&ring),
        dropped: 0,
    };
    (producer, Consumer { ring })
}

impl Producer {
    /// Leaves a record, with the count of those dropped before it, or drops and counts it.
    pub(crate) fn push(&mut self, mut record: TickRecord) {
        record.dropped = self.dropped;
        if self.ring.push(record).is_err() {
            self.dropped += 1;
        }
    }
}

impl Consumer {
    /// The oldest record.
    pub(crate) fn pop(&mut self) -> Option<TickRecord> {
        self.ring.pop()
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
    fn a_full_ring_drops_counts_and_tells() {
        let (mut producer, mut consumer) = with_capacity(8);
        for tick in 0..20 {
            producer.push(record(tick));
        }
        let kept: Vec<u64> = std::iter::from_fn(|| consumer.pop())
            .map(|record| record.tick)
            .collect();
        assert_eq!(kept, [0, 1, 2, 3, 4, 5, 6]);
        producer.push(record(20));
        let next = consumer.pop().expect("there is room again");
        assert_eq!((next.tick, next.dropped), (20, 13));
        assert_eq!(kept.len() as u64 + next.dropped, 20, "kept and dropped are the ticks");
    }
}
