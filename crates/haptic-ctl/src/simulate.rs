//! `simulate`: a scene along a recorded motion, offline, by the code that the daemon runs.

use crate::failure::Failure;
use crate::scene::{offline, reference};
use crate::table_file::{self, TableFile};
use crate::{complete, output, progress, table_options};
use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use haptic_core::{Scene, SceneError, Scheme, Vector};
use haptic_lab::motion::{self, MotionError, MotionFile, MotionReader};
use haptic_lab::simulate::{self, Cost, SimulatedRow, Simulator, Start};
use serde_json::json;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[arg(help = reference::HELP, add = ArgValueCompleter::new(complete::scenes))]
    scene: String,

    /// Motion of the device: a recording, or a table (CSV, Parquet)
    #[arg(id = "file", long = "motion", value_name = "MOTION")]
    motion: PathBuf,

    /// Output: motion of the block and force, one row a sample
    #[arg(long, value_name = "OUT.csv")]
    out: PathBuf,

    /// Output: changes of contact, t_s, from, to, with 0 stuck, 1 and -1 sliding
    #[arg(long, value_name = "EVENTS.csv")]
    events: Option<PathBuf>,

    /// Scheme: exact, implicit, literal (as in the paper), literal:N (N steps a tick)
    #[arg(long, value_name = "SCHEME", default_value = "exact")]
    scheme: Scheme,

    /// Initial position of the block, m; X,Y in the plane [default: the device's]
    #[arg(long, value_name = "M", allow_hyphen_values = true, value_delimiter = ',')]
    block_position: Vec<f64>,

    /// Initial velocity of the block, m/s [default: 0]
    #[arg(long, value_name = "M/S", allow_hyphen_values = true, value_delimiter = ',')]
    block_velocity: Vec<f64>,

    /// Replace existing files
    #[arg(long)]
    force: bool,

    #[command(flatten)]
    table: table_options::Arguments,
}

pub(crate) async fn run(socket: Option<&Path>, arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    for (name, values) in [
        ("block-position", &arguments.block_position),
        ("block-velocity", &arguments.block_velocity),
    ] {
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            return Err(Failure::Usage(format!("{name} = {value} is not a finite number")));
        }
    }
    refuse_overwriting(arguments)?;
    for path in [Some(&arguments.out), arguments.events.as_ref()].into_iter().flatten() {
        table_file::check(path, arguments.force)?;
    }
    let scene = offline::find(socket, &arguments.scene).await?;
    let moves = arguments.block_velocity.iter().any(|part| *part != 0.0);
    if scene.is_on_device() && (!arguments.block_position.is_empty() || moves) {
        return Err(Failure::Usage(format!(
            "{}: --block-position and --block-velocity place a block, and this scene has none",
            arguments.scene
        )));
    }
    let bar = progress::busy("simulating");
    let summary = render(arguments, &scene)?;
    bar.finish_and_clear();
    if as_json {
        return output::json(&json!({
            "scheme": arguments.scheme.to_string(),
            "ticks": summary.ticks,
            "tick_ns_median": summary.cost.median_ns,
            "tick_ns_worst": summary.cost.worst_ns,
            "events": summary.events,
            "energy_created_J": summary.energy_created_j,
            "exhausted_ticks": summary.exhausted_ticks,
            "notes": summary.notes,
        }));
    }
    for note in &summary.notes {
        output::text(&format!("note: {note}"))?;
    }
    output::text(&format!(
        "{}, {} scheme: {} ticks, {:.1} ns a tick (median), worst {:.2} us\n\
         {} changes of contact, {} of energy created by friction, {} ticks out of work",
        scene.name,
        arguments.scheme,
        summary.ticks,
        summary.cost.median_ns,
        summary.cost.worst_ns as f64 * 1e-3,
        summary.events,
        summary
            .energy_created_j
            .map_or("an unknown amount".to_owned(), |energy_j| format!(
                "{} J",
                output::figure(energy_j)
            )),
        summary.exhausted_ticks,
    ))
}

struct Summary {
    ticks: usize,
    events: usize,
    /// Not measured on the device itself in the plane.
    energy_created_j: Option<f64>,
    exhausted_ticks: u64,
    cost: Cost,
    notes: Vec<String>,
}

