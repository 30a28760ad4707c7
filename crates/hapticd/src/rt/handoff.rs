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
    NoDevice,
}
