//! Our own clock, and numbers that have not been there before.

use rustix::time::{ClockId, clock_gettime};

/// The monotonic clock, ns.
#[must_use]
pub fn now_ns() -> u64 {
    let time = clock_gettime(ClockId::Monotonic);
    u64::try_from(time.tv_sec).unwrap_or(0) * 1_000_000_000 + u64::try_from(time.tv_nsec).unwrap_or(0)
}

/// A number for a hello: not that of any hello of this machine before, as far as a clock of
/// nanoseconds can show.
#[cfg(feature = "links")]
pub(crate) fn nonce() -> u32 {
    let [a, b, c, d, ..] = now_ns().wrapping_mul(0x9E37_79B9_7F4A_7C15).to_be_bytes();
    u32::from_be_bytes([a, b, c, d])
}
