//! What the fakes of all makers' boards have in common.

use super::pulley::Pulley;
use device_io::fake::{FakeRig, Misbehaviour};

/// A motor controller that speaks lines of text, on the fake rig. It has no clock of its own: its
/// caller passes the time.
pub trait FakeBoard: Send {
    /// Takes in bytes at a time, ns; returns the lines of its answers, with their ends.
    fn receive(&mut self, bytes: &[u8], now_ns: u64) -> Vec<Vec<u8>>;

    /// Lives until a time, ns, and its watchdog with it.
    fn live_until(&mut self, now_ns: u64);

    /// Whether the motor is on.
    fn is_on(&self) -> bool;

    /// Whether a watchdog has switched the motor off since it was last on.
    fn watchdog_has_tripped(&self) -> bool;

    /// From now on the board itself does something wrong; what it has not, it does not.
    fn misbehave(&mut self, misbehaviour: Misbehaviour);

    /// The mechanism that it measures and drives.
    fn pulley(&self) -> &Pulley;

    /// The mechanism, to be changed.
    fn pulley_mut(&mut self) -> &mut Pulley;

    /// Force of the motor on the handle, N.
    fn force_n(&self) -> f64 {
        self.pulley().force_n()
    }

    /// Largest force of the motor since the last call, N.
    fn take_largest_force_n(&mut self) -> f64 {
        self.pulley_mut().take_largest_force_n()
    }

    /// Makes the encoder jump by a number of counts, as from a magnetic disturbance.
    fn jump(&mut self, counts: i32) {
        self.pulley_mut().jump(counts);
    }

    /// The rig behind the pulley.
    fn rig(&self) -> &FakeRig {
        self.pulley().rig()
    }
}
