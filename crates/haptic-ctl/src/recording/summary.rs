//! What a recording holds, from one pass over it.

use haptic_ipc::{RigState, ServoSetup};
use haptic_recording::{Ending, Entry, Format, Mark, Metadata, RecordingError};
use serde::Serialize;
use std::path::Path;

/// How well the time of a tick is known, s: better than it is printed.
const KNOWN_TO_S: f64 = 2e-4;

/// Rows whose ticks do not follow one another, and no mark says so.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Disorder {
    /// Rows that are missing between two.
    pub(crate) jumped: u64,
    /// Rows with the tick of the row before.
    pub(crate) repeated: u64,
    /// Rows with an earlier one.
    pub(crate) back: u64,
}

impl Disorder {
    /// Takes a tick after the one before; between two rows are `every` ticks, and `lost` rows as marks say.
    fn take(&mut self, before: u64, tick: u64, every: u64, lost: u64) {
        match tick.checked_sub(before) {
            None => self.back += 1,
            Some(0) => self.repeated += 1,
            Some(ticks) => {
                let missing = (ticks / every).saturating_sub(1);
                self.jumped = self.jumped.saturating_add(missing.saturating_sub(lost));
            }
        }
    }
}

/// When each tick was, within [`KNOWN_TO_S`].
#[derive(Debug, Default)]
struct TickTimes {
    /// Time between two ticks as the rate says, s.
    tick_s: f64,
    /// Ticks that did not come when the rate says, after the one before, and their times, s.
    known: Vec<(u64, f64)>,
}

impl TickTimes {
    fn take(&mut self, tick: u64, t_s: f64) {
        if self.of(tick).is_none_or(|known_s| (known_s - t_s).abs() > KNOWN_TO_S) {
            self.known.push((tick, t_s));
        }
    }

    /// The time of a tick, s; `None` before the first.
    fn of(&self, tick: u64) -> Option<f64> {
        let (known, t_s) = self.known.iter().rev().find(|(known, _)| *known <= tick)?;
        #[expect(clippy::cast_precision_loss, reason = "ticks of some days")]
        let ticks = (tick - known) as f64;
        Some(t_s + ticks * self.tick_s)
    }
}

#[derive(Debug)]
pub(crate) struct Summary {
    pub(crate) format: Format,
    pub(crate) metadata: Metadata,
    pub(crate) rows: u64,
    /// The first and the last tick, and their times, s.
    pub(crate) ticks: Option<[u64; 2]>,
    times_s: Option<[f64; 2]>,
    tick_times: TickTimes,
    /// Rows with force, and the largest force, N.
    pub(crate) with_force: u64,
    pub(crate) peak_force_n: f64,
    /// Rows that are missing.
    pub(crate) lost: u64,
    /// Places where some are missing.
    pub(crate) gaps: u64,
    /// Changes of state, scene or settings, and markers, that are missing.
    pub(crate) lost_changes: u64,
    pub(crate) disorder: Disorder,
    /// Periods that the loop missed.
    pub(crate) missed: u64,
    /// Scenes, states, markers and link events, in their order.
    pub(crate) events: Vec<Event>,
    pub(crate) ending: Ending,
    pub(crate) bytes: u64,
}

#[derive(Debug, Serialize)]
pub(crate) struct Event {
    /// Time from the first row, s; of an event before that, zero.
    pub(crate) t_s: f64,
    pub(crate) tick: u64,
    #[serde(flatten)]
    pub(crate) what: EventKind,
}

#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(crate) enum EventKind {
    Scene {
        name: String,
        law: String,
        revision: u64,
    },
    State {
        state: RigState,
        #[serde(skip_serializing_if = "Option::is_none")]
        fault: Option<String>,
    },
    Servo {
        servo: Box<ServoSetup>,
    },
    Marker {
        text: String,
    },
    Link {
        text: String,
    },
}

