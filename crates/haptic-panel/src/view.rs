//! View state: what the user looks at, types and is shown.

use super::tapes::Tapes;
use crate::identify::fit::Fitting;
use crate::intent::DialogPurpose;
use crate::notice::Notice;
use crate::page::Page;
use crate::plots::measure::results::Measuring;
use crate::plots::reference::Reference;
use crate::plots::scope::Scope;
use crate::record::Recordings;
use crate::study::form::StudyView;
use crate::tape::Tape;
use crate::tune::scene_edits::Tuning;
use egui::Rect;
use haptic_recording::Format;
use std::path::PathBuf;

/// The user's side of the panel.
#[derive(Debug)]
pub(crate) struct View {
    pub(crate) page: Page,
    /// The title of the window, as it was set last.
    pub(crate) title: String,
    /// The view of the live rig.
    pub(crate) scope: Scope,
    /// The view of the opened recording.
    pub(crate) recorded: Scope,
    pub(crate) tuning: Tuning,
    pub(crate) fitting: Fitting,
    pub(crate) study: StudyView,
    pub(crate) hand: HandStrip,
    pub(crate) layout: PlotLayout,
    /// The run under the one that is seen.
    pub(crate) reference: Option<Reference>,
    pub(crate) measuring: Measuring,
    /// The recording that is being read.
    pub(crate) reading: Option<Reading>,
    /// Outcome of the last export, recording, or file to be opened.
    pub(crate) file_notice: Option<Notice>,
    pub(crate) closing: Closing,
    /// A fake rig was started here, and ends with the window.
    pub(crate) has_own_rig: bool,
    pub(crate) histograms_shown: bool,
    pub(crate) help_shown: bool,
    /// The folder for exports and recordings, as it is typed.
    pub(crate) folder: String,
    pub(crate) recordings: Recordings,
    pub(crate) recording_format: Format,
    /// Notes for the next recording, as they are typed.
    pub(crate) recording_notes: String,
    /// Text of the next marker, as it is typed.
    pub(crate) marker_text: String,
    /// The recording to open, as it is typed.
    pub(crate) open_path: String,
    pub(crate) note: Option<NoteField>,
}

/// The hand on a fake rig, as it is moved here.
#[derive(Debug, Default)]
pub(crate) struct HandStrip {
    /// Where it reaches to, m, while it is held.
    pub(crate) target_m: Option<f64>,
    /// Why the daemon does not take it, until it is held anew.
    pub(crate) refusal: Option<String>,
}

/// A recording that is being read.
#[derive(Debug)]
pub(crate) struct Reading {
    pub(crate) path: PathBuf,
    /// The share that is read, from 0 to 1, if it is known.
    pub(crate) share: Option<f64>,
}

/// A note on a moment of the rig.
#[derive(Debug)]
pub(crate) struct NoteField {
    /// The moment; that of Enter where another daemon has come since.
    pub(crate) tick: Option<u64>,
    pub(crate) text: String,
    /// Its key was pressed since it was drawn.
    pub(crate) wants_keyboard: bool,
}

/// Whether the window is about to close.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Closing {
    #[default]
    No,
    /// The user wants to close it while force is on.
    Asked,
    /// It closes as soon as the force is off.
    WhenReleased,
}

/// Plots that are shown together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum PlotGroup {
    /// Force, position and velocity over time.
    #[default]
    OverTime,
    /// One signal against another: at first force against velocity.
    ForceVelocity,
    Statistics,
    Spectrum,
    /// Positions and force of a rig of two axes, on a page of their own.
    Plane,
}

impl PlotGroup {
    pub(crate) const ALL: [Self; 4] = [Self::OverTime, Self::ForceVelocity, Self::Statistics, Self::Spectrum];

    /// Those that stand beside the plots over time.
    pub(crate) const BESIDE: [Self; 3] = [Self::ForceVelocity, Self::Statistics, Self::Spectrum];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::OverTime => "Over time",
            Self::ForceVelocity => "Force against velocity",
            Self::Statistics => "Statistics",
            Self::Spectrum => "Spectrum",
            Self::Plane => "Plane",
        }
    }
}

#[derive(Debug)]
pub(crate) struct PlotLayout {
    /// The group that the user has chosen for a window without room for two.
    pub(crate) chosen: PlotGroup,
    /// The one beside the plots over time in a wide window.
    pub(crate) beside: PlotGroup,
    /// Whether the limits of the force are drawn.
    pub(crate) shows_limits: bool,
    pub(crate) drawn: Vec<PlotGroup>,
    /// Where they were drawn, points.
    pub(crate) area: Rect,
}

