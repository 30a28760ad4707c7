//! What of the user's view is remembered, and how it is taken up again.

use super::Model;
use super::scope::Scope;
use super::scope::plot_list::PlotList;
use super::view::PlotGroup;
use crate::notice::Notice;
use crate::settings::Settings;
use crate::tape::signal::Signal;
use haptic_recording::Format;

impl Model {
    /// Takes up what was remembered. What is unknown here, as the signals of a later panel, is left out.
    pub fn restore(&mut self, settings: &Settings) {
        let view = &mut self.view;
        if let Some(folder) = settings.folder.as_ref().filter(|folder| !folder.is_empty()) {
            view.folder.clone_from(folder);
        }
        let formats = Format::ALL.into_iter();
        let named = |format: &Format| settings.recording_format.as_deref() == Some(format.ending());
        view.recording_format = formats.into_iter().find(named).unwrap_or(view.recording_format);
        let named = |group: &PlotGroup| settings.beside.as_deref() == Some(group.name());
        view.layout.beside = PlotGroup::BESIDE.into_iter().find(named).unwrap_or(view.layout.beside);
        view.layout.shows_limits = settings.shows_limits.unwrap_or(view.layout.shows_limits);
        if let Some(span_s) = settings.span_s.filter(|span_s| span_s.is_finite() && *span_s > 0.0) {
            view.scope.zoom(view.scope.span_s() / span_s, 0.0);
        }
        for (scope, plots) in [
            (&mut view.scope, &settings.rig_plots),
            (&mut view.recorded, &settings.recording_plots),
        ] {
            if let Some(plots) = plots {
                let known = |names: &Vec<String>| names.iter().filter_map(|name| Signal::named(name)).collect();
                scope.plots = PlotList::of(plots.iter().map(known));
            }
        }
    }

    /// What the panel remembers of the view.
    #[must_use]
    pub fn settings(&self) -> Settings {
        let view = &self.view;
        Settings {
            folder: Some(view.folder.clone()),
            recording_format: Some(view.recording_format.ending().to_owned()),
            beside: Some(view.layout.beside.name().to_owned()),
            shows_limits: Some(view.layout.shows_limits),
            span_s: Some(view.scope.span_s()),
            rig_plots: Some(names(&view.scope)),
            recording_plots: Some(names(&view.recorded)),
            ..Settings::default()
        }
    }

    /// Tells the user of a problem with the settings.
    pub fn tell_of_settings(&mut self, why: String) {
        self.view.file_notice = Some(Notice::new(Err(why)));
    }
}

/// The names of the signals of each plot.
fn names(scope: &Scope) -> Vec<Vec<String>> {
    let plots = scope.plots.plots().iter();
    let names = plots.map(|plot| plot.signals().iter().map(|signal| signal.name().to_owned()).collect());
    names.collect()
}
