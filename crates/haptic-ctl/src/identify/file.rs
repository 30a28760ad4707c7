//! `identify FILE`: a record of any laboratory, or a recording of hapticd.

use super::report;
use crate::failure::Failure;
use crate::units::one_of;
use crate::{progress, table_options};
use clap::builder::TypedValueParser;
use haptic_lab::identify::record_file::{self, MovingMass, Source};
use haptic_lab::identify::{self, Clocks, Directions, ModelKind, Options};
use haptic_motion::table::{Columns, TableOptions};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Largest shift of the clocks that may be given, ms.
const MAX_SHIFT_MS: f64 = 1e4;

/// Takes the word of a model.
fn model() -> impl TypedValueParser<Value = ModelKind> {
    one_of(ModelKind::ALL.map(|model| (model.word(), model)))
}

/// Takes how friction is told apart by direction.
fn directions() -> impl TypedValueParser<Value = Directions> {
    one_of([
        ("auto", Directions::Auto),
        ("alike", Directions::Alike),
        ("separate", Directions::Separate),
    ])
}

/// Takes which mass of a recording moves.
fn moving() -> impl TypedValueParser<Value = MovingMass> {
    one_of([
        ("auto", MovingMass::Auto),
        ("block", MovingMass::Block),
        ("device", MovingMass::Device),
    ])
}

/// A shift of the clocks: found by the fit, or known, ms.
#[derive(Clone, Copy, Debug)]
enum ShiftMs {
    Auto,
    Known(f64),
}

impl FromStr for ShiftMs {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        match text.parse::<f64>() {
            Ok(shift_ms) if (-MAX_SHIFT_MS..=MAX_SHIFT_MS).contains(&shift_ms) => Ok(Self::Known(shift_ms)),
            Ok(shift_ms) => Err(format!(
                "{shift_ms} ms is out of range: -{MAX_SHIFT_MS} to {MAX_SHIFT_MS} ms"
            )),
            Err(_) => Err("neither a number of milliseconds nor `auto`".to_owned()),
        }
    }
}

/// What is identified, and what is known of it.
#[derive(Debug, clap::Args)]
pub(super) struct Wanted {
    /// Friction law; auto takes the one that predicts best
    #[arg(long, value_parser = model(), default_value = "karnopp", conflicts_with = "rig")]
    model: ModelKind,

    /// Known mass, kg; then it is not identified
    #[arg(long, value_name = "KG", allow_hyphen_values = true, conflicts_with = "rig")]
    mass: Option<f64>,

    /// Known constant force, N: 0 for a zeroed sensor on a level axis
    #[arg(long, value_name = "N", allow_hyphen_values = true, conflicts_with = "rig")]
    offset: Option<f64>,

    /// Friction by direction; auto separates it where the record shows a difference
    #[arg(long, value_parser = directions(), default_value = "auto", conflicts_with_all = ["offset", "rig"])]
    directions: Directions,
}

/// A record in a file, and how it is read.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Options of the table")]
#[group(id = "of_file")]
pub(super) struct Arguments {
    /// Record of motion and force: CSV, Parquet or a recording
    #[arg(help_heading = "Arguments", value_name = "FILE", required_unless_present_any = ["run", "rig"], conflicts_with_all = ["run", "rig"])]
    file: Option<PathBuf>,

    #[command(flatten)]
    table: table_options::Arguments,

    /// Column of the force that drives the moving mass [default: coupling_force_N, force_N, ...]
    #[arg(long, value_name = "NAME", requires = "file")]
    force_column: Option<String>,

    /// Newtons per unit of the force column, negative for a reversed sensor [default: as its name ends, else 1]
    #[arg(long, value_name = "N", allow_hyphen_values = true, requires = "file")]
    force_gain: Option<f64>,

    /// File of the forces, by a recorder with its own clock
    #[arg(long, value_name = "OTHER.csv", requires = "file")]
    force_file: Option<PathBuf>,

    /// Delay of the force's times behind the position's, ms; `auto` finds it [default: auto for two files and a motor's
    /// force, else 0]
    #[arg(long, value_name = "MS|auto", allow_hyphen_values = true, requires = "file")]
    shift_ms: Option<ShiftMs>,

    /// Moving mass of a recording [default: device for `identify --run`, else block]
    #[arg(
        long,
        value_parser = moving(),
        default_value = "auto",
        hide_default_value = true,
        requires = "file"
    )]
    moving: MovingMass,
}

impl Wanted {
    pub(super) fn options(&self) -> Options {
        Options {
            mass_kg: self.mass,
            offset_n: self.offset,
            directions: self.directions,
            ..Options::new(self.model)
        }
    }
}

impl Arguments {
    pub(super) fn path(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// The files that are read.
    pub(super) fn inputs(&self) -> impl Iterator<Item = &Path> {
        [self.path(), self.force_file.as_deref()].into_iter().flatten()
    }

    fn source(&self, path: &Path) -> Source {
        let table = self.table.options();
        Source {
            path: path.to_path_buf(),
            force_path: self.force_file.clone(),
            table: TableOptions {
                columns: Columns {
                    force: self.force_column.clone(),
                    ..table.columns
                },
                force_gain: self.force_gain,
                ..table
            },
            moving: self.moving,
        }
    }
}

/// Reads and identifies a file.
pub(super) fn run(
    path: &Path,
    arguments: &Arguments,
    wanted: &Wanted,
    output: &report::Arguments,
    json: bool,
) -> Result<(), Failure> {
    let source = arguments.source(path);
    let bar = progress::busy("identifying");
    let usage = |error: &dyn std::fmt::Display| Failure::Usage(error.to_string());
    let loaded = record_file::read(&source).map_err(|error| usage(&error))?;
    let mut options = wanted.options();
    options.offset_n = options.offset_n.or(loaded.offset_n);
    options.clocks = match arguments.shift_ms {
        Some(ShiftMs::Known(shift_ms)) => Clocks::Shifted(1e-3 * shift_ms),
        _ if source.force_path.is_some() => Clocks::Two,
        Some(ShiftMs::Auto) => Clocks::Delayed,
        None => loaded.clocks.unwrap_or_default(),
    };
    let identified = identify::identify_with_progress(&loaded.record, &options, &mut |_| ControlFlow::Continue(()));
    let mut identified = identified.map_err(|error| Failure::Usage(format!("{}: {error}", path.display())))?;
    identified.found.notes.splice(0..0, loaded.notes);
    bar.finish_and_clear();
    let shown = report::show(&identified.found, json);
    output.write(&path.display().to_string(), &identified, json)?;
    shown
}
