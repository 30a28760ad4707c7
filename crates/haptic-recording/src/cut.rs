//! Cuts a part out of a recording.

use crate::copy::{Copy, Source};
use crate::error::CopyError;
use crate::mark::{Entry, Mark};
use crate::metadata::Metadata;
use crate::writer::Totals;
use haptic_ipc::Sample;
use std::ops::Range;
use std::path::Path;

/// A part of a recording: from the first row that is not before its start to the last one before its
/// end.
#[derive(Clone, Debug, PartialEq)]
pub enum Span {
    /// Time since the recording's first row, s.
    Time(Range<f64>),
    /// Ticks.
    Ticks(Range<u64>),
}

/// Writes a part of a recording, in any format. Its metadata are those of the recording, with the
/// scene and the moment in which the part begins. Its first marks are the state then, and a scene
/// whose ramp continues.
///
/// A replay of the part gives the same forces where the part begins without force, or with a `snapshot` of the servo's
/// state before its first row.
///
/// # Errors
/// The recording is damaged before the end of the part, no row is within it, or the copy cannot be
/// written. Then there is no copy.
pub fn cut(from: &Path, to: &Path, span: &Span, replace: bool, snapshot: Option<&Mark>) -> Result<Totals, CopyError> {
    let mut reader = Source::open(from)?;
    let mut before = PriorState::new(reader.metadata().clone());
    let mut copy: Option<Copy> = None;
    let (mut first_s, mut last_s, mut rows) = (None, 0.0, 0);
    while let Some(entry) = reader.next()? {
        match (entry, &mut copy) {
            (Entry::Mark(mark), None) => before.recent.push(mark),
            (Entry::Mark(mark), Some(copy)) => copy.entry(&Entry::Mark(mark))?,
            (Entry::Row(row, y), begun) => {
                let since_s = row.t_s - *first_s.get_or_insert(row.t_s);
                (last_s, rows) = (since_s, rows + 1);
                let (is_early, is_late) = match span {
                    Span::Time(span) => (since_s < span.start, since_s >= span.end),
                    Span::Ticks(span) => (row.tick < span.start, row.tick >= span.end),
                };
                match begun {
                    Some(copy) if !is_late => copy.entry(&Entry::Row(row, y))?,
                    None if is_early => before.pass(),
                    None if !is_late => {
                        let (metadata, mut marks) = before.at(&row, since_s);
                        // The state before a row comes before all that changes with it.
                        marks.extend(snapshot.filter(|mark| mark.tick() == Some(row.tick)).cloned());
                        marks.append(&mut before.recent);
                        let begun = copy.insert(Copy::new(to, &metadata, replace)?);
                        for mark in marks {
                            begun.entry(&Entry::Mark(mark))?;
                        }
                        begun.entry(&Entry::Row(row, y))?;
                    }
                    Some(_) => return finish(copy, true, &reader, rows, last_s),
                    None => {}
                }
            }
        }
    }
    let is_complete = reader.is_complete();
    finish(copy, is_complete, &reader, rows, last_s)
}

fn finish(
    copy: Option<Copy>,
    is_complete: bool,
    reader: &Source,
    rows: u64,
    length_s: f64,
) -> Result<Totals, CopyError> {
    let empty = || CopyError::Empty {
        path: reader.path().to_path_buf(),
        rows,
        length_s,
    };
    copy.ok_or_else(empty)?.finish(is_complete)
}

/// What came before the part.
struct PriorState {
    metadata: Metadata,
    /// Scenes that the metadata do not hold.
    scenes: Vec<Mark>,
    state: Option<Mark>,
    /// Marks since the last row: they concern the next one.
    recent: Vec<Mark>,
}

impl PriorState {
    fn new(metadata: Metadata) -> Self {
        Self {
            metadata,
            scenes: Vec::new(),
            state: None,
            recent: Vec::new(),
        }
    }

    /// Passes over a row, and takes what the marks before it say.
    fn pass(&mut self) {
        for mark in self.recent.drain(..) {
            match &mark {
                Mark::State { .. } => self.state = Some(mark),
                Mark::Servo { servo, .. } => self.metadata.servo = Some((**servo).clone()),
                Mark::Scene { arrival, .. } => {
                    if let Some(arrival) = arrival {
                        // It says all that came before.
                        self.scenes.clear();
                        if let Some(ramp) = &arrival.ramp {
                            self.metadata.scene = ramp.from.clone();
                        }
                    }
                    self.scenes.push(mark);
                }
                _ => {}
            }
        }
    }

    /// The metadata and first marks of a part that begins with a row.
    fn at(&mut self, row: &Sample, since_s: f64) -> (Metadata, Vec<Mark>) {
        let mut metadata = self.metadata.clone();
        metadata.started_unix_s += since_s;
        let mut marks = std::mem::take(&mut self.scenes);
        if let Some(Mark::Scene {
            tick,
            revision,
            arrival: Some(arrival),
            ..
        }) = marks.first()
        {
            #[expect(clippy::cast_precision_loss, reason = "ticks of days")]
            let ramped_s = row.tick.saturating_sub(*tick) as f64 / metadata.loop_rate_hz;
            if arrival.ramp.as_ref().is_none_or(|ramp| ramp.over_s <= ramped_s) {
                metadata.revision = *revision;
                metadata.scene = arrival.scene.clone();
                marks.remove(0);
            }
        }
        marks.extend(self.state.take());
        (metadata, marks)
    }
}
