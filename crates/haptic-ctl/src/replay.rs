//! `replay`: a recording's forces again, to the last bit, or those of another scene.

use crate::failure::Failure;
use crate::output::count;
use crate::recording::unreadable;
use crate::scene::offline;
use crate::table_file::{self, TableFile};
use crate::units::duration;
use crate::{complete, output, progress, set};
use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use haptic_core::Scheme;
use haptic_ipc::{Sample, SampleY, WireError};
use haptic_lab::replay::{self, Alternative, LargestDifference, Report, Summary, Tally, WhatIf, WhatIfRow};
use haptic_lab::row::RecordedRow;
use haptic_recording::{Ending, Entry, Metadata, Reader, RecordingError};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

pub(crate) const HELP: &str = "\
A recording holds a snapshot of the servo before its first row, after every gap and every ten seconds.

With --scene, --set or --scheme the hand moves as recorded, and does not react to the other force. A built-in \
scene, or a file, with coupling = \"rig\" has the coupling of the recording's first scene.

Examples:
  haptic-ctl replay rig.mcap
  haptic-ctl replay rig.mcap --set Fs=6 --out felt.csv";

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Recording, with every tick
    file: PathBuf,

    /// Begin at the last snapshot before a time since the first row, as in 12m30s
    #[arg(long, value_name = "TIME", value_parser = duration, allow_hyphen_values = true)]
    from: Option<Duration>,

    /// Render another scene: NAME, @REVISION or FILE.toml
    #[arg(long, value_name = "SCENE", add = ArgValueCompleter::new(complete::scenes))]
    scene: Option<String>,

    /// Render with another value of a parameter, as for `set`; repeatable
    #[arg(long, value_name = "NAME=VALUE", add = ArgValueCompleter::new(complete::assignments))]
    set: Vec<String>,

    /// Render with another scheme: exact, implicit, literal or literal:N
    #[arg(long, value_name = "SCHEME")]
    scheme: Option<Scheme>,

    /// Output: both forces, one row a tick
    #[arg(long, value_name = "OUT.csv")]
    out: Option<PathBuf>,

    /// Replace an existing file
    #[arg(long, requires = "out")]
    force: bool,
}

impl Arguments {
    /// The entries from the time on that was asked for.
    fn entries<'a>(&self, reader: &'a mut Reader) -> impl Iterator<Item = Result<Entry, RecordingError>> + use<'a> {
        replay::from(reader, self.from.unwrap_or_default().as_secs_f64())
    }

    fn is_what_if(&self) -> bool {
        self.scene.is_some() || !self.set.is_empty() || self.scheme.is_some()
    }
}

pub(crate) async fn run(socket: Option<&Path>, arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    if !arguments.is_what_if() {
        if arguments.out.is_some() {
            let why = "--out writes what would have been felt: name --scene, --set or --scheme";
            return Err(Failure::Usage(why.to_owned()));
        }
        return compare(arguments, as_json);
    }
    let scene = match &arguments.scene {
        Some(text) => Some(offline::find_file(socket, text).await?),
        None => None,
    };
    let alternative = Alternative {
        scene,
        changes: changes(&arguments.set)?,
        scheme: arguments.scheme,
    };
    what_if(arguments, alternative, as_json)
}

fn changes(texts: &[String]) -> Result<Vec<(haptic_core::ParameterKey, f64)>, Failure> {
    let change = |text: &String| {
        let (name, value) = set::assignment(text)?;
        let key = name
            .parse()
            .map_err(|error| Failure::Usage(WireError::from(error).message))?;
        Ok((key, value))
    };
    texts.iter().map(change).collect()
}

fn unreplayable(path: &Path) -> impl Fn(replay::ReplayError) -> Failure {
    move |error| {
        let remedy = match &error {
            replay::ReplayError::Recording(error) => error.remedy(),
            _ => "",
        };
        Failure::BadRecording(format!("{}: {error}{remedy}", path.display()))
    }
}

fn open(path: &Path) -> Result<(Reader, Metadata), Failure> {
    let reader = haptic_recording::open_any(path).map_err(|error| unreadable(path, &error))?;
    let metadata = reader.metadata().clone();
    Ok((reader, metadata))
}

