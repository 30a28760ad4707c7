//! A recording that is opened.

use crate::tape::Tape;
use crate::tape::mark::{MarkKind, TapeMark};
use haptic_core::{Directional, Scene};
use haptic_ipc::{Changes, Difference, Sample, Value, params_of};
use haptic_recording::{Ending, Entry, Mark, Metadata, RecordingError};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Rows after which the progress is reported: a minute at 1 kHz, or tens of milliseconds of reading.
const ROWS_A_LOOK: usize = 60_000;

/// A recording that is ready to be shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    pub(crate) tape: Tape,
    pub(crate) opened: Opened,
}

impl Loaded {
    /// Takes rows that are in memory.
    #[must_use]
    pub fn new(
        path: PathBuf,
        metadata: Metadata,
        rows: impl IntoIterator<Item = Sample>,
        marks: &[Mark],
        ending: Ending,
    ) -> Self {
        let mut tape = Tape::recorded(rows);
        add_marks(&mut tape, &metadata.scene, marks);
        Self {
            opened: Opened::new(path, metadata, marks, ending),
            tape,
        }
    }

    /// Reads a recording. An hour at 1 kHz takes seconds and 470 MB of memory. Meanwhile `progress` gets the share
    /// that is read, from 0 to 1, where that is known.
    ///
    /// # Errors
    /// Why it cannot be read, with the name of the file.
    pub fn read(path: &Path, mut progress: impl FnMut(Option<f64>)) -> Result<Self, String> {
        let mut read = || {
            let mut reader = haptic_recording::open_any(path)?;
            let (mut tape, mut marks) = (Tape::default(), Vec::new());
            while let Some(entry) = reader.next().transpose()? {
                match entry {
                    Entry::Row(row, y) => {
                        tape.push_tick(row, y.as_ref());
                        if tape.len().is_multiple_of(ROWS_A_LOOK) {
                            progress(reader.share());
                        }
                    }
                    Entry::Mark(mark) => marks.push(mark),
                }
            }
            let ending = reader.ending().unwrap_or(Ending::Open);
            let opened = Opened::new(path.to_path_buf(), reader.metadata().clone(), &marks, ending);
            add_marks(&mut tape, &opened.metadata.scene, &marks);
            Ok(Self { tape, opened })
        };
        read().map_err(|error| match error {
            // Its text has the name of the file.
            RecordingError::Open { .. } => format!("cannot open {error}"),
            error => format!("cannot open {}: {error}", path.display()),
        })
    }
}

/// What a recording says of itself, without its samples.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Opened {
    pub(crate) path: PathBuf,
    pub(crate) metadata: Metadata,
    pub(crate) ending: Ending,
    /// Rows that are missing.
    pub(crate) lost: u64,
    /// The scenes, each from the first tick that rendered it; `None` if the marks do not define it.
    scenes: Vec<(u64, Option<Scene>)>,
}

impl Opened {
    fn new(path: PathBuf, metadata: Metadata, marks: &[Mark], ending: Ending) -> Self {
        let first = &metadata.scene;
        let mut scenes = vec![(0, Some(first.clone()))];
        let mut lost = 0;
        for mark in marks {
            match mark {
                Mark::Scene { tick, .. } => scenes.push((*tick, scene_of(first, mark))),
                Mark::Lost { rows } => lost += rows,
                _ => {}
            }
        }
        Self {
            path,
            metadata,
            ending,
            lost,
            scenes,
        }
    }

    pub(crate) fn scene_at(&self, tick: u64) -> Option<&Scene> {
        let from = self.scenes.partition_point(|(first, _)| *first <= tick);
        self.scenes.get(from.checked_sub(1)?)?.1.as_ref()
    }
}

/// Adds to a recording's tape what its marks say. Where the journal says who changed scene or state, its word stands
/// for the change. A recording does not say where lost rows are missing.
fn add_marks(tape: &mut Tape, first: &Scene, marks: &[Mark]) {
    let mut known = params_of(first);
    let (mut revisions, mut states) = (HashSet::new(), HashMap::new());
    for mark in marks {
        if let Mark::Journal { tick, entry } = mark {
            revisions.extend((!entry.changes.is_empty()).then_some(entry.revision));
            states.extend(entry.state.map(|state| (*tick, state.after)));
            if let Some(mark) = TapeMark::of_journal(entry) {
                tape.mark(mark);
            }
        }
    }
    for mark in marks {
        let (tick, kind, text) = match mark {
            Mark::Marker { tick, text } => (*tick, MarkKind::Marker, text.clone()),
            Mark::Scene {
                tick,
                name,
                law,
                params,
                revision,
                ..
            } => {
                let changes = changes(&known, params);
                known.clone_from(params);
                if revisions.contains(revision) {
                    continue;
                }
                (*tick, MarkKind::Scene, format!("scene {name}, {law}{changes}"))
            }
            Mark::State { tick, state, .. } if states.get(tick) == Some(state) => continue,
            Mark::State { tick, state, fault } => match fault {
                Some(why) => (*tick, MarkKind::Trouble, format!("{state}: {why}")),
                None => (*tick, MarkKind::State, state.to_string()),
            },
            Mark::Servo { tick, .. } => (*tick, MarkKind::Scene, "other settings of the servo".to_owned()),
            Mark::Missed { tick, periods } => {
                let plural = if *periods == 1 { "" } else { "s" };
                (*tick, MarkKind::Trouble, format!("{periods} period{plural} missed"))
            }
            Mark::Link { tick, text } => (*tick, MarkKind::Trouble, text.clone()),
            Mark::Journal { .. }
            | Mark::Snapshot { .. }
            | Mark::Lost { .. }
            | Mark::LostChanges { .. }
            | Mark::End { .. } => continue,
        };
        tape.mark(TapeMark {
            tick,
            kind,
            by: None,
            text,
        });
    }
}

