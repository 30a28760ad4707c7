//! `surface`: what a lab would record of a surface, simulated by the reference solver.

use crate::failure::Failure;
use crate::scene::offline;
use crate::table_file::{self, TableFile};
use crate::{complete, output, progress};
use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use haptic_lab::identify::study::Sensors;
use haptic_lab::surface;
use serde_json::json;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Scene of the surface: NAME, @REVISION or FILE.toml
    #[arg(add = ArgValueCompleter::new(complete::scenes))]
    scene: String,

    /// Record: CSV with the columns t_s, position_m and force_N
    #[arg(long, value_name = "REAL.csv")]
    out: PathBuf,

    /// Output: motion of the hand that drives the mass, for `fake-rig --hand`
    #[arg(long, value_name = "HAND.csv")]
    hand: Option<PathBuf>,

    /// Mass that slides, kg [default: that of the scene's block]
    #[arg(long, value_name = "KG", allow_hyphen_values = true)]
    mass: Option<f64>,

    /// Noise of the force sensor, N rms
    #[arg(long, value_name = "N", allow_hyphen_values = true, default_value = "0.1")]
    noise: f64,

    /// Step of the encoder, m
    #[arg(long, value_name = "M", allow_hyphen_values = true, default_value = "1e-5")]
    resolution: f64,

    /// Seed of the noise
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u64,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

pub(crate) async fn run(socket: Option<&Path>, arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    // Before the work, which takes seconds.
    for path in [Some(&arguments.out), arguments.hand.as_ref()].into_iter().flatten() {
        table_file::check(path, arguments.force)?;
    }
    let scene = offline::find(socket, &arguments.scene).await?;
    let name = &arguments.scene;
    let Some(block) = scene.block else {
        return Err(Failure::Usage(format!(
            "{name}: the scene has no block, and so nothing that slides"
        )));
    };
    let within = |name: &str, value: f64, low: f64, high: f64, unit: &str| {
        if (low..=high).contains(&value) {
            Ok(value)
        } else {
            Err(Failure::Usage(format!(
                "{name} = {value} {unit} is out of range: {low} to {high} {unit}"
            )))
        }
    };
    let mass_kg = within("mass", arguments.mass.unwrap_or(block.mass), 1e-3, 100.0, "kg")?;
    let sensors = Sensors {
        force_noise_n: within("noise", arguments.noise, 0.0, 10.0, "N")?,
        resolution_m: within("resolution", arguments.resolution, 0.0, 1e-3, "m")?,
        ..Sensors::USUAL
    };
    let bar = progress::busy("solving");
    let recorded = surface::record(&surface::experiment(mass_kg, scene.friction, sensors), arguments.seed);
    bar.finish_and_clear();
    let record = &recorded.mass;
    let rows = record.t_s.iter().zip(&record.position_m).zip(&record.force_n);
    let rows = rows.map(|((t, position), force)| format!("{t:.4},{position:.7},{force:.5}"));
    write(arguments, &arguments.out, "t_s,position_m,force_N", rows)?;
    if let Some(path) = &arguments.hand {
        let rows = recorded.hand.iter();
        let rows = rows.map(|sample| format!("{:.4},{:.7}", sample.t_s, sample.position_m));
        write(arguments, path, "t_s,position_m", rows)?;
    }
    let length_s = record.t_s.last().copied().unwrap_or(0.0);
    if as_json {
        return output::json(&json!({
            "file": arguments.out,
            "rows": record.t_s.len(),
            "length_s": length_s,
            "mass_kg": mass_kg,
        }));
    }
    output::text(&format!(
        "{}: {mass_kg} kg on the surface of {}, {length_s:.1} s, {} rows",
        arguments.out.display(),
        scene.name,
        record.t_s.len()
    ))
}

fn write(arguments: &Arguments, path: &Path, header: &str, rows: impl Iterator<Item = String>) -> Result<(), Failure> {
    let mut file = TableFile::create(path, arguments.force)?;
    file.line(format_args!("{header}"))?;
    for row in rows {
        file.line(format_args!("{row}"))?;
    }
    file.finish()
}
