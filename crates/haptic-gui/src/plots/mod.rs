//! The plots, and the tools to look at them.

pub(crate) mod axis;
pub(crate) mod chart;
pub(crate) mod contact_ribbon;
pub(crate) mod force_velocity;
pub(crate) mod frame;
pub(crate) mod over_time;
mod toolbar;
mod trigger_bar;

use crate::intent::Intent;
use crate::model::view::PlotGroup;
use crate::model::{Model, scene_seen};
use egui::{Align, Layout, Ui, vec2};

/// Width from which force against velocity has a column of its own, points.
const WIDE: f32 = 820.0;

/// Share of the width of this column.
const COLUMN_SHARE: f32 = 0.38;

/// Distance by which the name of a vertical axis may exceed the area of its plot, points: at most the
/// panel's margin.
const AXIS_NAME_MARGIN: f32 = 8.0;

/// Shows the plots in the remaining space.
pub(crate) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let is_wide = ui.available_width() >= WIDE;
    let layout = &mut model.view.layout;
    if !is_wide {
        ui.horizontal(|ui| {
            ui.selectable_value(&mut layout.chosen, PlotGroup::OverTime, "Over time");
            ui.selectable_value(&mut layout.chosen, PlotGroup::ForceVelocity, "Force against velocity");
        });
    }
    layout.drawn = match layout.chosen {
        _ if is_wide => &[PlotGroup::OverTime, PlotGroup::ForceVelocity],
        PlotGroup::OverTime => &[PlotGroup::OverTime],
        PlotGroup::ForceVelocity => &[PlotGroup::ForceVelocity],
    };
    toolbar::show(ui, model, is_wide, intents);
    let Model { daemon, tapes, view } = model;
    let height = ui.available_height();
    // The names of the axes reach into the margin.
    view.layout.area = ui.available_rect_before_wrap().expand2(vec2(AXIS_NAME_MARGIN, 0.0));
    let chosen = view.layout.chosen;
    let scope = view.scope_mut(tapes);
    let scene = scene_seen(daemon, tapes, scope);
    if is_wide {
        let column = ui.available_width() * COLUMN_SHARE;
        ui.horizontal_top(|ui| {
            let first = vec2(ui.available_width() - column - ui.spacing().item_spacing.x, height);
            let layout = Layout::top_down(Align::Min);
            ui.allocate_ui_with_layout(first, layout, |ui| over_time::show(ui, tapes, scope, height));
            let second = vec2(column, height);
            ui.allocate_ui_with_layout(second, layout, |ui| {
                force_velocity::show(ui, tapes, scope, scene, height);
            });
        });
        return;
    }
    match chosen {
        PlotGroup::OverTime => over_time::show(ui, tapes, scope, height),
        PlotGroup::ForceVelocity => force_velocity::show(ui, tapes, scope, scene, height),
    }
}
