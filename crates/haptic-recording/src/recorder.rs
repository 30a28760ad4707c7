//! From a subscription's events to a recording.
//!
//! Missing rows and missed periods are found between two rows.

use crate::error::CreateError;
use crate::format::Format;
use crate::mark::{Mark, StateMarks};
use crate::metadata::Metadata;
use crate::rows::Rows;
use crate::writer::{Totals, Writer};
use haptic_ipc::{Event, Sample, SampleY, SamplesEvent, SnapshotEvent};
use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::path::Path;

/// Writes what a subscription to the topics `state`, `log`, `snapshot` and `samples` brings, with each change put
/// before the first row that it concerns: events of the topics overtake one another on their way.
pub struct Recorder {
    writer: Writer,
    gaps: Gaps,
    /// Changes that no row has come up to, by their ticks.
    pending: VecDeque<Mark>,
    state_marks: StateMarks,
}

/// Creates a recording; the ending of its name says its format.
///
/// # Errors
/// The name says no format, the file cannot be written, or it is there and not to be replaced.
pub fn create(path: &Path, metadata: &Metadata, replace: bool) -> Result<Recorder, CreateError> {
    Ok(Recorder::with(Writer::create(path, metadata, replace)?, metadata))
}

impl Recorder {
    /// Begins a recording in a file that was created for it, or in a pipe.
    ///
    /// # Errors
    /// It cannot be written to, or the format is not written into what it is.
    pub fn new(format: Format, file: File, path: &Path, metadata: &Metadata) -> io::Result<Self> {
        Ok(Self::with(Writer::new(format, file, path, metadata)?, metadata))
    }

    fn with(writer: Writer, metadata: &Metadata) -> Self {
        Self {
            writer,
            gaps: Gaps::new(metadata),
            pending: VecDeque::new(),
            state_marks: StateMarks::after(metadata.revision),
        }
    }

    /// Takes an event. Those that are not of a recording are passed over.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn event(&mut self, event: &Event) -> io::Result<()> {
        match event {
            Event::State(state) => {
                for mark in self.state_marks.of(state) {
                    self.mark(mark);
                }
                Ok(())
            }
            Event::Servo(event) => {
                self.mark((**event).clone().into());
                Ok(())
            }
            Event::Snapshot(event) => {
                let SnapshotEvent { tick, snapshot } = (**event).clone();
                let snapshot = Box::new(snapshot);
                self.mark(Mark::Snapshot { tick, snapshot });
                Ok(())
            }
            Event::Log(entry) => {
                // What no tick carried out changed nothing of the rows.
                if let Some(tick) = entry.tick {
                    let entry = entry.clone();
                    self.mark(Mark::Journal { tick, entry });
                }
                Ok(())
            }
            Event::Samples(samples) => self.samples(samples),
            Event::Timing(_) | Event::Unknown => Ok(()),
        }
    }

    /// Takes a mark of its own, as a marker that a person sets. It is put before the first row of
    /// its tick, or if that is written already before the next row.
    pub fn mark(&mut self, mark: Mark) {
        let place = self.pending.partition_point(|other| other.tick() <= mark.tick());
        self.pending.insert(place, mark);
    }

    /// Says that `count` changes or marks are missing here.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn lost_changes(&mut self, changes: u64) -> io::Result<()> {
        self.writer.mark(&Mark::LostChanges { changes })
    }

    /// Passes on what is in memory, for when no events come.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }

    /// Ends the recording, says in it that this is its end, and waits until it is on the disk.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(mut self) -> io::Result<Totals> {
        self.pending()?;
        self.writer.finish()
    }

    /// Closes the recording without an end, as one that nobody ended on purpose.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn break_off(mut self) -> io::Result<Totals> {
        self.pending()?;
        self.writer.break_off()
    }

    /// How much it holds by now.
    #[must_use]
    pub fn totals(&self) -> Totals {
        self.writer.totals()
    }

    pub(crate) fn samples(&mut self, event: &SamplesEvent) -> io::Result<()> {
        if event.dropped > 0 {
            self.gaps.announce(event.dropped);
            self.writer.mark(&Mark::Lost { rows: event.dropped })?;
        }
        self.rows(&event.rows, &event.rows_y)
    }

    /// Takes rows, in their order, with what each has of a second axis: nothing on a rig of one.
    ///
    /// # Errors
    /// They cannot be written, or have not as many axes as the recording.
    pub fn rows(&mut self, rows: &[Sample], rows_y: &[SampleY]) -> io::Result<()> {
        let mut rows = Rows::of(rows, rows_y, self.writer.axes())?;
        while let (Some(last), Some(at)) = (rows.samples.last(), self.pending.front().and_then(Mark::tick)) {
            if at > last.tick {
                break;
            }
            let (before, after) = rows.split_at(rows.samples.partition_point(|row| row.tick < at));
            self.rows_between_marks(before)?;
            rows = after;
            if let Some(mark) = self.pending.pop_front() {
                self.writer.mark(&mark)?;
            }
        }
        self.rows_between_marks(rows)
    }

    /// Writes rows, with a mark wherever one is missing or the loop missed periods.
    fn rows_between_marks(&mut self, rows: Rows<'_>) -> io::Result<()> {
        let (mut unwritten, mut written) = (rows, 0);
        for (index, row) in rows.samples.iter().enumerate() {
            let gap = self.gaps.next(row);
            if gap.lost == 0 && gap.missed == 0 {
                continue;
            }
            let (before, after) = unwritten.split_at(index - written);
            self.writer.put_rows(before)?;
            (unwritten, written) = (after, index);
            if gap.lost > 0 {
                self.writer.mark(&Mark::Lost { rows: gap.lost })?;
            }
            if gap.missed > 0 {
                let (tick, periods) = (row.tick, gap.missed);
                self.writer.mark(&Mark::Missed { tick, periods })?;
            }
        }
        self.writer.put_rows(unwritten)
    }

    /// Writes the changes that no row has come up to.
    fn pending(&mut self) -> io::Result<()> {
        while let Some(mark) = self.pending.pop_front() {
            self.writer.mark(&mark)?;
        }
        Ok(())
    }
}

