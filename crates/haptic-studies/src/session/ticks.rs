//! The ticks of a trial under way, for its recording.

use haptic_core::Scene;
use haptic_ipc::{Sample, ServoSetup};
use haptic_recording::Mark;

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
