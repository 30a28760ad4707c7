//! Force against velocity: what the block does, over what its law says of a steady slide.

use super::axis::reach;
use super::frame;
use crate::scope::Scope;
use crate::scope::signal::{MM_PER_M, Signal};
use crate::scope::value_axes::Reach;
use crate::theme::Palette;
use egui::{Align2, Color32, RichText, Ui};
use egui_plot::{Line, LineStyle, PlotBounds, PlotPoint, PlotPoints, Points, Text, VLine};
use haptic_core::{Parameter, Scene};

/// How long a trail the dot has, s.
const TRAIL_S: f64 = 1.0;

/// Points of the law's curve in each direction: enough for a Stribeck fall in the middle of a wide plot.
const CURVE_POINTS: u32 = 200;

/// Numbers at the axis of velocity, which is short.
const FEW: f64 = 2.0;

/// How far above the lower edge the name of a mark stands, as a share of the height.
const LABEL_SHARE: f64 = 0.04;

/// Half of the stick band's width where the scene has no threshold, mm/s.
const NARROW_BAND_MMPS: f64 = 5.0;

/// The law's curve: the slide to the left, the hold at rest, the slide to the right, in mm/s and N.
pub(crate) fn curve(scene: &Scene, fastest_mmps: f64) -> Vec<[f64; 2]> {
    let held = scene.friction.holding_force();
    let slide = |direction: f64| {
        (0..=CURVE_POINTS).map(move |step| {
            // Denser near rest, where the curve bends.
            let share = (f64::from(step) / f64::from(CURVE_POINTS)).powi(2);
            // The least that is not rest, so that the force is that of a slide in this direction.
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

/// Half of the width of the band in which sticking is decided, mm/s.
fn band(scene: Option<&Scene>) -> f64 {
    let of = |parameter| {
        scene
            .and_then(|scene| scene.value(parameter))
            .map_or(0.0, |value| value.positive)
    };
    let [threshold, stribeck] = [Parameter::VelocityThreshold, Parameter::StribeckVelocity].map(of);
    (4.0 * threshold.max(stribeck) * MM_PER_M).max(NARROW_BAND_MMPS)
}

/// What the axes are called.
pub(crate) const LABELS: [&str; 2] = ["Block velocity (mm/s)", "Coupling force (N)"];

/// What is drawn, in mm/s and N.
#[derive(Debug)]
pub(crate) struct Graph {
    pub(crate) law: Vec<[f64; 2]>,
    pub(crate) trail: Vec<[f64; 2]>,
    /// The velocities at which the block starts to be held, where its law has a threshold.
    pub(crate) thresholds: Vec<f64>,
    pub(crate) velocities: Reach,
    pub(crate) forces: Reach,
}

impl Graph {
    /// What is to be drawn of a scene, and of what is seen.
    pub(crate) fn of(scope: &Scope, scene: Option<&Scene>) -> Self {
        let trail = trail(scope);
        let threshold = scene.and_then(|scene| scene.value(Parameter::VelocityThreshold));
        let threshold = threshold
            .map(|value| value.positive * MM_PER_M)
            .filter(|mmps| *mmps > 0.0);
        let fastest = trail.iter().map(|[velocity, _]| velocity.abs()).fold(0.0, f64::max);
        let widest = if scope.zooms_to_stick_band {
            band(scene)
        } else {
            (fastest * 1.1).max(20.0)
        };
        let law = scene.map_or_else(Vec::new, |scene| curve(scene, widest * 1.2));
        let is_seen = |point: &&[f64; 2]| point[0].abs() <= widest;
        let forces = trail.iter().chain(&law).filter(is_seen).map(|[_, force]| *force);
        Self {
            forces: reach(forces, 2.0),
            law,
            trail,
            thresholds: threshold.into_iter().flat_map(|mmps| [-mmps, mmps]).collect(),
            velocities: (-widest, widest),
        }
    }
}

/// Shows the plot in `height` points.
pub(crate) fn show(ui: &mut Ui, scope: &mut Scope, scene: Option<&Scene>, height: f32) {
    let palette = Palette::of(ui);
    let label = "Zoom to the stick band";
    ui.checkbox(&mut scope.zooms_to_stick_band, label)
        .on_hover_text("Velocities at which it is decided whether the block sticks: a few times DV, or ws");
    let height = height - ui.spacing().interact_size.y - ui.spacing().item_spacing.y;
    let graph = Graph::of(scope, scene);
    let name = "Force against velocity plot";
    let plot = frame::plot(name, height, height, FEW)
        .x_axis_label(LABELS[0])
        .y_axis_label(LABELS[1]);
    let shown = plot.show(ui, |plot| {
        let ((left, right), (low, high)) = (graph.velocities, graph.forces);
        plot.set_plot_bounds(PlotBounds::from_min_max([left, low], [right, high]));
        for mark in graph.thresholds {
            let line = VLine::new("", mark).color(palette.mark);
            plot.vline(line.style(LineStyle::dashed_loose()).allow_hover(false));
            let at = PlotPoint::new(mark, low + LABEL_SHARE * (high - low));
            // Outside of the band, which may be narrower than its name.
            let side = if mark < 0.0 {
                Align2::RIGHT_CENTER
            } else {
                Align2::LEFT_CENTER
            };
            let name = Text::new("", at, RichText::new(" DV ").small());
            plot.text(name.color(palette.mark).anchor(side).allow_hover(false));
        }
        plot.line(
            Line::new("Law", PlotPoints::new(graph.law))
                .color(palette.law)
                .width(2.0),
        );
        let newest = graph.trail.last().copied();
        plot.line(
            Line::new("Trail", PlotPoints::new(graph.trail))
                .color(trail_color(palette))
                .width(1.0),
        );
        if let Some(newest) = newest {
            let dot = Points::new(dot_name(scope), PlotPoints::new(vec![newest]));
            plot.points(dot.color(palette.device).radius(5.0));
        }
    });
    shown.response.accessible_name(name);
}

/// What the dot stands for.
pub(crate) fn dot_name(scope: &Scope) -> &'static str {
    if scope.ends_now() { "Now" } else { "Newest seen" }
}

/// Fainter than the block's line, so that the law and the dot stand out.
pub(crate) fn trail_color(palette: &Palette) -> Color32 {
    palette.block.gamma_multiply(0.5)
}

/// The last second of what is seen: every sample, so that no spike is lost.
fn trail(scope: &Scope) -> Vec<[f64; 2]> {
    let seen = scope.seen();
    let samples = scope.tape().within((seen.to_s - TRAIL_S).max(seen.from_s), seen.to_s);
    let with_force = samples.filter(|sample| sample.state.is_live());
    with_force
        .map(|sample| [Signal::BlockVelocity.of(sample), Signal::CouplingForce.of(sample)])
        .collect()
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
