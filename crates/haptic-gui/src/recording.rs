//! Recordings: one that is being made of what the panel hears, and one that is looked at.

use crate::export::first_free;
use haptic_core::Scene;
use haptic_ipc::{Changes, Event, params_of};
use haptic_lab::recording::{Ending, Mark, Metadata, Recorder, Recording, Totals};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// What becomes of the recording that is being made.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordingNews {
    /// It goes on.
    Going {
        /// Its file.
        path: PathBuf,
        /// How much it holds.
        totals: Totals,
    },
    /// It was ended.
    Ended {
        /// Its file.
        path: PathBuf,
        /// How much it holds.
        totals: Totals,
    },
    /// It could not be begun, or not be written to the end.
    Failed {
        /// Why, naming the file.
        why: String,
    },
}

/// A recording that is being made.
#[derive(Debug)]
pub(crate) struct Taking {
    path: PathBuf,
    recorder: Recorder<File>,
}

impl Taking {
    /// Begins one in a new file in `folder`.
    pub(crate) fn begin(folder: &Path, mut metadata: Metadata) -> Result<Self, RecordingNews> {
        let failed = |why| RecordingNews::Failed { why };
        let (path, file) = first_free(folder, "haptic-recording", "csv").map_err(failed)?;
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH);
        metadata.started_unix_s = since_1970.map_or(0.0, |time| time.as_secs_f64());
        let recorder = Recorder::new(file, &metadata);
        let recorder = recorder.map_err(|error| lost(&path, &error))?;
        Ok(Self { path, recorder })
    }

    /// Writes what was heard.
    pub(crate) fn hear(&mut self, event: &Event) -> Result<(), RecordingNews> {
        self.recorder.event(event).map_err(|error| lost(&self.path, &error))
    }

    pub(crate) fn news(&self) -> RecordingNews {
        RecordingNews::Going {
            path: self.path.clone(),
            totals: self.recorder.totals(),
        }
    }

    /// Writes the end of it.
    pub(crate) fn end(self) -> RecordingNews {
        let path = self.path;
        match self.recorder.finish() {
            Ok((_, totals)) => RecordingNews::Ended { path, totals },
            Err(error) => lost(&path, &error),
        }
    }
}

fn lost(path: &Path, error: &io::Error) -> RecordingNews {
    RecordingNews::Failed {
        why: format!("the recording ends here: cannot write {}: {error}", path.display()),
    }
}

/// How much a recording holds, for people.
pub(crate) fn amount(totals: &Totals) -> String {
    #[expect(clippy::cast_precision_loss, reason = "one decimal is shown")]
    let megabytes = totals.bytes as f64 / 1e6;
    let mut text = format!("{:.1} s, {megabytes:.1} MB", totals.length_s);
    if totals.lost > 0 {
        text += &format!(", {} samples missing", totals.lost);
    }
    text
}

/// A recording that is looked at, without its samples.
#[derive(Debug)]
pub(crate) struct Opened {
    pub(crate) path: PathBuf,
    pub(crate) metadata: Metadata,
    pub(crate) ending: Ending,
    /// Rows that are missing from it.
    pub(crate) lost: u64,
    /// The scenes, each from the tick that first rendered it; nothing where the marks do not tell it.
    scenes: Vec<(u64, Option<Scene>)>,
}

impl Opened {
    pub(crate) fn new(path: PathBuf, recording: &Recording) -> Self {
        let first = &recording.metadata.scene;
        let mut scenes = vec![(0, Some(first.clone()))];
        let mut lost = 0;
        for (_, mark) in &recording.marks {
            match mark {
                Mark::Scene { tick, .. } => scenes.push((*tick, scene_of(first, mark))),
                Mark::Lost { rows } => lost += rows,
                Mark::State { .. } | Mark::End { .. } => {}
            }
        }
        Self {
            path,
            metadata: recording.metadata.clone(),
            ending: recording.ending,
            lost,
            scenes,
        }
    }

    /// The scene that a tick rendered.
    pub(crate) fn scene_at(&self, tick: u64) -> Option<&Scene> {
        let from = self.scenes.partition_point(|(first, _)| *first <= tick);
        self.scenes.get(from.checked_sub(1)?)?.1.as_ref()
    }
}

/// The scene of a mark, which has its law and its parameters. Nothing where the block came or went, which they do not tell.
fn scene_of(first: &Scene, mark: &Mark) -> Option<Scene> {
    let Mark::Scene { name, law, params, .. } = mark else {
        return None;
    };
    let changes = Changes(params.iter().map(|(name, value)| (name.clone(), *value)).collect());
    let scene = first.with_law(law)?.ok()?.with(&changes.resolve().ok()?).ok()?;
    (params_of(&scene) == *params).then(|| Scene {
        name: name.clone(),
        ..scene
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::{Directional, Parameter};

    fn metadata() -> Metadata {
        Metadata {
            server: "hapticd test".into(),
            device: "fake rig".into(),
            loop_rate_hz: 1000.0,
            rate_hz: 1000.0,
            started_unix_s: 0.0,
            revision: 1,
            scene: Scene::paper(),
        }
    }

    fn mark(tick: u64, scene: &Scene) -> (usize, Mark) {
        let mark = Mark::Scene {
            tick,
            revision: 2,
            name: scene.name.clone(),
            law: scene.friction.law().into(),
            params: params_of(scene),
        };
        (0, mark)
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
        let recording = Recording {
            metadata: metadata(),
            rows: vec![],
            marks: vec![mark(100, &dahl), mark(200, &on_device), (0, Mark::Lost { rows: 3 })],
            ending: Ending::Open,
        };
        let opened = Opened::new("r.csv".into(), &recording);
        assert_eq!(opened.scene_at(99), Some(&Scene::paper()));
        let found = opened.scene_at(100).expect("a scene");
        assert_eq!(found.value(Parameter::DynamicForce), Some(Directional::both(7.0)));
        assert_eq!(
            opened.scene_at(500),
            None,
            "the block is gone, which the parameters do not tell"
        );
        assert_eq!(opened.lost, 3);
    }

    #[test]
    fn what_is_heard_is_read_again() {
        use crate::scope::tape::tests::at;
        use haptic_ipc::SamplesEvent;
        let folder = tempfile::tempdir().expect("a folder");
        let mut taking = Taking::begin(folder.path(), metadata()).expect("begun");
        let rows: Vec<_> = (0..50).map(|i| at(f64::from(i) * 1e-3)).collect();
        let batch = SamplesEvent {
            seq: 0,
            dropped: 0,
            rows: rows.clone(),
        };
        taking.hear(&Event::Samples(batch)).expect("written");
        let RecordingNews::Ended { path, totals } = taking.end() else {
            panic!("not ended");
        };
        let read = haptic_lab::recording::read(&path).expect("a recording");
        assert_eq!((read.rows, read.ending, totals.rows), (rows, Ending::Complete, 50));
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let begun = Taking::begin(Path::new("/nowhere/at/all"), metadata());
        let Err(RecordingNews::Failed { why }) = begun else {
            panic!("{begun:?}");
        };
        assert!(why.contains("/nowhere/at/all"), "{why}");
    }
}
