//! The tapes: samples of the live rig, an opened recording, and the progress of the recording that is
//! being written.

use crate::intent::Intent;
use crate::record::{Loaded, Opened, RecordingNews, WhatIfTape, amount};
use crate::tape::Tape;
use crate::tape::mark::{MarkKind, TapeMark};
use crate::tape::plane::Component;
use haptic_core::scene::SceneFile;
use haptic_ipc::{JournalEntry, Sample, SamplesEvent};
use haptic_recording::Totals;
use std::path::{Path, PathBuf};

/// Length of the past over which the share of time at the force limit is computed, s.
pub(crate) const CLIPPING_OVER_S: f64 = 10.0;

/// A force above this share of the limit counts as clipped by it.
pub(crate) const AT_THE_LIMIT: f64 = 0.999;

/// Every sample that the panel holds.
#[derive(Debug, Default)]
pub(crate) struct Tapes {
    live: Tape,
    /// The connection is lost: the live tape ends here, and stays in sight until the next one begins.
    is_over: bool,
    /// What happened to the next daemon before its first samples.
    next_marks: Vec<TapeMark>,
    opened: Option<Loaded>,
    /// What would have been felt along the opened recording.
    pub(crate) what_if: WhatIf,
    /// Number of the newest question of what would have been felt.
    questions: u64,
    /// The rendering of a scene that the daemon has given.
    due: Option<Intent>,
    /// The recording that is being written.
    recording: Option<RecordingProgress>,
    /// Share of the last seconds in which the force was clipped by its limit.
    pub(crate) clipping: Option<f64>,
}

/// The recording that is being written.
#[derive(Debug, Default)]
pub(crate) struct RecordingProgress {
    pub(crate) path: PathBuf,
    /// What the file holds.
    pub(crate) totals: Totals,
    /// Samples that are missing because the disk did not keep up.
    pub(crate) lost: u64,
    /// Changes and markers that are missing for the same reason.
    pub(crate) lost_changes: u64,
    /// Number of markers that were set.
    pub(crate) markers: usize,
}

/// What would have been felt along the opened recording.
#[derive(Debug, Default)]
pub(crate) enum WhatIf {
    /// Nobody has asked.
    #[default]
    None,
    /// The daemon is asked for the scene.
    Fetching,
    /// It is being rendered.
    Asked,
    Shown(Box<WhatIfTape>),
}

impl Tapes {
    /// Adds a batch of the live rig. After a lost connection a new tape begins, and the one before is returned.
    pub(crate) fn extend(&mut self, batch: &SamplesEvent) -> Option<Tape> {
        let is_empty = batch.rows.is_empty();
        let ended = (self.is_over && !is_empty).then(|| std::mem::take(&mut self.live));
        self.is_over &= ended.is_none();
        if !is_empty {
            for mark in self.next_marks.drain(..) {
                self.live.mark(mark);
            }
        }
        self.live.extend_ticks(batch.ticks().map(|(row, y)| (*row, y.copied())));
        ended
    }

    /// Adds what the journal says of the live rig, if a tick carried it out.
    pub(crate) fn mark_journal(&mut self, entry: &JournalEntry) {
        let Some(mark) = TapeMark::of_journal(entry) else {
            return;
        };
        if self.is_over {
            self.next_marks.push(mark);
        } else {
            self.live.mark(mark);
        }
    }

    pub(crate) fn end_live(&mut self) {
        self.is_over = true;
        self.next_marks.clear();
        self.clipping = None;
        if let WhatIf::Fetching = self.what_if {
            self.end_what_if();
        }
    }

    pub(crate) fn live(&self) -> &Tape {
        &self.live
    }

    /// The newest sample of the live rig, while it is connected.
    pub(crate) fn newest(&self) -> Option<&Sample> {
        self.live.last().filter(|_| !self.is_over)
    }

    /// The newest sample of the live rig, connected or not.
    pub(crate) fn last(&self) -> Option<&Sample> {
        self.live.last()
    }

    /// Whether the live tape continues.
    pub(crate) fn is_live(&self) -> bool {
        !self.is_over
    }

    pub(crate) fn open(&mut self, loaded: Loaded) {
        self.end_what_if();
        free(self.opened.replace(loaded));
    }

    pub(crate) fn close(&mut self) {
        self.end_what_if();
        free(self.opened.take());
    }

    /// Asks what would have been felt. Returns the number of the question.
    pub(crate) fn ask_what_if(&mut self) -> u64 {
        self.end_what_if();
        self.what_if = WhatIf::Asked;
        self.questions
    }

    /// The same, with a scene for which the daemon is asked.
    pub(crate) fn fetch_what_if(&mut self) -> u64 {
        let number = self.ask_what_if();
        self.what_if = WhatIf::Fetching;
        number
    }