/// What lies between a row and the one before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Gap {
    /// Rows that are missing and were not announced.
    pub(crate) lost: u64,
    /// Periods that the loop missed.
    pub(crate) missed: u64,
}

/// Follows ticks and deadlines from row to row.
#[derive(Debug)]
pub(crate) struct Gaps {
    /// Ticks from one row to the next.
    every: u64,
    period_s: f64,
    /// Tick and deadline of the last row, s.
    last: Option<(u64, f64)>,
    /// Missing rows that the daemon reported since.
    announced: u64,
}

impl Gaps {
    pub(crate) fn new(metadata: &Metadata) -> Self {
        let every = (metadata.loop_rate_hz / metadata.rate_hz).round();
        Self {
            // Saturates; not a number becomes 0.
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 1")]
            every: every.max(1.0) as u64,
            period_s: metadata.loop_rate_hz.recip(),
            last: None,
            announced: 0,
        }
    }

    /// Takes the number of missing rows that the daemon reports.
    pub(crate) fn announce(&mut self, rows: u64) {
        self.announced = self.announced.saturating_add(rows);
    }

    /// Takes the next row. The loop's deadlines are whole periods apart, and a tick each has one:
    /// more periods than ticks between two rows were missed.
    pub(crate) fn next(&mut self, row: &Sample) -> Gap {
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53 ns")]
        let deadline_s = row.t_s - row.wake_latency_ns as f64 * 1e-9;
        let announced = std::mem::take(&mut self.announced);
        let Some((last_tick, last_s)) = self.last.replace((row.tick, deadline_s)) else {
            return Gap::default();
        };
        // A daemon that was started again counts from the beginning.
        let Some(ticks @ 1..) = row.tick.checked_sub(last_tick) else {
            return Gap::default();
        };
        let lost = (ticks / self.every).saturating_sub(1);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates; not a number becomes 0"
        )]
        let periods = ((deadline_s - last_s) / self.period_s).round() as u64;
        Gap {
            lost: lost.saturating_sub(announced),
            missed: periods.saturating_sub(ticks),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{metadata, sample};

    fn row(tick: u64, deadline_ms: f64, wake_latency_ns: u64) -> Sample {
        Sample {
            tick,
            t_s: deadline_ms * 1e-3 + wake_latency_ns as f64 * 1e-9,
            wake_latency_ns,
            ..sample(0)
        }
    }

    #[test]
    fn absent_ticks_are_lost_rows_unless_announced() {
        let mut gaps = Gaps::new(&metadata());
        let mut lost = |announced, tick: u64| {
            gaps.announce(announced);
            gaps.next(&row(tick, tick as f64, 0)).lost
        };
        assert_eq!(lost(0, 100), 0, "what came before the first row is not missing");
        assert_eq!(lost(0, 101), 0);
        assert_eq!(lost(0, 105), 3);
        assert_eq!(lost(3, 109), 0);
        assert_eq!(lost(2, 113), 1);
        assert_eq!(lost(0, 114), 0, "an announcement is for the next row");
        assert_eq!(lost(0, 5), 0, "the daemon was started again");
        assert_eq!(lost(0, 7), 1);
    }

    #[test]
    fn a_thinned_recording_lacks_only_rows_of_its_own_rate() {
        let mut gaps = Gaps::new(&Metadata {
            rate_hz: 100.0,
            ..metadata()
        });
        let gap = |gaps: &mut Gaps, tick: u64, deadline_ms| gaps.next(&row(tick, deadline_ms, 0));
        assert_eq!(gap(&mut gaps, 10, 10.0), Gap::default());
        assert_eq!(gap(&mut gaps, 20, 20.0), Gap::default());
        assert_eq!(gap(&mut gaps, 50, 57.0), Gap { lost: 2, missed: 7 });
    }

    #[test]
    fn late_tick_misses_periods_only_for_skipped_deadlines() {
        let mut gaps = Gaps::new(&metadata());
        let mut missed = |tick, deadline_ms, late_ns| gaps.next(&row(tick, deadline_ms, late_ns)).missed;
        assert_eq!(missed(1, 1.5, 0), 0);
        assert_eq!(missed(2, 2.5, 900_000), 0, "late, and within its period");
        assert_eq!(missed(3, 3.5, 2_300_000), 0);
        assert_eq!(missed(4, 6.5, 0), 2, "the tick before took until after two deadlines");
        assert_eq!(missed(5, 7.5, 100), 0);
    }
}
