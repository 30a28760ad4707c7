//! What of the user's view is remembered, and how it is taken up again.

use crate::model::Model;
use crate::plots::measure::spectrum::Scaling;
use crate::plots::scope::Scope;
use crate::plots::scope::against::{Against, Extent};
use crate::plots::scope::plot_list::PlotList;
use crate::plots::scope::value_axis::Reach;
use crate::settings::{AgainstSettings, Settings};
use crate::tape::signal::Signal;
use crate::view::PlotGroup;
use haptic_recording::Format;

/// Stands among the signals of a plot that shows their lengths on a rig of two axes.
const LENGTHS: &str = "Lengths";

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
        let named = |group: &PlotGroup| settings.narrow.as_deref() == Some(group.name());
        view.layout.chosen = PlotGroup::ALL.into_iter().find(named).unwrap_or(view.layout.chosen);
        view.histograms_shown = settings.shows_histograms.unwrap_or(view.histograms_shown);
        let measuring = &mut view.measuring;
        let signal = settings.spectrum_of.as_deref().and_then(Signal::named);
        measuring.signal = signal.unwrap_or(measuring.signal);
        let named = |scaling: &Scaling| settings.spectrum_scaling.as_deref() == Some(scaling.name());
        measuring.scaling = Scaling::ALL.into_iter().find(named).unwrap_or(measuring.scaling);
        for (scope, plots, axes, against) in [
            (
                &mut view.scope,
                &settings.rig_plots,
                &settings.rig_axes,
                &settings.rig_against,
            ),
            (
                &mut view.recorded,
                &settings.recording_plots,
                &settings.recording_axes,
                &settings.recording_against,
            ),
        ] {
            if let Some(plots) = plots {
                let known = |names: &Vec<String>| names.iter().filter_map(|name| Signal::named(name)).collect();
                scope.plots = PlotList::of(plots.iter().map(known));
                for (plot, names) in scope.plots.plots_mut().iter_mut().zip(plots) {
                    plot.shows_lengths = names.iter().any(|name| name == LENGTHS);
                }
            }
            for (plot, ends) in scope.plots.plots_mut().iter_mut().zip(axes.iter().flatten()) {
                if let [low, high] = ends[..] {
                    plot.axis.hold((low, high));
                }
            }
            if let Some(kept) = against {
                restore_against(&mut scope.against, kept);
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
            narrow: Some(view.layout.chosen.name().to_owned()),
            shows_histograms: Some(view.histograms_shown),
            spectrum_of: Some(view.measuring.signal.name().to_owned()),
            spectrum_scaling: Some(view.measuring.scaling.name().to_owned()),
            rig_plots: Some(names(&view.scope)),
            rig_axes: Some(held_axes(&view.scope)),
            rig_against: Some(against(&view.scope)),
            recording_plots: Some(names(&view.recorded)),
            recording_axes: Some(held_axes(&view.recorded)),
            recording_against: Some(against(&view.recorded)),
            ..Settings::default()
        }
    }
}

/// The names of the signals of each plot, and whether their lengths are shown.
fn names(scope: &Scope) -> Vec<Vec<String>> {
    let plots = scope.plots.plots().iter();
    let names = plots.map(|plot| {
        let signals = plot.signals().iter().map(|signal| signal.name());
        let names = signals.chain(plot.shows_lengths.then_some(LENGTHS));
        names.map(str::to_owned).collect()
    });
    names.collect()
}

/// The ends of the axis of each plot; none where it fits.
fn held_axes(scope: &Scope) -> Vec<Vec<f64>> {
    let ends = |held: Option<Reach>| held.map_or_else(Vec::new, |(low, high)| vec![low, high]);
    scope.plots.plots().iter().map(|plot| ends(plot.axis.held())).collect()
}

fn against(scope: &Scope) -> AgainstSettings {
    let against = &scope.against;
    AgainstSettings {
        up: against.up.name().to_owned(),
        across: against.across.name().to_owned(),
        extent: against.extent.name().to_owned(),
        zooms_to_stick_band: against.zooms_to_stick_band,
    }
}

fn restore_against(against: &mut Against, kept: &AgainstSettings) {
    against.up = Signal::named(&kept.up).unwrap_or(against.up);
    against.across = Signal::named(&kept.across).unwrap_or(against.across);
    let named = |extent: &Extent| extent.name() == kept.extent;
    against.extent = Extent::ALL.into_iter().find(named).unwrap_or(against.extent);
    against.zooms_to_stick_band = kept.zooms_to_stick_band;
}