impl Default for View {
    fn default() -> Self {
        Self {
            title: String::new(),
            page: Page::default(),
            scope: Scope::default(),
            recorded: Scope::of_recording(),
            tuning: Tuning::default(),
            fitting: Fitting::default(),
            study: StudyView::default(),
            hand: HandStrip::default(),
            layout: PlotLayout {
                chosen: PlotGroup::default(),
                beside: PlotGroup::ForceVelocity,
                shows_limits: true,
                drawn: vec![PlotGroup::OverTime],
                area: Rect::NOTHING,
            },
            reference: None,
            measuring: Measuring::default(),
            reading: None,
            file_notice: None,
            closing: Closing::default(),
            has_own_rig: false,
            histograms_shown: false,
            help_shown: false,
            folder: std::env::var("HOME").unwrap_or_default(),
            recordings: Recordings::default(),
            recording_format: Format::Mcap,
            recording_notes: String::new(),
            marker_text: String::new(),
            open_path: String::new(),
            note: None,
        }
    }
}

impl View {
    /// The view of the plots on the page: of the opened recording where recordings are looked at, else of the rig.
    pub(crate) fn scope(&self, tapes: &Tapes) -> &Scope {
        if self.shows_recording(tapes) {
            &self.recorded
        } else {
            &self.scope
        }
    }

    /// The same, to be changed.
    pub(crate) fn scope_mut(&mut self, tapes: &Tapes) -> &mut Scope {
        self.plotted(tapes).0
    }

    /// The view of the plots on the page, to be changed, and the run under it.
    pub(crate) fn plotted(&mut self, tapes: &Tapes) -> (&mut Scope, &mut Option<Reference>) {
        let is_recording = self.shows_recording(tapes);
        let scope = if is_recording {
            &mut self.recorded
        } else {
            &mut self.scope
        };
        (scope, &mut self.reference)
    }

    /// What is measured: the view of the plots on the page, the run under it, and the results.
    pub(crate) fn measured(&mut self, tapes: &Tapes) -> (&Scope, Option<&Reference>, &mut Measuring) {
        let is_recording = self.shows_recording(tapes);
        let scope = if is_recording { &self.recorded } else { &self.scope };
        (scope, self.reference.as_ref(), &mut self.measuring)
    }

    pub(crate) fn close_dialog(&mut self, outcome: Result<Option<(DialogPurpose, PathBuf)>, String>) {
        match outcome {
            Ok(Some((DialogPurpose::Folder, path))) => self.folder = path.display().to_string(),
            Ok(Some((DialogPurpose::StudyFolder, path))) => self.study.form.folder = path.display().to_string(),
            Ok(Some((DialogPurpose::StudyPlan, path))) => self.study.form.plan = path.display().to_string(),
            Ok(Some((DialogPurpose::FileToIdentify, path))) => self.fitting.choose_file(&path),
            // It is read, or written, already.
            Ok(Some((DialogPurpose::Recording | DialogPurpose::Export(_), _)) | None) => {}
            Err(why) => {
                let text = format!("Type the path: {why}");
                self.file_notice = Some(Notice::new(Err(text)));
            }
        }
    }

    pub(crate) fn show_settings_error(&mut self, why: String) {
        self.file_notice = Some(Notice::new(Err(why)));
    }

    /// Whether the plots on the page are those of an opened recording.
    pub(crate) fn shows_recording(&self, tapes: &Tapes) -> bool {
        match self.page {
            Page::Record => tapes.opened().is_some(),
            // The rig comes first: what is felt now is not hidden by a recording.
            Page::Plane => !tapes.live().is_plane() && tapes.opened_tape().is_some_and(Tape::is_plane),
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Loaded;
    use crate::record::fixture::metadata;
    use crate::tape::tests::{at, batch};
    use haptic_recording::Ending;

    #[test]
    fn opened_recording_leaves_the_rig_view_unchanged() {
        let (mut view, mut tapes) = (View::default(), Tapes::default());
        let live: Vec<_> = (0..=20).map(|second| at(f64::from(second))).collect();
        tapes.extend(&batch(live));
        let rows = (0..100).map(|second| at(f64::from(second)));
        tapes.open(Loaded::new("r.csv".into(), metadata(), rows, &[], Ending::Complete));
        view.recorded.open(tapes.opened_tape().expect("a recording"));
        for (page, from_s, to_s) in [(Page::Tune, 15.0, 20.0), (Page::Record, 0.0, 99.0)] {
            view.page = page;
            let seen = view.scope(&tapes).seen(&tapes);
            assert_eq!((seen.from_s, seen.to_s), (from_s, to_s), "{page:?}");
        }
        view.scope_mut(&tapes).zoom(2.0, 99.0);
        tapes.close();
        let seen = view.scope(&tapes).seen(&tapes);
        assert_eq!((seen.from_s, seen.to_s), (15.0, 20.0), "the rig again, as it was");
    }
}
