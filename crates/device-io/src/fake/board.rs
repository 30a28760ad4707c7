//! What the fakes of other makers' boards have in common.

use super::FakeRig;

/// A motor controller that speaks lines of text, on the fake rig. It has no clock of its own; whoever runs it says what time it is.
pub trait Board: Send {
    /// Takes in what came at a time, ns; gives away the lines that it answers, with their ends.
    fn hear(&mut self, bytes: &[u8], now_ns: u64) -> Vec<Vec<u8>>;

    /// Lets time go by, and its watchdog with it.
    fn live_until(&mut self, now_ns: u64);

    /// The force that the motor gives to the handle, N.
    fn force_n(&self) -> f64;

    /// The largest force that the motor gave since this was last asked, N.
    fn take_largest_force_n(&mut self) -> f64;

    /// Whether the motor is on.
    fn is_on(&self) -> bool;

    /// Whether a watchdog has switched the motor off since it was last on.
    fn watchdog_has_bitten(&self) -> bool;

    /// The encoder jumps by so many counts, as from a magnetic disturbance.
    fn jump(&mut self, counts: i32);

    /// What it measures and drives.
    fn rig(&self) -> &FakeRig;
}
