//! The faults, stops and disconnections of a recording, for its last line.

use crate::output::count;
use crate::recording::summary::is_upset;
use haptic_ipc::{Event, RigState};
use std::fmt;

/// The states that something brings about, and what each time is called.
const KINDS: [(RigState, &str); 3] = [
    (RigState::Faulted, "fault"),
    (RigState::Stopped, "stop"),
    (RigState::Disconnected, "disconnection"),
];

/// Something that took the force away while the recording ran.
struct Upset {
    tick: u64,
    state: RigState,
    fault: Option<String>,
}

/// Those of a recording.
pub(super) struct Upsets {
    state: RigState,
    loop_rate_hz: f64,
    /// The first and the last tick that are recorded.
    ticks: Option<(u64, u64)>,
    found: Vec<Upset>,
}

impl Upsets {
    /// Of a rig that is in a state already, with a loop of a rate, Hz.
    pub(super) fn new(state: RigState, loop_rate_hz: f64) -> Self {
        Self {
            state,
            loop_rate_hz,
            ticks: None,
            found: Vec::new(),
        }
    }

    /// Takes what is recorded.
    pub(super) fn take(&mut self, event: &Event) {
        match event {
            Event::Samples(samples) => {
                if let (Some(first), Some(last)) = (samples.rows.first(), samples.rows.last()) {
                    let (first, _) = self.ticks.unwrap_or((first.tick, last.tick));
                    self.ticks = Some((first, last.tick));
                }
            }
            Event::State(event) => {
                let before = std::mem::replace(&mut self.state, event.state);
                if is_upset(before, event.state) {
                    self.found.push(Upset {
                        tick: event.tick,
                        state: event.state,
                        fault: event.fault.clone(),
                    });
                }
            }
            _ => {}
        }
    }

    /// Those up to the last row that left the rig in a state.
    fn of(&self, state: RigState) -> Vec<&Upset> {
        let last = self.ticks.map_or(0, |(_, last)| last);
        let found = self.found.iter();
        found
            .filter(|upset| upset.tick <= last && upset.state == state)
            .collect()
    }

    /// How often what happened, under the name of several.
    pub(super) fn counts(&self) -> impl Iterator<Item = (String, usize)> {
        KINDS
            .iter()
            .map(|(state, what)| (format!("{what}s"), self.of(*state).len()))
    }

    /// Time from the first row, s.
    #[expect(clippy::cast_precision_loss, reason = "ticks of a recording")]
    fn at_s(&self, upset: &Upset) -> f64 {
        let first = self.ticks.map_or(0, |(first, _)| first);
        upset.tick.saturating_sub(first) as f64 / self.loop_rate_hz
    }
}

impl fmt::Display for Upsets {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (state, what) in KINDS {
            let upsets = self.of(state);
            let Some(first) = upsets.first() else { continue };
            let which = if upsets.len() > 1 { ", the first" } else { "" };
            let cause = match (state, &first.fault) {
                (RigState::Faulted, None) => ": faulted".to_owned(),
                (RigState::Faulted, Some(cause)) => format!(": {cause}"),
                _ => String::new(),
            };
            write!(
                f,
                ", {}{which} at {:.3} s{cause}",
                count(upsets.len() as u64, what),
                self.at_s(first)
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_ipc::{Sample, SamplesEvent, StateEvent};

    fn rows(ticks: [u64; 2]) -> Event {
        let rows = ticks.map(|tick| Sample {
            tick,
            ..Sample::default()
        });
        Event::Samples(SamplesEvent {
            rows: rows.into(),
            ..SamplesEvent::default()
        })
    }

    fn state(tick: u64, state: RigState, fault: Option<&str>) -> Event {
        Event::State(StateEvent {
            state,
            fault: fault.map(str::to_owned),
            tick,
            ..StateEvent::default()
        })
    }

    #[test]
    fn faults_and_stops_of_a_recording_are_reported() {
        let mut upsets = Upsets::new(RigState::Engaged, 1000.0);
        // Changes overtake the rows on their way.
        upsets.take(&state(2521, RigState::Faulted, Some("stalled")));
        upsets.take(&state(2600, RigState::Faulted, Some("stalled")));
        upsets.take(&rows([1000, 3000]));
        assert_eq!(upsets.to_string(), ", 1 fault at 1.521 s: stalled");
        upsets.take(&state(3100, RigState::Idle, None));
        upsets.take(&state(3200, RigState::Stopped, None));
        upsets.take(&state(3300, RigState::Faulted, Some("late")));
        upsets.take(&state(3350, RigState::Idle, None));
        upsets.take(&state(3400, RigState::Disconnected, None));
        upsets.take(&state(5000, RigState::Stopped, None));
        upsets.take(&rows([3001, 4000]));
        assert_eq!(
            upsets.to_string(),
            ", 2 faults, the first at 1.521 s: stalled, 1 stop at 2.200 s, 1 disconnection at 2.400 s"
        );
    }

    #[test]
    fn what_was_before_a_recording_is_none_of_it() {
        let mut upsets = Upsets::new(RigState::Faulted, 1000.0);
        upsets.take(&state(900, RigState::Faulted, Some("stalled")));
        upsets.take(&rows([1000, 3000]));
        assert_eq!(upsets.to_string(), "");
        // A reset finds the rig as it was.
        upsets.take(&state(2000, RigState::Disconnected, None));
        assert_eq!(upsets.to_string(), "");
    }
}
