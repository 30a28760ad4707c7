//! What stands beside the plots over time: force against velocity, statistics, or a spectrum.

use super::{force_velocity, spectrum_plot, statistics_table};
use crate::model::view::PlotGroup;
use crate::model::{Model, has_block, scene_seen};
use egui::Ui;

/// Shows one of them in `height` points.
pub(super) fn show(ui: &mut Ui, model: &mut Model, group: PlotGroup, height: f32) {
    let has_block = has_block(model);
    let Model { daemon, tapes, view } = model;
    match group {
        PlotGroup::OverTime => {}
        PlotGroup::ForceVelocity => {
            let (scope, reference) = view.plotted(tapes);
            let scene = scene_seen(daemon, tapes, scope);
            force_velocity::show(ui, tapes, scope, (scene, reference.as_ref()), height);
        }
        PlotGroup::Statistics => {
            let (scope, reference, measuring) = view.measured(tapes);
            statistics_table::show(ui, tapes, scope, reference, measuring, has_block);
        }
        PlotGroup::Spectrum => {
            let (scope, _, measuring) = view.measured(tapes);
            spectrum_plot::show(ui, tapes, scope, measuring, height);
        }
    }
}