impl Summary {
    pub(crate) fn read(path: &Path) -> Result<Self, RecordingError> {
        let mut reader = haptic_recording::open_any(path)?;
        let mut summary = Self {
            format: reader.format(),
            metadata: reader.metadata().clone(),
            rows: 0,
            ticks: None,
            times_s: None,
            tick_times: TickTimes {
                tick_s: reader.metadata().loop_rate_hz.recip(),
                known: Vec::new(),
            },
            with_force: 0,
            peak_force_n: 0.0,
            lost: 0,
            gaps: 0,
            lost_changes: 0,
            disorder: Disorder::default(),
            missed: 0,
            events: Vec::new(),
            ending: Ending::Open,
            bytes: path.metadata().map_or(0, |metadata| metadata.len()),
        };
        let mut timed = 0;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at least 1; saturates"
        )]
        let every = (summary.metadata.loop_rate_hz / summary.metadata.rate_hz)
            .round()
            .max(1.0) as u64;
        let mut lost_before = 0;
        while let Some(entry) = reader.next().transpose()? {
            match entry {
                Entry::Row(row, y) => {
                    summary.rows += 1;
                    // The length of the force, whatever its direction.
                    let force_n = row.command_force_n.hypot(y.map_or(0.0, |y| y.command_force_n));
                    summary.with_force += u64::from(force_n != 0.0);
                    summary.peak_force_n = summary.peak_force_n.max(force_n);
                    let lost = summary.lost - std::mem::replace(&mut lost_before, summary.lost);
                    if let Some([_, before]) = summary.ticks {
                        summary.disorder.take(before, row.tick, every, lost);
                    }
                    let [first, _] = summary.times_s.unwrap_or([row.t_s; 2]);
                    let [first_tick, _] = summary.ticks.unwrap_or([row.tick; 2]);
                    summary.times_s = Some([first, row.t_s]);
                    summary.ticks = Some([first_tick, row.tick]);
                    summary.tick_times.take(row.tick, row.t_s);
                    summary.time_events(&mut timed);
                }
                Entry::Mark(mark) => summary.mark(mark),
            }
        }
        summary.time_events(&mut timed);
        summary.ending = reader.ending().unwrap_or(Ending::Open);
        Ok(summary)
    }

    /// Time from the first row to the last, s.
    pub(crate) fn length_s(&self) -> f64 {
        self.times_s.map_or(0.0, |[first, last]| last - first)
    }

    /// A mark stands before the first row that it concerns, but a note behind: its moment was before its text.
    fn time_events(&mut self, timed: &mut usize) {
        let now_s = self.length_s();
        let [first_s, _] = self.times_s.unwrap_or_default();
        let newest = self.ticks.map_or(0, |[_, newest]| newest);
        for event in &mut self.events[*timed..] {
            let is_past = event.tick < newest && matches!(event.what, EventKind::Marker { .. });
            event.t_s = if is_past {
                let t_s = self.tick_times.of(event.tick).unwrap_or(first_s);
                (t_s - first_s).clamp(0.0, now_s)
            } else {
                now_s
            };
        }
        *timed = self.events.len();
    }

    fn mark(&mut self, mark: Mark) {
        let (tick, what) = match mark {
            Mark::Scene {
                tick,
                revision,
                name,
                law,
                ..
            } => (tick, EventKind::Scene { name, law, revision }),
            Mark::State { tick, state, fault } => (tick, EventKind::State { state, fault }),
            Mark::Servo { tick, servo } => (tick, EventKind::Servo { servo }),
            Mark::Marker { tick, text } => (tick, EventKind::Marker { text }),
            Mark::Link { tick, text } => (tick, EventKind::Link { text }),
            Mark::Lost { rows } => {
                self.lost = self.lost.saturating_add(rows);
                self.gaps += 1;
                return;
            }
            Mark::LostChanges { changes } => {
                self.lost_changes = self.lost_changes.saturating_add(changes);
                return;
            }
            Mark::Missed { periods, .. } => {
                self.missed = self.missed.saturating_add(periods);
                return;
            }
            // What follows from it is an event of its own.
            Mark::Journal { .. } | Mark::Snapshot { .. } | Mark::End { .. } => return,
        };
        self.events.push(Event { t_s: 0.0, tick, what });
    }
}

/// Whether a state of the rig is one that something has brought about, after another. A reset leads from a stop or a
/// fault to a rig that was disconnected before.
pub(crate) fn is_upset(before: RigState, state: RigState) -> bool {
    let is_reset = matches!(before, RigState::Stopped | RigState::Faulted) && state == RigState::Disconnected;
    before != state && !is_reset
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::Scene;
    use haptic_ipc::Sample;

    /// A note is written when its text is entered: here at the end, after a stall of the loop.
    #[test]
    fn a_note_has_the_time_of_its_tick() {
        let path = std::env::temp_dir().join(format!("haptic-ctl-note-{}.csv", std::process::id()));
        let metadata = Metadata {
            server: "hapticd test".into(),
            device: "fake rig".into(),
            axes: 1,
            loop_rate_hz: 1000.0,
            rate_hz: 1000.0,
            recorded_by: None,
            started_unix_s: 0.0,
            revision: 1,
            scene: Scene::paper(),
            servo: None,
            notes: None,
            configuration: None,
        };
        let rows: Vec<_> = (500..1500u32)
            .map(|tick| Sample {
                tick: tick.into(),
                t_s: f64::from(tick) * 1e-3 + if tick < 900 { 0.0 } else { 3.0 },
                ..Sample::default()
            })
            .collect();
        let mut writer = haptic_recording::create(&path, &metadata, true).expect("a file");
        writer.rows(&rows, &[]).expect("written");
        for tick in [100, 700, 1000] {
            writer.mark(Mark::Marker {
                tick,
                text: "a note".into(),
            });
        }
        writer.finish().expect("whole");
        let summary = Summary::read(&path).expect("a recording");
        std::fs::remove_file(&path).expect("removed");
        let times = summary.events.iter().map(|event| format!("{:.3}", event.t_s));
        assert_eq!(times.collect::<Vec<_>>(), ["0.000", "0.200", "3.500"]);
    }
}
