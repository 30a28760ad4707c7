//! Another scene along a recorded motion: what would have been felt instead.

use super::error::ReplayError;
use super::scenes::Alternative;
use super::stepper::{StepResult, Stepping, stepper};
use crate::row::RecordedRow;
use haptic_core::planar::Plane;
use haptic_recording::{Entry, Metadata};
use serde::Serialize;

/// What a hand felt over a motion, while force flowed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Ticks with force.
    pub ticks: u64,
    square_sum: f64,
    /// Largest force on the hand, N: in the plane its length.
    pub peak_force_n: f64,
    /// Changes to sliding after at least 20 ms stuck: a bristle lets go and holds many times in a slow slide.
    pub breakaways: u64,
    /// Changes from sliding to stuck.
    pub stops: u64,
    /// Time stuck, s.
    pub stuck_s: f64,
    /// Work that the hand did against the force, J.
    pub energy_j: f64,
    /// How long it has been stuck, s.
    rest_s: f64,
    last: Option<LastTick>,
}

/// Least time stuck before a breakaway, s.
const REST_S: f64 = 0.02;

/// What the tally remembers of the tick before.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LastTick {
    position_m: Plane,
    force_n: Plane,
    contact: i8,
}

impl Tally {
    /// Root mean square of the force on the hand over the ticks with force, N.
    #[must_use]
    pub fn rms_force_n(&self) -> f64 {
        let ticks = self.ticks.max(1) as f64;
        (self.square_sum / ticks).sqrt()
    }

    /// Takes a row; one of a line lies along the first axis of the plane.
    fn take(&mut self, row: &RecordedRow) {
        let sample = &row.sample;
        if !sample.state.is_live() {
            (self.last, self.rest_s) = (None, 0.0);
            return;
        }
        let elapsed_s = sample.elapsed_ns as f64 * 1e-9;
        let (position_m, force_n): (Plane, Plane) = (row.device_position(), row.command_force());
        self.ticks += 1;
        self.square_sum += force_n.dot(force_n);
        self.peak_force_n = self.peak_force_n.max(force_n.length());
        let rest_s = std::mem::take(&mut self.rest_s);
        if sample.contact == 0 {
            self.stuck_s += elapsed_s;
            self.rest_s = rest_s + elapsed_s;
        }
        if let Some(last) = self.last {
            self.breakaways += u64::from(rest_s >= REST_S && sample.contact != 0);
            self.stops += u64::from(last.contact != 0 && sample.contact == 0);
            // The force was held from one tick to the next.
            self.energy_j -= last.force_n.dot(position_m - last.position_m);
        }
        self.last = Some(LastTick {
            position_m,
            force_n,
            contact: sample.contact,
        });
    }
}

/// Where two forces differ most.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LargestDifference {
    /// The tick.
    pub tick: u64,
    /// Its time on the daemon's clock, s.
    pub t_s: f64,
    /// Recorded force on the hand, N.
    #[serde(rename = "recorded_N")]
    pub recorded_n: f64,
    /// Force on the hand that would have been felt, N.
    #[serde(rename = "what_if_N")]
    pub what_if_n: f64,
    /// The same along the second axis of a rig of two, N.
    #[serde(rename = "recorded_y_N", skip_serializing_if = "Option::is_none")]
    pub recorded_y_n: Option<f64>,
    /// The same along the second axis of a rig of two, N.
    #[serde(rename = "what_if_y_N", skip_serializing_if = "Option::is_none")]
    pub what_if_y_n: Option<f64>,
}

impl LargestDifference {
    fn of(recorded: &RecordedRow, what_if: &RecordedRow) -> Self {
        let RecordedRow { sample, y } = recorded;
        Self {
            tick: sample.tick,
            t_s: sample.t_s,
            recorded_n: sample.command_force_n,
            what_if_n: what_if.sample.command_force_n,
            recorded_y_n: y.map(|y| y.command_force_n),
            what_if_y_n: what_if.y.map(|y| y.command_force_n),
        }
    }

