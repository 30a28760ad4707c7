//! The newest ticks, and clicks by their ticks: a screen learns of ticks in batches, so that a click may be
//! reported before its tick or after it.

use haptic_core::servo::InputWord;
use haptic_ipc::Sample;
use std::collections::VecDeque;

/// How late a click may be reported, in ticks.
const LATEST_CLICK_TICKS: usize = 1000;

/// The newest ticks, and the clicks that wait for theirs.
#[derive(Debug, Default)]
pub(super) struct RecentTicks {
    /// The newest last.
    rows: VecDeque<Sample>,
    /// Clicks at ticks that have not come yet.
    clicks: Vec<u64>,
}

impl RecentTicks {
    pub(super) fn newest(&self) -> Option<&Sample> {
        self.rows.back()
    }

    /// Takes a tick.
    pub(super) fn push(&mut self, row: &Sample) {
        if self.rows.len() >= LATEST_CLICK_TICKS {
            self.rows.pop_front();
        }
        self.rows.push_back(*row);
    }

    /// The newest tick up to this one.
    pub(super) fn at(&self, tick: u64) -> Option<&Sample> {
        self.rows.iter().rev().find(|row| row.tick <= tick)
    }

    /// Takes a click; whether its tick is there already.
    pub(super) fn click(&mut self, tick: u64) -> bool {
        let is_there = self.newest().is_some_and(|newest| newest.tick >= tick);
        if !is_there {
            self.clicks.push(tick);
        }
        is_there
    }

    /// Whether a click waited for the newest tick; it waits no more.
    pub(super) fn take_click(&mut self) -> bool {
        let newest = self.newest().map_or(0, |row| row.tick);
        let waiting = self.clicks.len();
        self.clicks.retain(|tick| *tick > newest);
        self.clicks.len() < waiting
    }

    pub(super) fn forget_clicks(&mut self) {
        self.clicks.clear();
    }
}

/// The buttons that are pressed in a tick, a bit each.
pub(super) fn buttons(row: &Sample) -> u8 {
    let word = InputWord {
        flags: row.input_flags,
        detail: row.error_detail,
    };
    let sample = word.sample(row.device_sequence, row.device_time_ns, row.sample_position_m);
    sample.map_or(0, |sample| sample.buttons)
}
