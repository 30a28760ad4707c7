//! Between the control thread and the real-time thread: two rings and a few words, so that neither side can make the
//! real-time side wait.
//!
//! | what | how | why it is wait-free for the real-time side |
//! |---|---|---|
//! | scenes, commands, limits, scheduled changes | the inbox, a ring | a ring of rtrb waits for nobody |
//! | records, answers, replaced scenes, snapshots | the outbox, a ring | likewise |
//! | stop, end, withdrawal, lease, heartbeat | words in [`Shared`] | one load each |
//!
//! A full inbox is refused on the control side. In the outbox only records are dropped, and counted: the loop takes
//! what it has to answer only where there is room for the answer.

use crate::rt::inbox::{self, Receiver, Sender};
use crate::rt::outbox::{self, Consumer, Producer};
use crate::rt::shared::Shared;
use haptic_ipc::RigState;
use std::sync::Arc;

/// The control thread's ends.
#[derive(Debug)]
pub(crate) struct ControlSide {
    pub(crate) shared: Arc<Shared>,
    pub(crate) inbox: Sender,
    pub(crate) records: Consumer,
}

/// The real-time thread's ends.
#[derive(Debug)]
pub(crate) struct LoopSide {
    pub(crate) shared: Arc<Shared>,
    pub(crate) inbox: Receiver,
    pub(crate) outbox: Producer,
}

/// The two sides, with room for so many records.
pub(crate) fn hand_over(records: usize) -> (ControlSide, LoopSide) {
    let shared = Arc::new(Shared::new());
    let (sender, receiver) = inbox::inbox();
    let (outbox, records) = outbox::outbox(records);
    let control = ControlSide {
        shared: Arc::clone(&shared),
        inbox: sender,
        records,
    };
    let loop_side = LoopSide {
        shared,
        inbox: receiver,
        outbox,
    };
    (control, loop_side)
}

/// Stands for every connection to a device.
pub(crate) const ANY_CONNECTION: u64 = u64::MAX;

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Outcome {
    pub(crate) tick: u64,
    pub(crate) state: RigState,
    pub(crate) refused: bool,
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
    /// It was sent the zero force, and has not reported in time that its motor is off.
    Unconfirmed,
    /// No device was connected.
    NoDevice,
}

// Beside `shared.rs`, which the models compile again.
#[cfg(test)]
mod tests {
    use crate::rt::shared::Shared;

    #[test]
    fn lease_lapses_on_time_and_silence_counts_from_last_beat() {
        let shared = Shared::new();
        assert!(!shared.has_lapsed(u64::MAX), "nobody has a lease");
        shared.lease_until(1000);
        assert_eq!(
            [999, 1000, 1001].map(|now_ns| shared.has_lapsed(now_ns)),
            [false, false, true]
        );
        assert_eq!(shared.silent_ns(5000), 0, "the control thread has not begun");
        shared.heartbeat(2000);
        assert_eq!(
            [1999, 2000, 2001, 5000].map(|now_ns| shared.silent_ns(now_ns)),
            [0, 0, 1, 3000]
        );
    }

    #[test]
    fn stops_are_counted_and_a_withdrawal_covers_earlier_commands() {
        let shared = Shared::new();
        assert_eq!([shared.stop(), shared.stop(), shared.stops()], [1, 2, 2]);
        assert!(!shared.is_withdrawn(1));
        shared.withdraw(7);
        assert_eq!([6, 7, 8].map(|serial| shared.is_withdrawn(serial)), [true, true, false]);
        assert!(!shared.quitting());
        shared.quit();
        assert!(shared.quitting());
    }
}