/// The block's beginning in the motion's own space.
fn start<V: Vector>(arguments: &Arguments) -> Result<Start<V>, Failure> {
    let vector = |option: &str, numbers: &[f64]| {
        let mut vector = V::ZERO;
        if numbers.is_empty() {
            return Ok(None);
        }
        if numbers.len() != V::AXES {
            let takes = if V::AXES == 1 {
                "one number where the motion has one axis"
            } else {
                "X,Y where the motion has two axes"
            };
            let given = numbers.len();
            return Err(Failure::Usage(format!(
                "--{option} takes {takes}; numbers given: {given}"
            )));
        }
        for (part, number) in vector.parts().zip(numbers) {
            *part = *number;
        }
        Ok(Some(vector))
    };
    Ok(Start {
        position_m: vector("block-position", &arguments.block_position)?,
        velocity_mps: vector("block-velocity", &arguments.block_velocity)?.unwrap_or(V::ZERO),
    })
}

/// Renders the motion in its own space.
fn render(arguments: &Arguments, scene: &Scene) -> Result<Summary, Failure> {
    let unreadable = |error: MotionError| Failure::Usage(error.to_string());
    let table = arguments.table.options();
    // A wrong row is reported before anything is written; a pipe is read only once.
    if arguments.motion.is_file() {
        motion::check(&arguments.motion, &table).map_err(unreadable)?;
    }
    match MotionFile::open(&arguments.motion, &table).map_err(unreadable)? {
        MotionFile::Line(motion) => render_along(motion, arguments, scene),
        MotionFile::Plane(motion) => {
            let mut summary = render_along(motion, arguments, scene)?;
            summary.energy_created_j = summary.energy_created_j.filter(|_| !scene.is_on_device());
            Ok(summary)
        }
    }
}

/// Renders the motion and writes its rows, one stretch after another, so that the length of a motion
/// does not matter to memory.
fn render_along<V: Vector>(
    mut motion: MotionReader<V>,
    arguments: &Arguments,
    scene: &Scene,
) -> Result<Summary, Failure> {
    let unreadable = |error: MotionError| Failure::Usage(error.to_string());
    let refused = |error: SceneError| Failure::Usage(format!("{}: {error}", arguments.scene));
    let start = start(arguments)?;
    let (first, period_s) = (motion.first(), motion.period_s());
    let mut simulator = Simulator::new(scene, arguments.scheme, period_s, &first, start).map_err(refused)?;
    let mut meter = simulator.cost_meter(&first);
    let create = |path| TableFile::create(path, arguments.force);
    let mut rows_file = create(&arguments.out)?;
    let mut events_file = arguments.events.as_deref().map(create).transpose()?;
    rows_file.write(|file| simulate::write_rows_header::<V>(file))?;
    if let Some(file) = &mut events_file {
        file.write(|file| simulate::write_events_header(file))?;
    }
    let (mut samples, mut event_count) = (0, 0);
    loop {
        let stretch = motion.next_stretch().map_err(unreadable)?;
        if stretch.is_empty() {
            break;
        }
        let mut events = Vec::new();
        let rows: Vec<SimulatedRow<V>> = stretch
            .iter()
            .map(|sample| simulator.step(sample, &mut events))
            .collect();
        rows_file.write(|file| simulate::write_rows(&rows, file))?;
        if let Some(file) = &mut events_file {
            file.write(|file| simulate::write_events(&events, file))?;
        }
        meter.measure(&stretch);
        samples += stretch.len();
        event_count += events.len();
    }
    rows_file.finish()?;
    if let Some(file) = events_file {
        file.finish()?;
    }
    Ok(Summary {
        ticks: samples - 1,
        events: event_count,
        energy_created_j: Some(simulator.energy_created_j()),
        exhausted_ticks: simulator.exhausted_ticks(),
        cost: meter.cost(),
        notes: motion.notes().to_vec(),
    })
}

/// No output may take the place of an input or of the other output.
fn refuse_overwriting(arguments: &Arguments) -> Result<(), Failure> {
    let scene = reference::path(&arguments.scene);
    let inputs: Vec<&Path> = scene.into_iter().chain([arguments.motion.as_path()]).collect();
    table_file::refuse_overwriting(&arguments.out, inputs.iter().copied())?;
    match &arguments.events {
        Some(events) => table_file::refuse_overwriting(events, inputs.into_iter().chain([arguments.out.as_path()])),
        None => Ok(()),
    }
}
