//! The times of a sampled force, and what they make of a spring and a damper.
//!
//! A sample is taken every period. The force for it comes after a delay and holds for a period,
//! until the force for the next sample comes.

mod rig_loop;
mod wall;

pub(super) use rig_loop::RigLoop;

/// Most periods of delay that are followed one by one. A longer delay is followed in so many longer
/// periods: the delay in the mean, which has half a period for which a force holds, stays the same,
/// and what differs goes with the square of a period over the delay.
const MAX_PERIODS: usize = 64;

/// A delay so near to whole periods, as a share of one, is whole.
const WHOLE: f64 = 1e-9;

/// When samples are taken, and when the forces for them come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sampled {
    /// Time between two samples, s.
    period_s: f64,
    /// Whole periods from a sample to its force.
    whole: usize,
    /// Share of a period that comes on top, from 0 to below 1.
    share: f64,
}

impl Sampled {
    /// `period_s` is the time between two samples, s (> 0), and `delay_s` the time from one to its
    /// force, s (>= 0).
    pub(super) fn new(period_s: f64, delay_s: f64) -> Self {
        let most = MAX_PERIODS as f64;
        let in_mean = delay_s + 0.5 * period_s;
        // T' (most + 1/2) = tau + T/2
        let period_s = period_s.max(in_mean / (most + 0.5));
        let periods = (in_mean / period_s - 0.5).clamp(0.0, most);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to 64")]
        let whole = (periods + WHOLE) as usize;
        let share = periods - whole as f64;
        Self {
            period_s,
            whole,
            share: if share < WHOLE { 0.0 } else { share },
        }
    }
}
