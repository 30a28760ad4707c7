//! How the wheel and a drag act on a plot.

use egui::Ui;

/// Points of scrolling by the wheel that zoom by a factor of e.
const POINTS_PER_ZOOM: f32 = 200.0;

/// Distance from a cursor at which a drag takes it along, points.
pub(super) const GRAB: f32 = 8.0;

/// The factor by which the wheel, or two fingers, zoom in now.
pub(super) fn zoom(ui: &Ui) -> Option<f64> {
    let (scroll, zoom) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
    let factor = zoom * (scroll / POINTS_PER_ZOOM).exp();
    ((factor - 1.0).abs() > f32::EPSILON).then(|| f64::from(factor))
}
