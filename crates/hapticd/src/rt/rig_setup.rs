//! What is known of the rig that is engaged: from the control thread to the loop, with each command
//! to engage.
//!
//! A queue of rtrb, wait-free on both sides: what is in it is plain data, so that nothing is freed
//! by the loop.

use haptic_core::compensation::Compensation;
use haptic_core::passivity::RigLosses;

/// What is known of the rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RigSetup {
    pub(crate) losses: RigLosses,
    pub(crate) compensation: Option<Compensation>,
}

/// Setups that the queue holds: one comes with a command, and there is one command at a time.
const SETUPS: usize = 4;

/// The control end.
#[derive(Debug)]
pub(crate) struct SetupSender(rtrb::Producer<RigSetup>);

/// The real-time end.
#[derive(Debug)]
pub(crate) struct SetupReceiver(rtrb::Consumer<RigSetup>);

/// The two ends.
pub(crate) fn rig_setups() -> (SetupSender, SetupReceiver) {
    let (sender, receiver) = rtrb::RingBuffer::new(SETUPS);
    (SetupSender(sender), SetupReceiver(receiver))
}

impl SetupSender {
    /// Sends a setup ahead of a command to engage; returns whether there was room.
    pub(crate) fn send(&mut self, setup: RigSetup) -> bool {
        self.0.push(setup).is_ok()
    }
}

impl SetupReceiver {
    /// The newest setup, if one has come.
    pub(crate) fn newest(&mut self) -> Option<RigSetup> {
        let mut newest = None;
        while let Ok(setup) = self.0.pop() {
            newest = Some(setup);
        }
        newest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_setup_counts_and_a_full_queue_says_so() {
        let (mut sender, mut receiver) = rig_setups();
        assert!(receiver.newest().is_none());
        let setup = |friction| RigSetup {
            losses: RigLosses { damping: 0.0, friction },
            compensation: None,
        };
        assert!((0..SETUPS).all(|count| sender.send(setup(count as f64))));
        assert!(!sender.send(setup(9.0)));
        assert_eq!(receiver.newest().map(|setup| setup.losses.friction), Some(3.0));
        assert!(receiver.newest().is_none() && sender.send(setup(9.0)));
    }
}
