//! Force against velocity: what the block does, over what its law says of a steady slide.

use super::axis::{AXIS_WIDTH, count_for, number, reach, steps};
use crate::scope::Scope;
use crate::scope::signal::{MM_PER_M, Signal};
use crate::theme::Palette;
use egui::{TextStyle, Ui};
use egui_plot::{Corner, Legend, Line, LineStyle, Plot, PlotBounds, PlotPoints, Points, VLine, uniform_grid_spacer};
use haptic_core::{Parameter, Scene};

/// How long a trail the dot has, s.
const TRAIL_S: f64 = 1.0;

/// Points of the law's curve in each direction: enough for a Stribeck fall in the middle of a wide plot.
const CURVE_POINTS: u32 = 200;

/// Numbers at the axis of velocity, which is short.
const FEW: f64 = 2.0;

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

/// Shows the plot in `height` points.
pub(crate) fn show(ui: &mut Ui, scope: &mut Scope, scene: Option<&Scene>, height: f32) {
    let palette = Palette::of(ui);
    let label = "Zoom to the stick band";
    ui.checkbox(&mut scope.zooms_to_stick_band, label)
        .on_hover_text("Velocities at which it is decided whether the block sticks: a few times DV, or ws");
    let height = height - ui.spacing().interact_size.y - ui.spacing().item_spacing.y;
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
    let curve = scene.map_or_else(Vec::new, |scene| curve(scene, widest * 1.2));
    let is_seen = |point: &&[f64; 2]| point[0].abs() <= widest;
    let forces = trail.iter().chain(&curve).filter(is_seen).map(|[_, force]| *force);
    let (low, high) = reach(forces, 2.0);
    let plot = Plot::new("Force against velocity plot")
        .height(height)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_axis_zoom_drag(false)
        .allow_double_click_reset(false)
        .x_axis_label("Block velocity (mm/s)")
        .y_axis_label("Coupling force (N)")
        .x_grid_spacer(uniform_grid_spacer(|grid| steps(grid.bounds, FEW)))
        .y_grid_spacer(uniform_grid_spacer(|grid| steps(grid.bounds, count_for(height))))
        .x_axis_formatter(|mark, reach| number(mark.value, (*reach.start(), *reach.end())))
        .y_axis_formatter(|mark, reach| number(mark.value, (*reach.start(), *reach.end())))
        .y_axis_min_width(AXIS_WIDTH)
        .legend(
            Legend::default()
                .position(Corner::LeftTop)
                .text_style(TextStyle::Small)
                .follow_insertion_order(true),
        );
    let shown = plot.show(ui, |plot| {
        plot.set_plot_bounds(PlotBounds::from_min_max([-widest, low], [widest, high]));
        for mark in threshold.into_iter().flat_map(|mmps| [-mmps, mmps]) {
            let line = VLine::new("DV", mark).color(palette.mark);
            plot.vline(line.style(LineStyle::dashed_loose()).allow_hover(false));
        }
        plot.line(Line::new("Law", PlotPoints::new(curve)).color(palette.law).width(2.0));
        let newest = trail.last().copied();
        let faint = palette.block.gamma_multiply(0.5);
        plot.line(Line::new("Trail", PlotPoints::new(trail)).color(faint).width(1.0));
        if let Some(newest) = newest {
            let dot = Points::new("Now", PlotPoints::new(vec![newest]));
            plot.points(dot.color(palette.device).radius(5.0));
        }
    });
    shown.response.accessible_name("Force against velocity plot");
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