    /// Takes the daemon's answer: the scene is due to be rendered along a recording's file, unless the question is
    /// an older one. Returns why not, where it was refused.
    pub(crate) fn take_scene(&mut self, number: u64, path: &Path, result: Result<SceneFile, String>) -> Option<String> {
        if number != self.questions || !matches!(self.what_if, WhatIf::Fetching) {
            return None;
        }
        match result {
            Ok(scene) => {
                self.what_if = WhatIf::Asked;
                self.due = Some(Intent::WhatIf {
                    number,
                    path: path.to_owned(),
                    scene: Some(Box::new(scene)),
                });
                None
            }
            Err(why) => {
                self.what_if = WhatIf::None;
                Some(why)
            }
        }
    }

    pub(crate) fn due(&mut self) -> Option<Intent> {
        self.due.take()
    }

    /// Takes the answer to the newest question. Returns what to show the user if there is none.
    pub(crate) fn take_what_if(&mut self, number: u64, result: Result<Box<WhatIfTape>, String>) -> Option<String> {
        if number != self.questions || !matches!(self.what_if, WhatIf::Asked) {
            free(Some(result));
            return None;
        }
        match result {
            Ok(tape) => self.what_if = WhatIf::Shown(tape),
            Err(why) => {
                self.what_if = WhatIf::None;
                return Some(why);
            }
        }
        None
    }

    /// Shows the recording alone, and expects no answer any more.
    pub(crate) fn end_what_if(&mut self) {
        self.questions += 1;
        self.due = None;
        free(Some(std::mem::take(&mut self.what_if)));
    }

    /// Sets a marker in the recording that is being written. Returns its tick.
    pub(crate) fn set_marker(&mut self, text: &str) -> Option<u64> {
        let tick = self.newest()?.tick;
        self.recording.is_some().then(|| {
            self.note(tick, text);
            tick
        })
    }

    /// Marks a moment of the live rig. Returns whether it is in the recording that is being written.
    pub(crate) fn note(&mut self, tick: u64, text: &str) -> bool {
        self.live.mark(TapeMark {
            tick,
            kind: MarkKind::Marker,
            by: None,
            text: text.to_owned(),
        });
        if let Some(recording) = &mut self.recording {
            recording.markers += 1;
        }
        self.recording.is_some()
    }

    pub(crate) fn opened_tape(&self) -> Option<&Tape> {
        self.opened.as_ref().map(|loaded| &loaded.tape)
    }

    /// What the opened recording says of itself.
    pub(crate) fn opened(&self) -> Option<&Opened> {
        self.opened.as_ref().map(|loaded| &loaded.opened)
    }

    /// The recording that is being written.
    pub(crate) fn recording(&self) -> Option<&RecordingProgress> {
        self.recording.as_ref()
    }

    /// Takes news of the recording that is being written. Returns what to show the user at its end.
    pub(crate) fn take_recording(&mut self, news: RecordingNews) -> Option<Result<String, String>> {
        let outcome = match news {
            RecordingNews::Going { path, totals } => {
                let recording = self.recording.get_or_insert_default();
                (recording.path, recording.totals) = (path, totals);
                return None;
            }
            RecordingNews::Behind {
                path,
                lost,
                lost_changes,
            } => {
                let recording = self.recording.get_or_insert_with(|| RecordingProgress {
                    path,
                    ..RecordingProgress::default()
                });
                (recording.lost, recording.lost_changes) = (lost, lost_changes);
                return None;
            }
            RecordingNews::Ended { path, totals } => Ok(format!("Recorded {}: {}", path.display(), amount(&totals))),
            RecordingNews::Failed { why } => Err(why),
        };
        self.recording = None;
        Some(outcome)
    }

    /// Computes the share of clipped time again, with the limit of the force, N.
    pub(crate) fn update_clipping(&mut self, limit_n: f64) {
        self.clipping = self.newest().and_then(|newest| self.clipped_share(newest.t_s, limit_n));
    }

    fn clipped_share(&self, newest_s: f64, limit_n: f64) -> Option<f64> {
        let (mut with_force, mut clipped) = (0.0, 0.0);
        // The force that is limited is the whole one.
        let force = self.live.component(Component::Length).unwrap_or(&self.live);
        for sample in force.within(newest_s - CLIPPING_OVER_S, newest_s) {
            if sample.state.is_live() {
                with_force += 1.0;
                clipped += f64::from(u8::from(sample.command_force_n.abs() >= AT_THE_LIMIT * limit_n));
            }
        }
        (with_force > 0.0).then(|| clipped / with_force)
    }
}

/// Frees a recording on a thread of its own: hundreds of megabytes take longer than a frame may.
fn free<T: Send + 'static>(loaded: Option<T>) {
    if let Some(loaded) = loaded {
        // Without a thread it is freed here.
        drop(
            std::thread::Builder::new()
                .name("free".to_owned())
                .spawn(move || drop(loaded)),
        );
    }
}
