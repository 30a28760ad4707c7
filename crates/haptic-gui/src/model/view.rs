//! View state: what the user looks at, types and was told.

use super::scope::Scope;
use super::tuning::Tuning;
use crate::notice::Notice;
use egui::Rect;
use haptic_lab::recording::Format;

/// The user's side of the panel.
#[derive(Debug)]
pub(crate) struct View {
    pub(crate) scope: Scope,
    pub(crate) tuning: Tuning,
    pub(crate) layout: PlotLayout,
    /// Outcome of the last export, recording, or file to be opened.
    pub(crate) file_notice: Option<Notice>,
    /// Whether the histograms are shown; `None` until the user has chosen.
    pub(crate) histograms_shown: Option<bool>,
    /// The folder for exports and recordings, as it is typed.
    pub(crate) export_folder: String,
    /// The format of the next recording.
    pub(crate) recording_format: Format,
    /// Notes for the next recording, as they are typed.
    pub(crate) recording_notes: String,
    /// Text of the next marker, as it is typed.
    pub(crate) marker_text: String,
    /// The recording to open, as it is typed.
    pub(crate) open_path: String,
    /// The field of `open_path` takes the keyboard in the next frame.
    pub(crate) open_was_pressed: bool,
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
            scope: Scope::default(),
            tuning: Tuning::default(),
            layout: PlotLayout {
                chosen: PlotGroup::default(),
                drawn: &[PlotGroup::OverTime],
                area: Rect::NOTHING,
            },
            file_notice: None,
            histograms_shown: None,
            export_folder: std::env::var("HOME").unwrap_or_default(),
            recording_format: Format::Mcap,
            recording_notes: String::new(),
            marker_text: String::new(),
            open_path: String::new(),
            open_was_pressed: false,
        }
    }
}
