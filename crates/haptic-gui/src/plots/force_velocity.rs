//! Force against velocity: the trail of the block over its law's force of a steady slide.

use super::chart::{Across, Axes, Chart, Curve, Ink, Overlay, Trace};
use super::frame;
use crate::model::scope::{Scope, TimeRange};
use crate::model::tapes::Tapes;
use crate::tape::signal::{MM_PER_M, Signal};
use crate::theme::Palette;
use egui::Ui;
use haptic_core::{Parameter, Scene};

/// Length of the trail, s.
const TRAIL_S: f64 = 1.0;

/// Points of the law's curve in each direction: enough for a Stribeck fall in the middle of a wide plot.
const CURVE_POINTS: u32 = 200;

/// Numbers at the short axis of velocity.
const FEW: f64 = 2.0;

/// Half of the width of the stick band for a scene without a threshold, mm/s.
const NARROW_BAND_MMPS: f64 = 5.0;

/// The narrowest range of velocity to either side, mm/s.
const NARROWEST_MMPS: f64 = 20.0;

/// Smallest span of the axis of force, N.
const SMALLEST_SPAN_N: f64 = 2.0;

/// Every sample of the trail, fainter than the block's line, so that the law and the dot stand out.
const TRAIL: Trace = Trace {
    name: "Trail",
    across: Across::Signal(Signal::BLOCK_VELOCITY),
    signal: Signal::COUPLING_FORCE,
    ink: Ink {
        color: |palette| palette.block,
        width: 1.0,
        opacity: 0.5,
    },
};

/// The law's curve: the slide to the left, the hold at rest, the slide to the right, in mm/s and N.
pub(crate) fn curve(scene: &Scene, fastest_mmps: f64) -> Vec<[f64; 2]> {
    let held = scene.friction.holding_force();
    let slide = |direction: f64| {
        (0..=CURVE_POINTS).map(move |step| {
            // Denser near rest, where the curve bends.
            let share = (f64::from(step) / f64::from(CURVE_POINTS)).powi(2);
            // The smallest speed that is not rest, so that the force is that of a slide.
            let speed = (share * fastest_mmps / MM_PER_M).max(f64::MIN_POSITIVE);
            [
                direction * speed * MM_PER_M,
                scene.friction.steady_force(direction * speed),
            ]
        })
    };
    let mut points: Vec<[f64; 2]> = slide(-1.0).collect();
    points.reverse();
    if held.positive > 0.0 || held.negative > 0.0 {
        points.extend([[0.0, -held.negative], [0.0, held.positive]]);
    }
    points.extend(slide(1.0));
    points
}

/// Half of the width of the band in which the block sticks or slides, mm/s.
fn band(scene: Option<&Scene>) -> f64 {
    let of = |parameter| {
        scene
            .and_then(|scene| scene.value(parameter))
            .map_or(0.0, |value| value.positive)
    };
    let [threshold, stribeck] = [Parameter::VelocityThreshold, Parameter::StribeckVelocity].map(of);
    (4.0 * threshold.max(stribeck) * MM_PER_M).max(NARROW_BAND_MMPS)
}

/// The chart of the time that is seen, with the law of a scene.
pub(crate) fn chart(tapes: &Tapes, scope: &Scope, scene: Option<&Scene>) -> Chart {
    let seen = scope.seen(tapes);
    let seen = TimeRange {
        from_s: seen.from_s.max(seen.to_s - TRAIL_S),
        ..seen
    };
    let tape = scope.tape(tapes);
    let samples = tape.within(seen.from_s, seen.to_s);
    let with_force = samples.filter(|sample| sample.state.is_live());
    let (mut fastest, mut newest) = (0.0_f64, None);
    for sample in with_force {
        let velocity = Signal::BLOCK_VELOCITY.of(sample);
        fastest = fastest.max(velocity.abs());
        newest = Some([velocity, Signal::COUPLING_FORCE.of(sample)]);
    }
    let widest = if scope.zooms_to_stick_band {
        band(scene)
    } else {
        (fastest * 1.1).max(NARROWEST_MMPS)
    };
    let law = Overlay::Curve(Curve {
        name: "Law",
        points: scene.map_or_else(Vec::new, |scene| curve(scene, widest * 1.2)),
        ink: Ink::solid(|palette| palette.law, 2.0),
    });
    let dot = newest.map(|at| Overlay::Dot {
        name: if scope.ends_now(tapes) { "Now" } else { "Newest seen" },
        at,
        color: |palette| palette.device,
    });
    let overlays: Vec<_> = [law].into_iter().chain(thresholds(scene)).chain(dot).collect();
    let axes = Axes {
        seen,
        columns: 1.0,
        across: (-widest, widest),
        up: None,
        smallest_span: SMALLEST_SPAN_N,
        labels: ["Block velocity (mm/s)".to_owned(), "Coupling force (N)".to_owned()],
    };
    Chart::new(tape, &[TRAIL], &overlays, axes)
}

/// The velocities at which the block starts to stick, if the law has a threshold.
fn thresholds(scene: Option<&Scene>) -> impl Iterator<Item = Overlay> {
    let threshold = scene.and_then(|scene| scene.value(Parameter::VelocityThreshold));
    let mmps = threshold.map(|value| value.positive * MM_PER_M);
    let both = mmps
        .filter(|mmps| *mmps > 0.0)
        .into_iter()
        .flat_map(|mmps| [-mmps, mmps]);
    both.map(|at| Overlay::Mark {
        at,
        label: "DV".into(),
        is_dashed: true,
        ink: Ink::solid(|palette| palette.mark, 1.0),
    })
}

/// Shows the plot in `height` points.
pub(crate) fn show(ui: &mut Ui, tapes: &Tapes, scope: &mut Scope, scene: Option<&Scene>, height: f32) {
    let palette = Palette::of(ui);
    let label = "Zoom to the stick band";
    ui.checkbox(&mut scope.zooms_to_stick_band, label)
        .on_hover_text("Velocities at which it is decided whether the block sticks: a few times DV, or ws");
    let height = height - ui.spacing().interact_size.y - ui.spacing().item_spacing.y;
    let chart = chart(tapes, scope, scene);
    let name = "Force against velocity plot";
    let plot = frame::plot(name, height, height, FEW)
        .x_axis_label(chart.labels[0].as_str())
        .y_axis_label(chart.labels[1].as_str());
    let shown = plot.show(ui, |plot| frame::draw(plot, &chart, palette));
    shown.response.accessible_name(name);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_holds_at_rest_and_slides_at_the_kinetic_force() {
        let curve = curve(&Scene::paper(), 100.0);
        assert_eq!(curve.first(), Some(&[-100.0, -3.5]));
        assert_eq!(curve.last(), Some(&[100.0, 3.5]));
        assert!(curve.contains(&[0.0, -4.0]) && curve.contains(&[0.0, 4.0]));
        assert!(curve.is_sorted_by(|a, b| a[0] <= b[0]));
    }

    #[test]
    fn drag_alone_holds_nothing() {
        let drag = Scene::paper().with_law("viscous").expect("a law").expect("a scene");
        let curve = curve(&drag, 1000.0);
        assert_eq!(curve.last(), Some(&[1000.0, 2.0]));
        assert!(
            curve
                .iter()
                .all(|[velocity, force]| (force - velocity / 500.0).abs() < 1e-9)
        );
    }
}
