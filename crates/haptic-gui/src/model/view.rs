//! View state: what the user looks at, types and was told.

use super::fitting::Fitting;
use super::recordings::Recordings;
use super::scope::Scope;
use super::tapes::Tapes;
use super::tuning::Tuning;
use crate::notice::Notice;
use crate::page::Page;
use egui::Rect;
use haptic_lab::recording::Format;

/// The user's side of the panel.
#[derive(Debug)]
pub(crate) struct View {
    pub(crate) page: Page,
    /// The view of the live rig.
    pub(crate) scope: Scope,
    /// The view of the opened recording.
    pub(crate) recorded: Scope,
    pub(crate) tuning: Tuning,
    pub(crate) fitting: Fitting,
    pub(crate) layout: PlotLayout,
    /// Outcome of the last export, recording, or file to be opened.
    pub(crate) file_notice: Option<Notice>,
    pub(crate) closing: Closing,
    /// Whether the histograms are shown.
    pub(crate) histograms_shown: bool,
    /// The folder for exports and recordings, as it is typed.
    pub(crate) folder: String,
    /// The recordings of that folder.
    pub(crate) recordings: Recordings,
    /// The format of the next recording.
    pub(crate) recording_format: Format,
    /// Notes for the next recording, as they are typed.
    pub(crate) recording_notes: String,
    /// Text of the next marker, as it is typed.
    pub(crate) marker_text: String,
    /// The recording to open, as it is typed.
    pub(crate) open_path: String,
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
    /// Force against velocity.
    ForceVelocity,
}

/// Which plots are drawn, and where.
#[derive(Debug)]
pub(crate) struct PlotLayout {
    /// The group that the user has chosen for a window without room for both.
    pub(crate) chosen: PlotGroup,
    /// The groups that were drawn.
    pub(crate) drawn: &'static [PlotGroup],
    /// Where they were drawn, points.
    pub(crate) area: Rect,
}

impl Default for View {
    fn default() -> Self {
        Self {
            page: Page::default(),
            scope: Scope::default(),
            recorded: Scope::of_recording(),
            tuning: Tuning::default(),
            fitting: Fitting::default(),
            layout: PlotLayout {
                chosen: PlotGroup::default(),
                drawn: &[PlotGroup::OverTime],
                area: Rect::NOTHING,
            },
            file_notice: None,
            closing: Closing::default(),
            histograms_shown: false,
            folder: std::env::var("HOME").unwrap_or_default(),
            recordings: Recordings::default(),
            recording_format: Format::Mcap,
            recording_notes: String::new(),
            marker_text: String::new(),
            open_path: String::new(),
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
        if self.shows_recording(tapes) {
            &mut self.recorded
        } else {
            &mut self.scope
        }
    }

    fn shows_recording(&self, tapes: &Tapes) -> bool {
        self.page == Page::Record && tapes.opened().is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Loaded;
    use crate::recording::fixture::metadata;
    use crate::tape::tests::at;
    use haptic_lab::recording::Ending;

    #[test]
    fn a_recording_is_seen_on_its_page_alone_and_moves_nothing_of_the_rigs_view() {
        let (mut view, mut tapes) = (View::default(), Tapes::default());
        let live: Vec<_> = (0..=20).map(|second| at(f64::from(second))).collect();
        tapes.extend(&live);
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
