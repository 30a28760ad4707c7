//! What the benchmarks share: turns of a loop, and their numbers made into one.

use haptic_ipc::{Client, Request, Timing, TimingWindow};
use std::time::Duration;

/// Turns of which the middle one counts: one in which the host took the processor away does not decide.
pub const TURNS: usize = 5;

/// Length of a turn, s.
pub const TURN_S: u64 = 10;

/// The daemon's own account of a turn that begins now.
pub fn turn(client: &mut Client) -> TimingWindow {
    std::thread::sleep(Duration::from_secs(TURN_S));
    last_turn(client)
}

/// The daemon's own account of a turn that ends now.
pub fn last_turn(client: &mut Client) -> TimingWindow {
    client
        .request::<Timing>(Request::Timing {})
        .expect("the timing")
        .last_10_s
}

/// The middle one of some values.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The value below which so many in a thousand of some sorted values lie.
pub fn percentile(sorted: &[u64], per_mille: usize) -> u64 {
    sorted[(sorted.len() - 1) * per_mille / 1000]
}

/// Nanoseconds as microseconds.
#[expect(clippy::cast_precision_loss, reason = "nanoseconds below 2^53")]
pub fn us(ns: u64) -> f64 {
    ns as f64 * 1e-3
}
