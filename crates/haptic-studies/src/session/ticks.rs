//! The ticks of a session: of the trial under way, for its recording, and the newest ones for clicks; and the frames
//! that showed the cursor.
//!
//! A screen learns of ticks in batches, so that a click may be reported before its tick or after it.

use haptic_core::Scene;
use haptic_ipc::{Sample, ServoSetup};
use haptic_motion::median::median;
use haptic_recording::Mark;
use std::collections::VecDeque;

/// Ticks, what happened between them, and what held at the first one.
#[derive(Clone, Debug, PartialEq)]
pub struct Ticks {
    /// The active scene at the first tick.
    pub scene: Scene,
    /// Its revision.
    pub revision: u64,
    /// The servo's settings at the first tick, where they are known.
    pub servo: Option<ServoSetup>,
    /// A row for each tick.
    pub rows: Vec<Sample>,
    /// Changes of scene, state and settings.
    pub marks: Vec<Mark>,
}

impl Ticks {
    pub(super) fn new(scene: Scene, revision: u64, servo: Option<ServoSetup>) -> Self {
        Self {
            scene,
            revision,
            servo,
            rows: Vec::new(),
            marks: Vec::new(),
        }
    }

    /// Takes the ticks up to this one away, and what happened by then; the rest begins with what holds after them.
    pub(super) fn split_after(&mut self, tick: u64) -> Self {
        let later_rows = self.rows.split_off(self.rows.partition_point(|row| row.tick <= tick));
        let is_later = |mark: &Mark| mark.tick().is_some_and(|at| at > tick);
        let (later_marks, marks): (Vec<Mark>, Vec<Mark>) = self.marks.drain(..).partition(is_later);
        let mut rest = Self::new(self.scene.clone(), self.revision, self.servo.clone());
        for mark in &marks {
            match mark {
                Mark::Scene {
                    revision,
                    arrival: Some(arrival),
                    ..
                } => (rest.scene, rest.revision) = (arrival.scene.clone(), *revision),
                Mark::Servo { servo, .. } => rest.servo = Some((**servo).clone()),
                _ => {}
            }
        }
        (rest.rows, rest.marks) = (later_rows, later_marks);
        Self {
            marks,
            ..std::mem::replace(self, rest)
        }
    }
}

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
    let sample = row
        .input_word()
        .sample(row.device_sequence, row.device_time_ns, row.sample_position_m);
    sample.map_or(0, |sample| sample.buttons)
}

/// A frame that showed the cursor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// From the sample on the device to the end of the frame that shows it, s.
    pub latency_s: f64,
    /// From this frame to the next one, s.
    pub lasted_s: f64,
}

impl Frame {
    /// The median latency, and what 95 % of them do not exceed, s.
    pub(super) fn median_and_p95_s(frames: &[Self]) -> (Option<f64>, Option<f64>) {
        let mut latencies_s: Vec<f64> = frames.iter().map(|frame| frame.latency_s).collect();
        latencies_s.sort_unstable_by(f64::total_cmp);
        let last = latencies_s.len().saturating_sub(1);
        let p95_s = latencies_s.get((last * 19).div_ceil(20)).copied();
        (median(&mut latencies_s), p95_s)
    }

    /// Frames a second, by the median time between two.
    pub(super) fn rate_hz(frames: &[Self]) -> Option<f64> {
        let mut lasted_s: Vec<f64> = frames.iter().map(|frame| frame.lasted_s).collect();
        median(&mut lasted_s).filter(|lasted_s| *lasted_s > 0.0).map(f64::recip)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slowest_twentieth_is_not_hidden_by_the_median() {
        let mut frames = Vec::new();
        assert_eq!(
            (Frame::median_and_p95_s(&frames), Frame::rate_hz(&frames)),
            ((None, None), None)
        );
        for number in 0..=20 {
            let is_usual = number < 19;
            frames.push(Frame {
                latency_s: if is_usual { 0.01 } else { 0.08 },
                lasted_s: if is_usual { 0.0125 } else { 0.4 },
            });
        }
        assert_eq!(Frame::median_and_p95_s(&frames), (Some(0.01), Some(0.08)));
        assert_eq!(Frame::rate_hz(&frames), Some(80.0));
    }
}
