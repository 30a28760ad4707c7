//! From events of the topic `state` to marks.

use crate::mark::Mark;
use haptic_ipc::{RigState, ServoEvent, StateEvent};

/// Tells which changes an event of the topic `state` brings.
#[derive(Debug, Default)]
pub struct StateMarks {
    revision: Option<u64>,
    state: Option<RigState>,
}

impl StateMarks {
    /// Of events that come while a revision of the scene is active.
    pub fn after(revision: u64) -> Self {
        Self {
            revision: Some(revision),
            state: None,
        }
    }

    /// The changes since the event before: another scene, another state.
    pub fn of(&mut self, event: &StateEvent) -> impl Iterator<Item = Mark> + use<> {
        let is_new_scene = self.revision.replace(event.revision) != Some(event.revision);
        let scene = is_new_scene.then(|| Mark::Scene {
            tick: event.tick,
            revision: event.revision,
            name: event.scene.clone(),
            law: event.law.clone(),
            params: event.params.clone(),
            arrival: event.arrival.clone(),
        });
        let is_new_state = self.state.replace(event.state) != Some(event.state);
        let state = is_new_state.then(|| Mark::State {
            tick: event.tick,
            state: event.state,
            fault: event.fault.clone(),
        });
        scene.into_iter().chain(state)
    }
}

impl From<ServoEvent> for Mark {
    fn from(event: ServoEvent) -> Self {
        Self::Servo {
            tick: event.tick,
            servo: Box::new(event.servo),
        }
    }
}