    /// The difference of both forces, N: in the plane the length of it.
    #[must_use]
    pub fn size_n(&self) -> f64 {
        let y_n = self.what_if_y_n.unwrap_or(0.0) - self.recorded_y_n.unwrap_or(0.0);
        (self.what_if_n - self.recorded_n).hypot(y_n)
    }
}

/// A row as it was, and as it would have been.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhatIfRow {
    /// As recorded.
    pub recorded: RecordedRow,
    /// With the other scene; `None` where nothing follows from the recording.
    pub what_if: Option<RecordedRow>,
}

/// What was felt and what would have been felt, over the same ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// Rows of the recording.
    pub ticks: u64,
    /// Rows from which nothing follows.
    pub not_computed: u64,
    /// What was felt.
    pub recorded: Tally,
    /// What would have been felt.
    pub what_if: Tally,
    /// Where both differ most; `None` where they nowhere do.
    pub largest_difference: Option<LargestDifference>,
}

/// Renders something else along a recording's motion, row by row. The motion is that of the hand as
/// it was: it does not react to the other force.
#[derive(Debug)]
pub struct WhatIf {
    stepper: Box<dyn Stepping>,
    summary: Summary,
}

impl WhatIf {
    /// Begins at the beginning of a recording.
    ///
    /// # Errors
    /// The recording cannot be replayed.
    pub fn new(metadata: &Metadata, alternative: Alternative) -> Result<Self, ReplayError> {
        Ok(Self {
            stepper: stepper(metadata, Some(alternative))?,
            summary: Summary {
                ticks: 0,
                not_computed: 0,
                recorded: Tally::default(),
                what_if: Tally::default(),
                largest_difference: None,
            },
        })
    }

    /// Takes the next entry; gives what a row would have been.
    ///
    /// # Errors
    /// The scene cannot be rendered at the recording's rate.
    pub fn entry(&mut self, entry: &Entry) -> Result<Option<WhatIfRow>, ReplayError> {
        match entry {
            Entry::Mark(mark) => {
                self.stepper.mark(mark)?;
                Ok(None)
            }
            Entry::Row(sample, y) => self.row(&RecordedRow { sample: *sample, y: *y }).map(Some),
        }
    }

    /// What was found so far.
    #[must_use]
    pub const fn summary(&self) -> Summary {
        self.summary
    }

    fn row(&mut self, row: &RecordedRow) -> Result<WhatIfRow, ReplayError> {
        let Summary {
            ticks,
            not_computed,
            recorded,
            what_if,
            largest_difference,
        } = &mut self.summary;
        *ticks += 1;
        let StepResult::Computed(computed) = self.stepper.row(row)? else {
            *not_computed += 1;
            (recorded.last, what_if.last) = (None, None);
            return Ok(WhatIfRow {
                recorded: *row,
                what_if: None,
            });
        };
        recorded.take(row);
        what_if.take(&computed);
        let difference = LargestDifference::of(row, &computed);
        if difference.size_n() > largest_difference.as_ref().map_or(0.0, LargestDifference::size_n) {
            *largest_difference = Some(difference);
        }
        Ok(WhatIfRow {
            recorded: *row,
            what_if: Some(computed),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_ipc::RigState;

    #[test]
    fn a_breakaway_follows_a_rest() {
        let breakaways = |rest_ticks: usize| {
            let mut tally = Tally::default();
            let contacts = std::iter::repeat_n(0, rest_ticks).chain([1]);
            for contact in contacts.cycle().take(10 * (rest_ticks + 1)) {
                let mut row = RecordedRow::default();
                (row.sample.state, row.sample.elapsed_ns, row.sample.contact) = (RigState::Engaged, 1_000_000, contact);
                tally.take(&row);
            }
            (tally.breakaways, tally.stops)
        };
        assert_eq!(breakaways(30), (10, 9));
        assert_eq!(breakaways(5), (0, 9), "a bristle lets go and holds");
    }
}
