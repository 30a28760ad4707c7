//! `advise --at-speed`: how often a block lets go of a hand that keeps its speed.

use crate::advise::Arguments;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output::{self, figure};
use crate::scene::offline;
use haptic_core::adviser::{StickSlip, StickSlipError, static_force_for, stick_slip, stiffness_for};
use haptic_core::{Direction, Parameter};
use haptic_ipc::{Request, SceneReply};
use serde_json::{Value, json};
use std::path::Path;

pub(crate) async fn run(
    socket: Option<&Path>,
    arguments: &Arguments,
    speed: f64,
    as_json: bool,
) -> Result<(), Failure> {
    let scene = match &arguments.scene {
        Some(scene) => offline::find_on_rig(socket, scene).await?,
        None => {
            let reply: SceneReply = Daemon::connect(socket).await?.ask(Request::get()).await?;
            reply.scene
        }
    };
    let refused = |error: StickSlipError| Failure::Usage(error.to_string());
    let found = stick_slip(&scene, speed).map_err(refused)?;
    let values = arguments.for_frequency.map(|frequency| {
        (
            frequency,
            stiffness_for(&scene, speed, frequency),
            static_force_for(&scene, speed, frequency),
        )
    });
    if let Some((_, Err(stiffness), Err(force))) = &values {
        return Err(Failure::Usage(match (stiffness, force) {
            (StickSlipError::OutOfReach { .. }, StickSlipError::OutOfReach { .. }) => format!("{stiffness}; {force}"),
            (why, _) => why.to_string(),
        }));
    }
    if as_json {
        return output::json(&json!({
            "speed_mps": speed,
            "stick_slip": found.map(value),
            "for_frequency": values.map(|(frequency, stiffness, force)| json!({
                "frequency_hz": frequency,
                "stiffness_n_per_m": stiffness.ok(),
                "static_force_n": force.ok(),
            })),
        }));
    }
    output::line(&describe(speed, found))?;
    let Some((frequency, stiffness, force)) = values else {
        return Ok(());
    };
    let kinetic = scene
        .value(Parameter::DynamicForce)
        .unwrap_or_default()
        .get(Direction::of(speed));
    let text = |value: Result<f64, StickSlipError>, unit: &str| match value {
        Ok(value) => format!("{} {unit}", figure(value)),
        Err(error) => error.to_string(),
    };
    let difference = force.as_ref().map_or_else(
        |_| String::new(),
        |force| format!(" (Fs - Fd = {} N)", figure(force - kinetic)),
    );
    output::line(&format!(
        "for {} Hz: K = {}, or Fs = {}{difference}",
        figure(frequency),
        text(stiffness, "N/m"),
        text(force, "N"),
    ))
}

fn value(found: StickSlip) -> Value {
    json!({
        "frequency_hz": found.frequency_hz,
        "stick_s": found.stick_s,
        "slip_s": found.slip_s,
        "jump_n": found.jump_n,
        "mean_force_n": found.mean_force_n,
    })
}

fn describe(speed: f64, found: Option<StickSlip>) -> String {
    let Some(found) = found else {
        return format!("at {} m/s the block slides on: no stick-slip", figure(speed));
    };
    format!(
        "at {} m/s the block lets go {} times a second: stuck for {} ms, sliding for {} ms; the pull falls by {} N, and is \
         {} N in the mean",
        figure(speed),
        figure(found.frequency_hz),
        figure(found.stick_s * 1e3),
        figure(found.slip_s * 1e3),
        figure(found.jump_n),
        figure(found.mean_force_n)
    )
}
