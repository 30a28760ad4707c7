//! Draws the friction that a hand feels which goes round in a circle: that of a plane, and of two axes.
//!
//!     cargo run --release -p haptic-lab --example friction-circle > friction-circle.svg
//!
//! A surface that is alike in all directions rubs with `Fd` against the motion, whose forces draw a circle. A friction
//! for each axis, as two daemons side by side or the firmware of a joystick have it, draws a square: up to `sqrt(2) Fd`
//! at 45 degrees, and each axis sticks where its own motion turns round. The lengths are printed on standard error.

use haptic_core::planar::Plane;
use haptic_core::{Scene, SceneError, Scheme};
use haptic_lab::drawing::{Chart, PLOT_WIDTH_PX, Trace, svg};
use haptic_lab::motion::DeviceSample;
use haptic_lab::simulate::{Start, simulate};
use std::f64::consts::TAU;

/// Ticks of a round at 1 kHz; the first of two rounds begins at rest and is not drawn.
const ROUND: u32 = 4000;

/// Radius of the hand's circle, m.
const RADIUS_M: f64 = 0.03;

/// Force from one end of a drawn axis to the middle, N.
const SPAN_N: f64 = 6.0;

/// Width and height of a plot, px.
const PLOT_PX: [f64; 2] = [PLOT_WIDTH_PX, 420.0];

fn hand() -> Vec<DeviceSample<Plane>> {
    let sample = |tick: u32| {
        let rate = TAU / (f64::from(ROUND) * 1e-3);
        let (sine, cosine) = (rate * f64::from(tick) * 1e-3).sin_cos();
        DeviceSample {
            t_s: f64::from(tick) * 1e-3,
            position_m: Plane::new(cosine, sine) * RADIUS_M,
            velocity_mps: Plane::new(-sine, cosine) * (RADIUS_M * rate),
        }
    };
    (0..=2 * ROUND).map(sample).collect()
}

/// Forces of the second round: of the plane, and of two axes.
fn forces(scene: &Scene) -> Result<[Vec<Plane>; 2], SceneError> {
    let hand = hand();
    let in_the_plane = simulate(scene, Scheme::Exact, &hand, Start::default())?;
    let along = |axis: fn(Plane) -> f64| {
        let motion: Vec<DeviceSample> = hand
            .iter()
            .map(|sample| DeviceSample {
                t_s: sample.t_s,
                position_m: axis(sample.position_m),
                velocity_mps: axis(sample.velocity_mps),
            })
            .collect();
        simulate(scene, Scheme::Exact, &motion, Start::default())
    };
    let (x, y) = (along(|vector| vector.x)?, along(|vector| vector.y)?);
    let by_axis = x.rows.iter().zip(&y.rows);
    let by_axis = by_axis.map(|(x, y)| Plane::new(x.coupling_force_n, y.coupling_force_n));
    let in_the_plane = in_the_plane.rows.iter().map(|row| row.coupling_force_n);
    Ok([
        in_the_plane.skip(ROUND as usize).collect(),
        by_axis.skip(ROUND as usize).collect(),
    ])
}

/// Least and greatest length.
fn lengths(forces: &[Plane]) -> [f64; 2] {
    let lengths = || forces.iter().map(|force| force.length());
    [lengths().fold(f64::INFINITY, f64::min), lengths().fold(0.0, f64::max)]
}

fn charts(forces: &[Vec<Plane>; 2]) -> [Chart; 2] {
    let names = ["one friction of the plane", "a friction for each axis"];
    let mut round = Chart::new(
        "The hand goes round in a circle",
        "Force along x (N)",
        "Force along y (N)",
    );
    round.height_px = PLOT_PX[1];
    let wide_n = SPAN_N * PLOT_PX[0] / PLOT_PX[1];
    (round.across.range, round.up.range) = (Some((-wide_n, wide_n)), Some((-SPAN_N, SPAN_N)));
    let mut length = Chart::new("Its length", "Direction of the motion (degrees)", "Force (N)");
    length.up.range = Some((0.0, SPAN_N));
    for (name, forces) in names.into_iter().zip(forces) {
        round = round.with(Trace::line(
            name,
            forces.iter().map(|force| [force.x, force.y]).collect(),
        ));
        let degrees = |index: usize| 360.0 * index as f64 / f64::from(ROUND);
        let lengths = forces.iter().enumerate();
        let lengths = lengths.map(|(index, force)| [degrees(index), force.length()]);
        length = length.with(Trace::line(name, lengths.collect()));
    }
    [round, length]
}

fn main() -> Result<(), SceneError> {
    let forces = forces(&Scene::paper())?;
    println!("{}", svg(&charts(&forces)));
    for (name, forces) in ["the plane", "two axes"].iter().zip(&forces) {
        let [least, greatest] = lengths(forces);
        eprintln!("force of {name}: {least:.2} to {greatest:.2} N");
    }
    Ok(())
}

#[test]
fn plane_draws_a_circle_and_two_axes_do_not() {
    let forces = forces(&Scene::paper()).expect("the plane has this scene");
    let [[least, greatest], [_, by_axis]] = [lengths(&forces[0]), lengths(&forces[1])];
    assert!(3.5 * 0.98 < least && greatest < 3.5 * 1.02, "{least} to {greatest} N");
    assert!(by_axis > 3.5 * 1.4, "{by_axis} N");
    assert!(svg(&charts(&forces)).contains("a friction for each axis"));
}
