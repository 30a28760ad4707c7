//! How much work a tick may do.

use core::f64::consts::PI;

/// Largest `omega_d T` accepted, rad: the work of a tick is bounded by the half-turns in it.
pub const MAX_PHASE_PER_TICK_RAD: f64 = 400.0;

/// Work that every tick may do, beside that of its half-turns.
const BASE_WORK: f64 = 16.0;

/// The work that a tick may do, with so much for each half-turn of the free oscillation.
pub(super) fn work_budget(half_turns: f64, for_each: f64, extra: u32) -> u32 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "from 16 to some thousand"
    )]
    let budget = (BASE_WORK + for_each * half_turns.min(MAX_PHASE_PER_TICK_RAD / PI)) as u32;
    budget + extra
}