/// The values that differ from those before.
fn changes(before: &BTreeMap<String, Directional>, after: &BTreeMap<String, Directional>) -> String {
    let changes = after.iter().filter_map(|(param, value)| {
        let other = before.get(param).filter(|other| *other != value)?;
        let change = Difference {
            param: param.clone(),
            unit: None,
            before: Some(Value::Number(*other)),
            after: Some(Value::Number(*value)),
        };
        Some(format!(", {change}"))
    });
    changes.collect()
}

/// The scene of a mark, which has a law and parameters. `None` if the block came or went: a mark does
/// not say so.
fn scene_of(first: &Scene, mark: &Mark) -> Option<Scene> {
    let Mark::Scene { name, law, params, .. } = mark else {
        return None;
    };
    let changes: Changes = params.iter().map(|(name, value)| (name.clone(), *value)).collect();
    let scene = first.with_law(law)?.ok()?;
    let scene = scene.with(&changes.resolve(&scene).ok()?).ok()?;
    (params_of(&scene) == *params).then(|| Scene {
        name: name.clone(),
        ..scene
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::fixture::metadata;
    use haptic_core::Parameter;
    use haptic_ipc::{JournalEntry, Peer, RigState, StateChange};

    fn mark(tick: u64, scene: &Scene) -> Mark {
        Mark::Scene {
            tick,
            revision: 2,
            name: scene.name.clone(),
            law: scene.friction.law().into(),
            params: params_of(scene),
            arrival: None,
        }
    }

    #[test]
    fn each_tick_has_its_scene() {
        let mut dahl = Scene::paper().with_law("dahl").expect("a law").expect("a scene");
        dahl = dahl.with(&[(Parameter::DynamicForce.into(), 7.0)]).expect("a scene");
        let on_device = Scene {
            block: None,
            coupling: None,
            ..dahl.clone()
        };
        let marks = [mark(100, &dahl), mark(200, &on_device), Mark::Lost { rows: 3 }];
        let Loaded { opened, .. } = Loaded::new("r.csv".into(), metadata(), [], &marks, Ending::Open);
        assert_eq!(opened.scene_at(99), Some(&Scene::paper()));
        let found = opened.scene_at(100).expect("a scene");
        assert_eq!(found.value(Parameter::DynamicForce), Some(Directional::both(7.0)));
        assert_eq!(
            opened.scene_at(500),
            None,
            "the block is gone, which the parameters do not show"
        );
        assert_eq!(opened.lost, 3);
    }

    #[test]
    fn marks_name_changes_and_their_author_where_the_journal_knows() {
        let scene = Scene::paper().with(&[(Parameter::DynamicForce.into(), 2.5)]);
        let slippery = scene.expect("a scene");
        let state = |tick, state, fault: Option<&str>| Mark::State {
            tick,
            state,
            fault: fault.map(str::to_owned),
        };
        let alone = [
            mark(2, &slippery),
            state(4, RigState::Engaged, None),
            Mark::Missed { tick: 5, periods: 3 },
            state(6, RigState::Faulted, Some("the device fell silent")),
        ];
        let by_ada = |tick, op: &str| JournalEntry {
            tick: Some(tick),
            revision: 2,
            by: Some(Peer {
                user: Some("ada".into()),
                program: Some("hapticd".into()),
                pid: Some(7),
                ..Peer::default()
            }),
            ..JournalEntry::of(op)
        };
        let set = JournalEntry {
            changes: haptic_ipc::differences(&Scene::paper(), &slippery),
            ..by_ada(2, "set")
        };
        let engage = JournalEntry {
            state: Some(StateChange {
                before: RigState::Idle,
                after: RigState::Engaging,
            }),
            ..by_ada(4, "engage")
        };
        let journal = |entry: JournalEntry| Mark::Journal {
            tick: entry.tick.expect("it has one"),
            entry: entry.into(),
        };
        let known = [
            journal(set),
            mark(2, &slippery),
            journal(engage),
            state(4, RigState::Engaging, None),
            state(5, RigState::Engaged, None),
        ];
        let expected_alone: &[_] = &[
            (2.0, "scene simulated friction, karnopp, dynamic_force: 3.5 -> 2.5"),
            (4.0, "engaged"),
            (5.0, "3 periods missed"),
            (6.0, "faulted: the device fell silent"),
        ];
        let expected_known: &[_] = &[
            (2.0, "ada (hapticd, process 7): set, dynamic_force: 3.5 N -> 2.5 N"),
            (4.0, "ada (hapticd, process 7): engage, idle -> engaging"),
            (5.0, "engaged"),
        ];
        for (marks, expected) in [(&alone[..], expected_alone), (&known, expected_known)] {
            let rows = (0..10).map(|tick| Sample {
                tick,
                t_s: tick as f64,
                ..Sample::default()
            });
            let Loaded { tape, .. } = Loaded::new("r.csv".into(), metadata(), rows, marks, Ending::Open);
            let found = tape.marks(f64::NEG_INFINITY, f64::INFINITY);
            let found: Vec<_> = found.map(|(t_s, mark)| (t_s, mark.to_string())).collect();
            let expected = expected.iter().map(|(t_s, text)| (*t_s, (*text).to_owned()));
            assert_eq!(found, expected.collect::<Vec<_>>());
        }
    }
}
