//! From a subscription's events to a recording.

use super::{Mark, Metadata, Writer};
use haptic_ipc::{Event, RigState, Sample, SamplesEvent, StateEvent};
use std::collections::VecDeque;
use std::io::{self, Write};

/// How much a recording holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// Rows.
    pub rows: u64,
    /// Rows that are missing.
    pub lost: u64,
    /// Size, bytes.
    pub bytes: u64,
    /// Time from the first row to the last, s.
    pub length_s: f64,
}

/// Writes what a subscription to the topics `state` and `samples` brings, with each change put
/// before the first row that it concerns: events of the two topics overtake one another on their
/// way.
#[derive(Debug)]
pub struct Recorder<W: Write> {
    writer: Writer<W>,
    /// Changes that no row has come up to.
    pending: VecDeque<Mark>,
    revision: u64,
    state: Option<RigState>,
    first_s: Option<f64>,
    last_s: f64,
}

impl<W: Write> Recorder<W> {
    /// Begins a recording.
    ///
    /// # Errors
    /// `out` cannot be written to.
    pub fn new(out: W, metadata: &Metadata) -> io::Result<Self> {
        Ok(Self {
            writer: Writer::new(out, metadata)?,
            pending: VecDeque::new(),
            revision: metadata.revision,
            state: None,
            first_s: None,
            last_s: 0.0,
        })
    }

    /// Takes an event. Those that are not of a recording are passed over.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn event(&mut self, event: &Event) -> io::Result<()> {
        match event {
            Event::State(state) => {
                self.state_event(state);
                Ok(())
            }
            Event::Samples(samples) => self.samples(samples),
            _ => Ok(()),
        }
    }

    /// Passes on what is in memory, for when no events come.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(mut self) -> io::Result<(W, Totals)> {
        while let Some(mark) = self.pending.pop_front() {
            self.writer.mark(&mark)?;
        }
        let mut totals = self.totals();
        let (out, bytes) = self.writer.finish()?;
        totals.bytes = bytes;
        Ok((out, totals))
    }

    /// Time of the first row, s, once there is one.
    #[must_use]
    pub const fn first_s(&self) -> Option<f64> {
        self.first_s
    }

    /// How much it holds by now.
    #[must_use]
    pub fn totals(&self) -> Totals {
        Totals {
            rows: self.writer.row_count(),
            lost: self.writer.lost(),
            bytes: self.writer.bytes(),
            length_s: self.first_s.map_or(0.0, |first| self.last_s - first),
        }
    }

    fn state_event(&mut self, event: &StateEvent) {
        if event.revision != self.revision {
            self.revision = event.revision;
            self.pending.push_back(Mark::Scene {
                tick: event.tick,
                revision: event.revision,
                name: event.scene.clone(),
                law: event.law.clone(),
                params: event.params.clone(),
                arrival: event.arrival.clone(),
            });
        }
        if Some(event.state) != self.state {
            self.state = Some(event.state);
            self.pending.push_back(Mark::State {
                tick: event.tick,
                state: event.state,
                fault: event.fault.clone(),
            });
        }
    }

    fn samples(&mut self, event: &SamplesEvent) -> io::Result<()> {
        if event.dropped > 0 {
            self.writer.mark(&Mark::Lost { rows: event.dropped })?;
        }
        let mut rows: &[Sample] = &event.rows;
        if let (Some(first), Some(last)) = (rows.first(), rows.last()) {
            self.first_s.get_or_insert(first.t_s);
            self.last_s = last.t_s;
        }
        while let (Some(last), Some(at)) = (rows.last(), self.pending.front().and_then(Mark::tick)) {
            if at > last.tick {
                break;
            }
            let (before, after) = rows.split_at(rows.partition_point(|row| row.tick < at));
            self.writer.rows(before)?;
            rows = after;
            if let Some(mark) = self.pending.pop_front() {
                self.writer.mark(&mark)?;
            }
        }
        self.writer.rows(rows)
    }
}
