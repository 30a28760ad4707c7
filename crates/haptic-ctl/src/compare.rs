//! `compare`: the recording of a rendered surface against the record of the real one.

use crate::failure::Failure;
use crate::output;
use crate::units::one_of;
use clap::Args;
use haptic_ipc::quoted;
use haptic_lab::compare::{self, AlignedBy, Options};
use haptic_lab::drawing::PlotFormat;
use haptic_lab::identify::record_file::{self, Loaded, RecordFileError, Source};
use haptic_lab::identify::{self, Clocks, ModelKind, Record};
use haptic_motion::table::TableError;
use serde_json::json;
use std::path::{Path, PathBuf};

pub(crate) const HELP: &str = "\
Both files are recordings, or tables (CSV, Parquet) with the columns t_s, position_m and force_N: the force on the \
moving mass, positive along the position. A recording gives the block's motion and the coupling's force while the rig \
was engaged.

Example:
  haptic-ctl compare real.csv rig.mcap --plot both.svg";

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Record of the real surface
    real: PathBuf,

    /// Recording of the rendered surface
    rendered: PathBuf,

    /// Moving mass, kg, whose inertia the plot and `--align velocity` leave out; 0 keeps it in [default: that of the
    /// recorded block, unless the real record shows another]
    #[arg(long, value_name = "KG", allow_hyphen_values = true)]
    mass: Option<f64>,

    /// Alignment [default: time where the motions are the same, else velocity]
    #[arg(long, value_name = "BY", value_parser = one_of([("time", AlignedBy::Time), ("velocity", AlignedBy::Velocity)]))]
    align: Option<AlignedBy>,

    /// Plot: an image, or a page with the levels
    #[arg(long, value_name = "FILE.svg|.html")]
    plot: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    let usage = |error: &dyn std::fmt::Display| Failure::Usage(error.to_string());
    let plot = arguments.plot.as_deref();
    let format = plot.map(PlotFormat::of).transpose().map_err(|error| usage(&error))?;
    if let Some(mass) = arguments.mass.filter(|mass| !(0.0..=1000.0).contains(mass)) {
        return Err(Failure::Usage(format!(
            "mass = {mass} kg is out of range: 0 to 1000 kg"
        )));
    }
    let (real, rendered) = (read(&arguments.real)?, read(&arguments.rendered)?);
    let (mass_kg, assumed) = match (arguments.mass, rendered_mass_kg(&arguments.rendered)) {
        (Some(mass), _) => (Some(mass), None),
        (None, Some(block_kg)) => {
            let (mass_kg, note) = assumed_mass(&real.record, block_kg);
            (mass_kg, Some(note))
        }
        (None, None) => {
            let note = "the mass is not known: its inertia is left in both forces; --mass takes it out";
            (None, Some(note.to_owned()))
        }
    };
    let options = Options {
        mass_kg: mass_kg.filter(|mass| *mass > 0.0),
        align: arguments.align,
    };
    let mut comparison = compare::compare(&real.record, &rendered.record, &options)
        .map_err(|error| Failure::NotComparable(error.to_string()))?;
    comparison.notes.extend(assumed);
    for (side, loaded) in [("real", &real), ("rendered", &rendered)] {
        let of_side = loaded.notes.iter().map(|note| format!("{side}: {note}"));
        comparison.notes.extend(of_side);
    }
    if let (Some(path), Some(format)) = (plot, format) {
        let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let names = [name(&arguments.real), name(&arguments.rendered)];
        compare::page(&comparison, names.each_ref().map(String::as_str))
            .write(path, format)
            .map_err(|error| Failure::File(format!("{}: {error}", path.display())))?;
    }
    if as_json {
        return output::json(&json!(comparison));
    }
    output::line(&compare::summary(&comparison))?;
    output::line(&output::table(&compare::table(&comparison).rows))?;
    for note in &comparison.notes {
        output::line(&format!("note: {note}"))?;
    }
    Ok(())
}

fn read(path: &Path) -> Result<Loaded, Failure> {
    let loaded = record_file::read(&Source::new(path)).map_err(|error| Failure::Usage(reason(&error)))?;
    loaded
        .record
        .check()
        .map_err(|error| Failure::Usage(format!("{}: {error}", path.display())))?;
    Ok(loaded)
}

/// Why a record is not read. No option names the columns of a table, as there are two of them.
fn reason(error: &RecordFileError) -> String {
    match error {
        RecordFileError::Table(error @ TableError::MissingColumn { path, what, .. }) if what.contains("force") => {
            format!(
                "{}. compare needs the force in both records; `haptic-ctl simulate SCENE --motion {}` computes it along \
                 a motion that was recorded without one",
                error.by_heading(),
                quoted(path)
            )
        }
        RecordFileError::Table(error) => error.by_heading(),
        error => error.to_string(),
    }
}

/// The mass of the block that was rendered, kg, where the record is a recording.
fn rendered_mass_kg(path: &Path) -> Option<f64> {
    let reader = haptic_recording::open(path).ok()?;
    Some(reader.metadata().scene.block?.mass)
}

/// The mass whose inertia is taken out where none is given, kg, and why: that of the rendered block, unless the real
/// record shows another.
fn assumed_mass(real: &Record, block_kg: f64) -> (Option<f64>, String) {
    /// Masses that differ by less than this share beyond the interval count as the same.
    const ALIKE: f64 = 0.05;
    // What another shift of the clocks would change is of no interest here.
    let options = identify::Options {
        clocks: Clocks::One,
        ..identify::Options::new(ModelKind::Karnopp)
    };
    let found = identify::identify(real, &options).ok();
    let interval = found.and_then(|found| found.intervals.get("mass_kg").copied());
    match interval {
        Some([low, high]) if !((1.0 - ALIKE) * low..=(1.0 + ALIKE) * high).contains(&block_kg) => (
            None,
            format!(
                "the real mass is {low:.3} to {high:.3} kg, the rendered block {block_kg:.3} kg: inertia is left in \
                 both forces; --mass takes that of one mass out of both"
            ),
        ),
        Some(_) => (
            Some(block_kg),
            format!(
                "the inertia of {block_kg:.3} kg, the mass of the rendered block and of the real record, is taken out"
            ),
        ),
        None => (
            Some(block_kg),
            format!(
                "the inertia of {block_kg:.3} kg, the mass of the rendered block, is taken out of both forces: the \
                 real record does not show its mass, which --mass gives"
            ),
        ),
    }
}
