//! Whether a motion that the machine or the link interrupted may be repeated without asking again.
//!
//! The motor has let go by then. Nothing may move by itself where somebody holds the handle, or where it no longer lies
//! where the person has agreed to a motion.

use haptic_ipc::{RigState, Sample};
use std::time::Duration;

/// Time from the fault to the reset: a handle that was in motion comes to rest, and the person sees what is announced.
pub(super) const PAUSE: Duration = Duration::from_secs(3);

/// The last part of it, in which the handle must lie still.
pub(super) const STILL: Duration = Duration::from_secs(1);

/// Motion of a handle that lies still, m: a hand on it moves it farther.
const STILL_M: f64 = 2e-4;

/// Where the handle may be moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HandleRange {
    /// Middle of its range, m, where the person has put it.
    pub(super) middle_m: f64,
    /// Farthest that it may go from there, m.
    pub(super) farthest_m: f64,
}

impl HandleRange {
    /// Farthest that a motion may go from a position, m.
    pub(super) fn left_from(&self, position_m: f64) -> f64 {
        (self.farthest_m - self.beside(position_m)).max(0.0)
    }

    /// Distance of a position from the middle, m.
    pub(super) fn beside(&self, position_m: f64) -> f64 {
        (position_m - self.middle_m).abs()
    }

    /// Whether a motion that goes so far may begin where the handle has come to rest, by the ticks since the fault;
    /// else why not.
    pub(super) fn allows(&self, needed_m: f64, ticks: &[Sample], period_s: f64) -> Result<(), String> {
        let Some(newest) = ticks.last() else {
            return Err("the daemon reports no position".to_owned());
        };
        if ticks.iter().any(|row| row.state == RigState::Disconnected) {
            return Err("the rig was disconnected, and its position is no longer known".to_owned());
        }
        let still_s = STILL.as_secs_f64();
        let is_last = |row: &&Sample| (newest.tick - row.tick) as f64 * period_s <= still_s;
        let (low, high) = ticks.iter().filter(is_last).fold(
            (newest.device_position_m, newest.device_position_m),
            |(low, high), row| (low.min(row.device_position_m), high.max(row.device_position_m)),
        );
        if high - low > STILL_M {
            return Err(format!(
                "the handle does not lie still: it moved by {:.1} mm in {still_s} s",
                1e3 * (high - low)
            ));
        }
        let left_m = self.left_from(newest.device_position_m);
        if left_m < needed_m {
            return Err(format!(
                "the handle lies {:.1} mm from the middle of its range, which leaves {:.1} mm for a motion over {:.1} \
                 mm to either side",
                1e3 * (newest.device_position_m - self.middle_m).abs(),
                1e3 * left_m,
                1e3 * needed_m
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(position_m: impl Fn(u64) -> f64, state: RigState) -> Vec<Sample> {
        (1..=3000)
            .map(|tick| Sample {
                tick,
                state,
                device_position_m: position_m(tick),
                ..Sample::default()
            })
            .collect()
    }

    #[test]
    fn motion_repeats_only_if_handle_lies_still_and_has_room() {
        let place = HandleRange {
            middle_m: 0.1,
            farthest_m: 0.02,
        };
        let allowed = |position: &dyn Fn(u64) -> f64, state| place.allows(0.01, &ticks(position, state), 1e-3);
        // It came to rest within the first two seconds.
        let coasting = |tick: u64| 0.105 - 0.01 * 0.99_f64.powf(tick as f64);
        assert_eq!(allowed(&coasting, RigState::Faulted), Ok(()));
        for (position, state, part) in [
            (
                (&|_| 0.111) as &dyn Fn(u64) -> f64,
                RigState::Faulted,
                "11.0 mm from the middle",
            ),
            (&|_| 0.089, RigState::Faulted, "leaves 9.0 mm"),
            (
                &|tick| 0.1 + 1e-6 * tick as f64,
                RigState::Faulted,
                "does not lie still",
            ),
            (&|_| 0.1, RigState::Disconnected, "disconnected"),
        ] {
            let why = allowed(position, state).expect_err(part);
            assert!(why.contains(part), "{why}");
        }
        assert!(place.allows(0.01, &[], 1e-3).is_err(), "nothing is known");
    }
}