fn compare(arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    let path = &arguments.file;
    let (mut reader, metadata) = open(path)?;
    let began = Instant::now();
    let bar = progress::busy("replaying");
    let report = replay::replay(&metadata, arguments.entries(&mut reader)).map_err(unreplayable(path));
    bar.finish_and_clear();
    let report = report?;
    if let (0, Some(from)) = (report.ticks, arguments.from) {
        return Err(Failure::Usage(format!(
            "--from = {} s: {} has no row so late; `haptic-ctl recording info` shows its length",
            from.as_secs_f64(),
            path.display()
        )));
    }
    let ticks_per_s = rate(report.ticks, began);
    let ending = reader.ending().unwrap_or(Ending::Open);
    if as_json {
        let mut object = serde_json::to_value(&report).map_err(std::io::Error::other)?;
        object["compared"] = report.compared().into();
        object["ending"] = ending.to_string().into();
        object["ticks_per_s"] = ticks_per_s.into();
        output::json(&object)?;
    } else {
        show(path, &report, ending, ticks_per_s)?;
    }
    if report.is_exact() {
        Ok(())
    } else {
        Err(Failure::Silent(1))
    }
}

fn rate(ticks: u64, began: Instant) -> f64 {
    (ticks as f64 / began.elapsed().as_secs_f64().max(1e-9)).round()
}

fn show(path: &Path, report: &Report, ending: Ending, ticks_per_s: f64) -> Result<(), Failure> {
    output::text(&format!(
        "{}: {} ticks, {} compared ({} with force), {} of them differ",
        path.display(),
        report.ticks,
        report.compared(),
        report.with_force,
        report.differing
    ))?;
    if let Some(first) = &report.first_differing {
        output::text(&format!(
            "first at tick {} ({:.6} s): {} is recorded as {}, and computed as {}\n  {}",
            first.tick, first.t_s, first.column, first.recorded, first.computed, first.likely
        ))?;
    }
    for one in &report.uncompared {
        output::text(&format!(
            "{} from tick {} on not compared: {}",
            count(one.ticks, "tick"),
            one.first_tick,
            one.reason
        ))?;
    }
    if ending != Ending::Complete {
        output::text(&format!("the recording is {ending}"))?;
    }
    if report.compared() == 0 {
        output::text("nothing was compared: nothing follows from what the recording holds")?;
    }
    output::text(&format!("{ticks_per_s} ticks a second"))
}

fn what_if(arguments: &Arguments, alternative: Alternative, as_json: bool) -> Result<(), Failure> {
    let path = &arguments.file;
    let (mut reader, metadata) = open(path)?;
    let mut out = arguments
        .out
        .as_deref()
        .map(|out| Forces::create(out, path, metadata.axes, arguments.force))
        .transpose()?;
    let began = Instant::now();
    let bar = progress::busy("replaying");
    let mut what_if = WhatIf::new(&metadata, alternative).map_err(unreplayable(path))?;
    for entry in arguments.entries(&mut reader) {
        let felt = what_if
            .entry(&entry.map_err(|error| unreadable(path, &error))?)
            .map_err(unreplayable(path))?;
        if let (Some(felt), Some(out)) = (felt, &mut out) {
            out.write(&felt)?;
        }
    }
    if let Some(out) = out {
        out.0.finish()?;
    }
    bar.finish_and_clear();
    let summary = what_if.summary();
    if summary.ticks == summary.not_computed {
        return Err(Failure::BadRecording(format!(
            "{}: no force follows from any of its {} rows",
            path.display(),
            summary.ticks
        )));
    }
    if as_json {
        return output::json(&what_if_json(&summary, rate(summary.ticks, began)));
    }
    show_what_if(path, &summary)
}

fn what_if_json(summary: &Summary, ticks_per_s: f64) -> Value {
    let tally = |tally: &Tally| {
        json!({
            "ticks": tally.ticks,
            "rms_force_N": tally.rms_force_n(),
            "peak_force_N": tally.peak_force_n,
            "breakaways": tally.breakaways,
            "stops": tally.stops,
            "stuck_s": tally.stuck_s,
            "energy_J": tally.energy_j,
        })
    };
    json!({
        "ticks": summary.ticks,
        "not_computed": summary.not_computed,
        "recorded": tally(&summary.recorded),
        "what_if": tally(&summary.what_if),
        "largest_difference": summary.largest_difference,
        "ticks_per_s": ticks_per_s,
    })
}

