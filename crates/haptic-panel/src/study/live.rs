//! The rig during a study: position with the active target, and force.

use crate::plots::axis::{AXIS_WIDTH, DEFAULT_COUNT};
use crate::plots::chart::{Axes, Chart, Ink, Overlay, Trace};
use crate::plots::frame::{self, RIGHT_MARGIN};
use crate::plots::legend;
use crate::plots::scope::TimeRange;
use crate::study::StudyState;
use crate::tape::Tape;
use crate::tape::signal::{MM_PER_M, Signal};
use crate::theme::Palette;
use egui::Ui;

/// Time that is seen, s.
const SPAN_S: f64 = 10.0;

/// Height of the numbers of the time axis, points.
const TIME_HEIGHT: f32 = 18.0;

/// Width of the edges of the target, points.
const EDGE_WIDTH: f32 = 2.0;

/// Shows both plots in `height` points.
pub(super) fn show(ui: &mut Ui, tape: &Tape, state: &StudyState, height: f32) {
    let palette = Palette::of(ui);
    let zero_s = tape.newest_s().unwrap_or(0.0);
    let seen = TimeRange {
        zero_s,
        from_s: zero_s - SPAN_S,
        to_s: zero_s,
    };
    let width = ui.available_width() - RIGHT_MARGIN;
    let columns = f64::from((width - AXIS_WIDTH).max(1.0) * ui.pixels_per_point());
    let edges = state.target_m.into_iter().flatten().map(|edge_m| Overlay::Level {
        value: edge_m * MM_PER_M,
        label: "".into(),
        is_inward: false,
        ink: Ink::solid(|palette| palette.sliding, EDGE_WIDTH),
    });
    let plots = [
        (
            "study position",
            "Position (mm)",
            10.0,
            Signal::DEVICE_POSITION,
            edges.collect(),
        ),
        ("study force", "Force (N)", 1.0, Signal::COMMAND_FORCE, Vec::new()),
    ];
    let header = legend::HEIGHT + ui.spacing().item_spacing.y;
    let inner = ((height - TIME_HEIGHT) / 2.0 - header).max(40.0);
    for (place, (name, label, smallest_span, signal, overlays)) in plots.into_iter().enumerate() {
        let has_time = place == 1;
        let axes = Axes {
            seen,
            columns,
            across: seen.on_axis(),
            up: None,
            smallest_span,
            labels: ["Time from the newest sample (s)".to_owned(), label.to_owned()],
        };
        let chart = Chart::new(tape, &[Trace::over_time(signal)], &overlays, axes);
        ui.horizontal(|ui| {
            ui.add_space(AXIS_WIDTH);
            legend::show(ui, &legend::entries(&chart, palette));
        });
        let height = if has_time { inner + TIME_HEIGHT } else { inner };
        let plot = frame::plot(name, height, inner, DEFAULT_COUNT, AXIS_WIDTH)
            .width(width)
            .show_axes([has_time, true])
            .x_axis_label(if has_time { chart.labels[0].as_str() } else { "" })
            .y_axis_label(chart.labels[1].as_str());
        let shown = plot.show(ui, |plot| frame::draw(plot, &chart, palette));
        shown.response.accessible_name(format!("{name} plot"));
    }
}
