//! How much work a tick may do.

use core::f64::consts::PI;

/// Largest `omega_d T` accepted, rad: the work of a tick is bounded by the half-turns in it.
pub const MAX_PHASE_PER_TICK_RAD: f64 = 400.0;

/// Work that every tick may do, beside two for each half-turn of the free oscillation.
const BASE_WORK: f64 = 16.0;
/// Bound on a tick's events, and on the extrema looked at in it, whatever time has elapsed.
const MAX_WORK: f64 = BASE_WORK + 2.0 * MAX_PHASE_PER_TICK_RAD / PI;

/// The work that a tick may do.
pub(super) fn work_budget(half_turns: f64, extra: u32) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 16 to 271")]
    let budget = (BASE_WORK + 2.0 * half_turns).min(MAX_WORK) as u32;
    budget + extra
}
