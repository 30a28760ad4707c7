//! `hapticd_core._native`: scenes and their simulation on numpy arrays. `hapticd_core` wraps it for people.

mod motion;
mod scene;
mod simulation;

use haptic_lab::accuracy;
use haptic_lab::simulate::Start;
use motion::Motion;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use scene::Scene;
use simulation::Simulation;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

/// What is refused, as a `ValueError` with the same words as on the command line.
fn refused(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn start(scene: &Scene, position_m: Option<f64>, velocity_mps: f64) -> PyResult<Start> {
    for (name, value) in [
        ("block_position_m", position_m.unwrap_or(0.0)),
        ("block_velocity_mps", velocity_mps),
    ] {
        if !value.is_finite() {
            return Err(refused(format!("{name} = {value} is not a finite number")));
        }
    }
    if scene.0.is_on_device() && (position_m.is_some() || velocity_mps != 0.0) {
        return Err(refused(
            "block_position_m and block_velocity_mps place a block, and this scene has none",
        ));
    }
    Ok(Start {
        position_m,
        velocity_mps,
    })
}

/// Renders a scene along a motion, as the daemon does.
#[pyfunction]
fn simulate(
    py: Python<'_>,
    motion: &Motion,
    scene: &Scene,
    scheme: &str,
    block_position_m: Option<f64>,
    block_velocity_mps: f64,
) -> PyResult<Simulation> {
    let start = start(scene, block_position_m, block_velocity_mps)?;
    let scheme = scheme.parse().map_err(refused)?;
    let run = py.detach(|| haptic_lab::simulate::simulate(&scene.0, scheme, &motion.0, start));
    run.map(Simulation).map_err(refused)
}

/// The true motion of a scene, by the reference solver.
#[pyfunction]
fn reference(
    py: Python<'_>,
    motion: &Motion,
    scene: &Scene,
    block_position_m: Option<f64>,
    block_velocity_mps: f64,
) -> PyResult<Simulation> {
    let start = start(scene, block_position_m, block_velocity_mps)?;
    // The solver panics over a law whose equations it does not have.
    let solve = || accuracy::reference::solve(&scene.0, &motion.0, start);
    let solved = py.detach(|| catch_unwind(AssertUnwindSafe(solve)));
    solved
        .map(Simulation)
        .map_err(|panic| match panic.downcast_ref::<String>() {
            Some(message) => refused(message),
            None => refused("the reference solver has failed"),
        })
}

/// How far a simulation is from another: position, m; force, N; the same relative; time of a change of contact, s.
#[pyfunction]
fn compare(run: &Simulation, truth: &Simulation, scene: &Scene) -> (f64, f64, f64, Option<f64>) {
    let stiffness = scene.0.coupling.map_or(0.0, |coupling| coupling.stiffness);
    let error = accuracy::compare(&run.0, &truth.0, stiffness);
    (
        error.position_m,
        error.force_n,
        error.relative_force,
        error.event_time_s,
    )
}

/// Steps the daemon's servo through a recording; returns the report as JSON.
#[pyfunction]
fn replay(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    py.detach(|| {
        let recording = haptic_recording::open_any(&path).map_err(refused)?;
        let metadata = recording.metadata().clone();
        let report = haptic_lab::replay::replay(&metadata, recording).map_err(refused)?;
        serde_json::to_string(&report).map_err(refused)
    })
}

#[pymodule]
mod _native {
    #[pymodule_export]
    use super::{Motion, Scene, Simulation, compare, reference, replay, simulate};
}
