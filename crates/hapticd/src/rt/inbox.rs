//! The path into the real-time thread: one ring, of which the loop takes all that is there at the beginning of each
//! tick.
//!
//! Entries keep their order. The loop frees nothing: what it has no use for goes back through the
//! [outbox](super::outbox). A ring without room is refused here, on the control side; a scene waits here instead, until
//! a newer one replaces it.

use crate::rt::handoff::ANY_CONNECTION;
use crate::rt::outbox::TickSnapshot;
use crate::rt::schedule::ScheduledScene;
use crate::rt::space::CompiledIn;
use haptic_core::OwnMotion;
use haptic_core::compensation::Compensation;
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::planar::Plane;
use haptic_core::servo::Command;
use haptic_ipc::MAX_SCHEDULED_CHANGES;

/// What is known of the rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RigSetup {
    pub(crate) losses: RigLosses,
    pub(crate) compensation: Option<Compensation>,
}

/// A command as it was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SentCommand {
    /// Its number; each one is larger than those before.
    pub(crate) serial: u64,
    pub(crate) command: Command,
    /// Stops that its sender knew of: any later one wins over it.
    pub(crate) stops_known: u64,
    /// The connection to the device that it may engage.
    pub(crate) connection: u64,
    /// Whether the end of a lease sends it: the force then goes as by a lease that the loop itself sees lapse.
    pub(crate) is_of_lapse: bool,
}

impl SentCommand {
    /// Whether it may engage the device of a connection.
    pub(crate) fn admits(&self, connection: u64) -> bool {
        self.connection == ANY_CONNECTION || self.connection == connection
    }
}

/// What the loop is sent.
#[derive(Debug)]
pub(crate) enum ToLoop {
    /// Of several scenes and motions between two ticks the last is rendered.
    Scene(CompiledIn),
    /// A motion of the rig's own instead of the scene, and its direction on a rig of two axes.
    OwnMotion(OwnMotion, Plane),
    /// A change of scene in a tick to come.
    Scheduled(ScheduledScene),
    /// A command, and what is known of the rig if it is to engage it.
    Command { sent: SentCommand, rig: Option<RigSetup> },
    /// Limits that hold from now on; answered as the command of this number.
    Limits { serial: u64, limits: Limits },
    /// Room for a snapshot of the servo, which is to be filled.
    Snapshot(Box<Option<TickSnapshot>>),
}

/// Scenes that wait in the ring at most; one that finds other entries there instead waits for them.
const MAX_SCENES: usize = 8;

/// Entries that the ring holds, and the loop takes in a tick, at most: all that can be scheduled, the scenes, and room
/// for the commands of some seconds to a loop that hangs.
pub(crate) const ENTRIES: usize = MAX_SCHEDULED_CHANGES + MAX_SCENES + 16;

/// The real-time end.
pub(crate) type Receiver = rtrb::Consumer<ToLoop>;

/// The control end.
#[derive(Debug)]
pub(crate) struct Sender {
    entries: rtrb::Producer<ToLoop>,
    /// The newest scene or motion, while the ring has no room for it.
    waiting: Option<ToLoop>,
}

/// The two ends.
pub(crate) fn inbox() -> (Sender, Receiver) {
    let (entries, receiver) = rtrb::RingBuffer::new(ENTRIES);
    let sender = Sender { entries, waiting: None };
    (sender, receiver)
}

impl Sender {
    /// Sends a scene. While there is no room for it, it waits for [`flush`](Self::flush), and a newer one replaces it.
    pub(crate) fn post(&mut self, scene: impl Into<CompiledIn>) {
        self.waiting = Some(ToLoop::Scene(scene.into()));
        self.flush();
    }

    /// Sends a motion of the rig's own likewise.
    pub(crate) fn post_motion(&mut self, motion: OwnMotion, along: Plane) {
        self.waiting = Some(ToLoop::OwnMotion(motion, along));
        self.flush();
    }

    /// Sends the scene or motion that waits, if there is room by now.
    pub(crate) fn flush(&mut self) {
        if self.waiting.is_some() && self.entries.slots() > ENTRIES - MAX_SCENES {
            self.send_all(Vec::new());
        }
    }

    /// Sends an entry; returns whether there was room.
    pub(crate) fn send(&mut self, entry: ToLoop) -> bool {
        self.send_all(vec![entry])
    }

    /// Sends entries, after what waits; the loop sees all of them or none. Returns whether there was room.
    pub(crate) fn send_all(&mut self, entries: Vec<ToLoop>) -> bool {
        let count = entries.len() + usize::from(self.waiting.is_some());
        let Ok(room) = self.entries.write_chunk_uninit(count) else {
            return false;
        };
        let waiting = self.waiting.take();
        room.fill_from_iter(waiting.into_iter().chain(entries));
        true
    }

    /// Sends a command for any device, of which nothing new is known; returns whether there was room.
    pub(crate) fn command(&mut self, serial: u64, command: Command, stops_known: u64) -> bool {
        let sent = SentCommand {
            serial,
            command,
            stops_known,
            connection: ANY_CONNECTION,
            is_of_lapse: false,
        };
        self.send(ToLoop::Command { sent, rig: None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rt::tick::tests::compiled;
    use haptic_core::Scene;

    fn limits(serial: u64) -> ToLoop {
        ToLoop::Limits {
            serial,
            limits: Limits::default(),
        }
    }

    /// What is in the ring: revisions of scenes, and numbers of the rest.
    fn taken(receiver: &mut Receiver) -> Vec<(&'static str, u64)> {
        std::iter::from_fn(|| receiver.pop().ok())
            .map(|entry| match entry {
                ToLoop::Scene(scene) => ("scene", scene.revision()),
                ToLoop::Limits { serial, .. } => ("limits", serial),
                other => panic!("{other:?}"),
            })
            .collect()
    }

    #[test]
    fn a_burst_of_scenes_ends_with_the_newest() {
        let (mut sender, mut receiver) = inbox();
        for revision in 1..=100 {
            sender.post(compiled(&Scene::paper(), revision));
        }
        let burst = taken(&mut receiver);
        assert_eq!(burst.first(), Some(&("scene", 1)));
        assert_eq!(burst.len(), MAX_SCENES);
        sender.flush();
        assert_eq!(taken(&mut receiver), [("scene", 100)]);
        sender.flush();
        assert!(receiver.is_empty());
    }

    #[test]
    fn a_full_ring_refuses_whole_and_takes_again_once_emptied() {
        let (mut sender, mut receiver) = inbox();
        for serial in 0..ENTRIES as u64 - 1 {
            assert!(sender.send(limits(serial)));
        }
        assert!(
            !sender.send_all(vec![limits(1000), limits(1001)]),
            "no part of it either"
        );
        sender.post(compiled(&Scene::paper(), 3));
        assert!(!sender.send(limits(1002)), "not before the scene");
        assert_eq!(taken(&mut receiver).len(), ENTRIES - 1);
        assert!(sender.send(limits(1003)));
        assert_eq!(taken(&mut receiver), [("scene", 3), ("limits", 1003)]);
    }

    #[test]
    fn ring_holds_all_scenes_all_that_is_scheduled_and_16_more() {
        let (mut sender, _receiver) = inbox();
        for revision in 1..=MAX_SCENES as u64 {
            sender.post(compiled(&Scene::paper(), revision));
        }
        let others = MAX_SCHEDULED_CHANGES as u64 + 16;
        assert!(sender.waiting.is_none() && sender.send_all((0..others).map(limits).collect()));
        assert!(!sender.send(limits(others)));
    }
}
