//! The plots, and the tools to look at them.

pub(crate) mod axis;
pub(crate) mod contact_ribbon;
pub(crate) mod force_velocity;
mod frame;
pub(crate) mod over_time;
pub(crate) mod recordings;
mod toolbar;

use crate::intent::Intent;
use crate::model::Model;
use egui::{Ui, vec2};

/// From this width on force against velocity has a column of its own, points.
const WIDE: f32 = 820.0;

/// Share of the width that this column has.
const COLUMN_SHARE: f32 = 0.38;

/// As far as the name of a vertical axis may reach beyond its plot's place, points: no farther than the panel's margin.
const AXIS_NAME_MARGIN: f32 = 8.0;

/// In a narrow window the plots share the place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Shown {
    /// Force, position and velocity over time.
    #[default]
    OverTime,
    /// Force against velocity.
    ForceVelocity,
}

/// Shows them in the space that is left.
pub(crate) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let is_wide = ui.available_width() >= WIDE;
    if !is_wide {
        ui.horizontal(|ui| {
            ui.selectable_value(&mut model.plots_shown, Shown::OverTime, "Over time");
            ui.selectable_value(&mut model.plots_shown, Shown::ForceVelocity, "Force against velocity");
        });
    }
    toolbar::show(ui, model, intents);
    let height = ui.available_height();
    // The names of the axes reach into the margin.
    model.plots_area = ui.available_rect_before_wrap().expand2(vec2(AXIS_NAME_MARGIN, 0.0));
    model.plots_seen = match model.plots_shown {
        _ if is_wide => &[Shown::OverTime, Shown::ForceVelocity],
        Shown::OverTime => &[Shown::OverTime],
        Shown::ForceVelocity => &[Shown::ForceVelocity],
    };
    let shown = model.plots_shown;
    let (scope, scene) = model.scope_and_scene();
    if is_wide {
        let column = ui.available_width() * COLUMN_SHARE;
        ui.horizontal_top(|ui| {
            let first = vec2(ui.available_width() - column - ui.spacing().item_spacing.x, height);
            let layout = egui::Layout::top_down(egui::Align::Min);
            ui.allocate_ui_with_layout(first, layout, |ui| over_time::show(ui, scope, height));
            let second = vec2(column, height);
            ui.allocate_ui_with_layout(second, layout, |ui| force_velocity::show(ui, scope, scene, height));
        });
        return;
    }
    match shown {
        Shown::OverTime => over_time::show(ui, scope, height),
        Shown::ForceVelocity => force_velocity::show(ui, scope, scene, height),
    }
}
