//! From the control thread to the loop: what is known of the rig, with each command to engage, and other limits.
//!
//! A queue of rtrb, wait-free on both sides: what is in it is plain data, so that nothing is freed
//! by the loop.

use haptic_core::compensation::Compensation;
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;

/// What is known of the rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RigSetup {
    pub(crate) losses: RigLosses,
    pub(crate) compensation: Option<Compensation>,
}

/// What the loop is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Setup {
    /// What is known of the rig that the next command engages.
    Rig(RigSetup),
    /// Limits that hold from now on.
    Limits(Limits),
}

/// Setups that the queue holds: one comes with a command word, and there is one word at a time.
const SETUPS: usize = 4;

/// The control end.
#[derive(Debug)]
pub(crate) struct SetupSender(rtrb::Producer<Setup>);

/// The real-time end.
#[derive(Debug)]
pub(crate) struct SetupReceiver(rtrb::Consumer<Setup>);

/// The two ends.
pub(crate) fn rig_setups() -> (SetupSender, SetupReceiver) {
    let (sender, receiver) = rtrb::RingBuffer::new(SETUPS);
    (SetupSender(sender), SetupReceiver(receiver))
}

impl SetupSender {
    /// Sends a setup ahead of the command word that makes the loop look; returns whether there was room.
    pub(crate) fn send(&mut self, setup: Setup) -> bool {
        self.0.push(setup).is_ok()
    }
}

impl SetupReceiver {
    /// The next setup, if one has come.
    pub(crate) fn next(&mut self) -> Option<Setup> {
        self.0.pop().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn setups_come_in_their_order_and_a_full_queue_says_so() {
        let (mut sender, mut receiver) = rig_setups();
        assert!(receiver.next().is_none());
        let setup = |friction| {
            Setup::Rig(RigSetup {
                losses: RigLosses { damping: 0.0, friction },
                compensation: None,
            })
        };
        assert!((0..SETUPS).all(|count| sender.send(setup(count as f64))));
        assert!(!sender.send(setup(9.0)));
        for count in 0..SETUPS {
            assert_eq!(receiver.next(), Some(setup(count as f64)));
        }
        assert!(receiver.next().is_none() && sender.send(setup(9.0)));
    }
}
