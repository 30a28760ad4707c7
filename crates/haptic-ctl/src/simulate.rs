//! `simulate`: a scene along a recorded motion, offline, by the code that the daemon runs.

use crate::failure::Failure;
use crate::scene::reference;
use crate::{output, progress};
use clap::Args;
use haptic_core::Scheme;
use haptic_lab::{motion, simulate};
use serde_json::json;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Scene, a TOML file
    #[arg(value_name = "SCENE.toml")]
    scene: PathBuf,

    /// Motion of the device: CSV with the columns t_s, device_position_m and, where measured,
    /// device_velocity_mps
    #[arg(long, value_name = "MOTION.csv")]
    motion: PathBuf,

    /// Output: motion of the block and force, one row a sample
    #[arg(long, value_name = "OUT.csv")]
    out: PathBuf,

    /// Output: changes of contact, t_s, from, to, with 0 stuck, 1 and -1 sliding
    #[arg(long, value_name = "EVENTS.csv")]
    events: Option<PathBuf>,

    /// Scheme: exact, literal as the paper prints it, literal:N with N steps a tick, or implicit
    #[arg(long, value_name = "SCHEME", default_value = "exact")]
    scheme: Scheme,

    /// Initial position of the block, m [default: first position of the device]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    block_position: Option<f64>,

    /// Initial velocity of the block, m/s; a moving block starts sliding
    #[arg(long, value_name = "M/S", allow_negative_numbers = true, default_value = "0")]
    block_velocity: f64,
}

pub(crate) fn run(arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    for (name, value) in [
        ("block-position", arguments.block_position.unwrap_or(0.0)),
        ("block-velocity", arguments.block_velocity),
    ] {
        if !value.is_finite() {
            return Err(Failure::Usage(format!("{name} = {value} is not a finite number")));
        }
    }
    refuse_overwriting(arguments)?;
    let scene = reference::file(&arguments.scene)?;
    let refused = |error| Failure::Usage(format!("{}: {error}", arguments.scene.display()));
    if scene.is_on_device() && (arguments.block_position.is_some() || arguments.block_velocity != 0.0) {
        return Err(Failure::Usage(format!(
            "{}: --block-position and --block-velocity place a block, and this scene has none",
            arguments.scene.display()
        )));
    }
    let motion = motion::read(&arguments.motion).map_err(|error| Failure::Usage(error.to_string()))?;
    let start = simulate::Start {
        position_m: arguments.block_position,
        velocity_mps: arguments.block_velocity,
    };
    let bar = progress::busy("simulating");
    let run = simulate::simulate(&scene, arguments.scheme, &motion, start).map_err(refused)?;
    write(&arguments.out, |file| simulate::write_rows(&run.rows, file))?;
    if let Some(path) = &arguments.events {
        write(path, |file| simulate::write_events(&run.events, file))?;
    }
    let cost = simulate::measure_cost(&scene, arguments.scheme, &motion, start).map_err(refused)?;
    bar.finish_and_clear();
    let ticks = motion.len() - 1;
    if as_json {
        return output::json(&json!({
            "scheme": arguments.scheme.to_string(),
            "ticks": ticks,
            "tick_ns_median": cost.median_ns,
            "tick_ns_worst": cost.worst_ns,
            "events": run.events.len(),
            "energy_created_J": run.energy_created_j,
            "exhausted_ticks": run.exhausted_ticks,
        }));
    }
    output::line(&format!(
        "{}, {} scheme: {ticks} ticks, {:.1} ns a tick (median), worst {:.2} us\n\
         {} changes of contact, {} J of energy created by friction, {} ticks out of work",
        scene.name,
        arguments.scheme,
        cost.median_ns,
        cost.worst_ns as f64 * 1e-3,
        run.events.len(),
        run.energy_created_j,
        run.exhausted_ticks,
    ))
}

/// No output may take the place of an input or of the other output.
fn refuse_overwriting(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = [&arguments.scene, &arguments.motion];
    for (output, others) in [
        (Some(&arguments.out), inputs.to_vec()),
        (arguments.events.as_ref(), [&inputs[..], &[&arguments.out]].concat()),
    ] {
        let Some(output) = output else { continue };
        if let Some(other) = others.into_iter().find(|other| same_file(output, other)) {
            let (output, other) = (output.display(), other.display());
            return Err(Failure::Usage(format!(
                "{output} would be written over {other}: name another file"
            )));
        }
    }
    Ok(())
}

/// Whether two paths lead to one file, existing or not.
fn same_file(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}

fn write(path: &Path, rows: impl FnOnce(BufWriter<File>) -> std::io::Result<()>) -> Result<(), Failure> {
    File::create(path)
        .and_then(|file| rows(BufWriter::new(file)))
        .map_err(|error| Failure::Usage(format!("{}: {error}", path.display())))
}
