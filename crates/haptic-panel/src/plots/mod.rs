//! The plots, and the tools to look at them.

pub(crate) mod axis;
pub(crate) mod chart;
mod compare_menu;
pub(crate) mod contact_ribbon;
pub(crate) mod force_velocity;
pub(crate) mod frame;
pub(crate) mod labels;
pub(crate) mod legend;
pub(crate) mod limits;
mod mark_strip;
pub(crate) mod measure;
pub(crate) mod over_time;
pub(crate) mod picture;
pub(crate) mod plane;
mod plot_header;
pub(crate) mod reference;
mod rig_menu;
pub(crate) mod scope;
mod scrub_bar;
pub(crate) mod spectrum_plot;
mod statistics_table;
mod toolbar;
mod trigger_bar;

use crate::intent::Intent;
use crate::model::{Model, has_block, scene_seen};
use crate::view::PlotGroup;
use egui::{Align, Layout, RichText, Ui, vec2};
use limits::Limits;
use over_time::Background;

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
            for group in PlotGroup::ALL {
                ui.selectable_value(&mut layout.chosen, group, group.name());
            }
        });
    }
    layout.drawn = match (is_wide, layout.chosen) {
        (true, _) => vec![PlotGroup::OverTime, layout.beside],
        (false, chosen) => vec![chosen],
    };
    toolbar::show(ui, model, is_wide, intents);
    let height = ui.available_height();
    // The names of the axes reach into the margin.
    model.view.layout.area = ui.available_rect_before_wrap().expand2(vec2(AXIS_NAME_MARGIN, 0.0));
    if !is_wide {
        show_group(ui, model, model.view.layout.chosen, height);
        return;
    }
    let column = ui.available_width() * COLUMN_SHARE;
    ui.horizontal_top(|ui| {
        let first = vec2(ui.available_width() - column - ui.spacing().item_spacing.x, height);
        let layout = Layout::top_down(Align::Min);
        ui.allocate_ui_with_layout(first, layout, |ui| show_group(ui, model, PlotGroup::OverTime, height));
        let second = vec2(column, height);
        ui.allocate_ui_with_layout(second, layout, |ui| {
            let top = ui.cursor().top();
            let beside = &mut model.view.layout.beside;
            ui.horizontal(|ui| {
                picture::hide_controls(ui);
                for group in PlotGroup::BESIDE {
                    ui.selectable_value(beside, group, RichText::new(group.name()).small());
                }
            });
            let group = *beside;
            show_group(ui, model, group, height - (ui.cursor().top() - top));
        });
    });
}

fn show_group(ui: &mut Ui, model: &mut Model, group: PlotGroup, height: f32) {
    if group != PlotGroup::OverTime {
        show_beside(ui, model, group, height);
        return;
    }
    let limits = limits(model);
    let has_block = has_block(model);
    let Model { tapes, view, .. } = model;
    let (scope, reference) = view.plotted(tapes);
    let background = Background {
        reference: reference.as_ref(),
        limits: limits.as_ref(),
        has_block,
    };
    if scope.follows() {
        over_time::show(ui, tapes, scope, background, height);
        return;
    }
    over_time::show(ui, tapes, scope, background, height - scrub_bar::HEIGHT);
    scrub_bar::show(ui, tapes, scope);
}

/// The limits of what is seen, unless they are hidden.
pub(crate) fn limits(model: &Model) -> Option<Limits> {
    let Model { daemon, tapes, view } = model;
    let scope = view.scope(tapes);
    let scene = scene_seen(daemon, tapes, scope);
    view.layout
        .shows_limits
        .then(|| Limits::of(daemon, tapes, scope, scene))
}

/// Shows what stands beside the plots over time in `height` points.
fn show_beside(ui: &mut Ui, model: &mut Model, group: PlotGroup, height: f32) {
    let has_block = has_block(model);
    let Model { daemon, tapes, view } = model;
    match group {
        PlotGroup::OverTime | PlotGroup::Plane => {}
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