fn show_what_if(path: &Path, summary: &Summary) -> Result<(), Failure> {
    let Summary {
        recorded,
        what_if,
        largest_difference,
        ..
    } = summary;
    let row = |name: &str, cell: &dyn Fn(&Tally) -> String| vec![name.to_owned(), cell(recorded), cell(what_if)];
    let rows = [
        output::row(["", "recorded", "what if"]),
        row("ticks with force", &|tally| tally.ticks.to_string()),
        row("rms force, N", &|tally| format!("{:.4}", tally.rms_force_n())),
        row("peak force, N", &|tally| format!("{:.4}", tally.peak_force_n)),
        row("breakaways", &|tally| tally.breakaways.to_string()),
        row("stops", &|tally| tally.stops.to_string()),
        row("time stuck, s", &|tally| format!("{:.3}", tally.stuck_s)),
        row("work of the hand, J", &|tally| format!("{:.4}", tally.energy_j)),
    ];
    output::text(&format!("{}: {} ticks", path.display(), summary.ticks))?;
    output::text(&output::table(&rows))?;
    if let Some(LargestDifference {
        tick,
        t_s,
        recorded_n,
        what_if_n,
        recorded_y_n,
        what_if_y_n,
    }) = largest_difference
    {
        let recorded = force(*recorded_n, *recorded_y_n);
        let instead = force(*what_if_n, *what_if_y_n);
        output::text(&format!(
            "they differ most at tick {tick} ({t_s:.6} s): {recorded} recorded, {instead} instead"
        ))?;
    } else {
        output::text("both forces are the same in every tick")?;
    }
    if summary.not_computed > 0 {
        output::text(&format!(
            "{} not computed: the servo's state does not follow from the recording there",
            count(summary.not_computed, "tick")
        ))?;
    }
    output::text("the motion is the recorded one: the hand does not react to the other force")
}

/// A force on the hand, of two axes by its parts.
fn force(x_n: f64, y_n: Option<f64>) -> String {
    match y_n {
        None => format!("{x_n:.4} N"),
        Some(y_n) => format!("({x_n:.4}, {y_n:.4}) N"),
    }
}

struct Forces<'a>(TableFile<'a>);

impl<'a> Forces<'a> {
    fn create(path: &'a Path, recording: &Path, axes: u8, replace: bool) -> Result<Self, Failure> {
        table_file::refuse_overwriting(path, [recording].into_iter())?;
        let mut forces = Self(TableFile::create(path, replace)?);
        let second_axis = match axes {
            2 => {
                ",device_position_y_m,device_velocity_y_mps,recorded_force_y_N,what_if_force_y_N,\
                 what_if_block_position_y_m,what_if_block_velocity_y_mps"
            }
            _ => "",
        };
        forces.0.line(format_args!(
            "tick,t_s,device_position_m,device_velocity_mps,recorded_force_N,what_if_force_N,recorded_contact,\
             what_if_contact,what_if_block_position_m,what_if_block_velocity_mps{second_axis}"
        ))?;
        Ok(forces)
    }

    /// Writes a row; cells of what does not follow are empty.
    fn write(&mut self, WhatIfRow { recorded, what_if }: &WhatIfRow) -> Result<(), Failure> {
        let text = |number: Option<f64>| number.map_or_else(String::new, |number| number.to_string());
        let cell = |of: fn(&Sample) -> f64| text(what_if.as_ref().map(|row| of(&row.sample)));
        let contact = what_if.map_or_else(String::new, |row| row.sample.contact.to_string());
        let RecordedRow { sample, y } = recorded;
        let second_axis = y.map_or_else(String::new, |y| {
            let cell = |of: fn(&SampleY) -> f64| text(what_if.and_then(|row| row.y).as_ref().map(of));
            format!(
                ",{},{},{},{},{},{}",
                y.device_position_m,
                y.device_velocity_mps,
                y.command_force_n,
                cell(|y| y.command_force_n),
                cell(|y| y.block_position_m),
                cell(|y| y.block_velocity_mps),
            )
        });
        self.0.line(format_args!(
            "{},{},{},{},{},{},{},{contact},{},{}{second_axis}",
            sample.tick,
            sample.t_s,
            sample.device_position_m,
            sample.device_velocity_mps,
            sample.command_force_n,
            cell(|row| row.command_force_n),
            sample.contact,
            cell(|row| row.block_position_m),
            cell(|row| row.block_velocity_mps),
        ))
    }
}
