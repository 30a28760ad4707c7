//! `accuracy`: what each scheme costs and how far it is from the true motion, on easy and hard
//! scenes.

use crate::cost;
use crate::failure::Failure;
use crate::{output, progress};
use clap::Args;
use haptic_lab::accuracy::{self, Measurement, Target, cases};
use haptic_lab::cost::Probe;
use serde_json::{Value, json};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Directory for accuracy.csv, accuracy.json and accuracy.html, a page with a plot
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Show only the targets of the exact scheme, and what it reaches here
    #[arg(long, conflicts_with = "out")]
    targets: bool,
}

pub(crate) fn run(arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    if arguments.targets {
        let targets = measured_targets()?;
        return if as_json {
            output::json(&target_values(&targets))
        } else {
            show_targets(&targets)
        };
    }
    let counted = cost::count(Probe::Cases)?;
    let mut measurements = Vec::new();
    if !as_json {
        output::line(&row([
            "case",
            "scheme",
            "ns a tick",
            "instructions",
            "position m",
            "force N",
            "events s",
            "energy J",
        ]
        .map(str::to_owned)))?;
    }
    let schemes = accuracy::schemes().len();
    let cases = cases::all();
    let bar = progress::steps(cases.len());
    for (index, case) in cases.into_iter().enumerate() {
        bar.set_message(case.name.clone());
        let counted = counted.as_ref().and_then(|totals| totals.chunks(schemes).nth(index));
        let measured =
            accuracy::measure(&case, counted).map_err(|error| Failure::Usage(format!("{}: {error}", case.name)))?;
        bar.inc(1);
        for measurement in &measured {
            if !as_json {
                bar.suspend(|| output::line(&row(cells(measurement))))?;
            }
        }
        measurements.extend(measured);
    }
    bar.finish_and_clear();
    let values: Value = measurements.iter().map(value).collect();
    if let Some(directory) = &arguments.out {
        write(directory, &measurements, &values)
            .map_err(|error| Failure::Usage(format!("{}: {error}", directory.display())))?;
    }
    if as_json {
        return output::json(&values);
    }
    output::line("")?;
    show_targets(&measured_targets()?)
}

fn measured_targets() -> Result<Vec<Target>, Failure> {
    let bar = progress::busy("measuring what the exact scheme is held to");
    let targets = accuracy::targets();
    bar.finish_and_clear();
    targets.map_err(|error| Failure::Usage(error.to_string()))
}

fn show_targets(targets: &[Target]) -> Result<(), Failure> {
    let mut rows = vec![
        ["target of the exact scheme", "to be", "measured", ""]
            .map(str::to_owned)
            .to_vec(),
    ];
    rows.extend(targets.iter().map(|target| {
        vec![
            target.what.to_owned(),
            target.target.to_owned(),
            target.measured.clone(),
            if target.met { String::new() } else { "MISSED".to_owned() },
        ]
    }));
    output::line(&output::table(&rows))
}

fn target_values(targets: &[Target]) -> Value {
    targets
        .iter()
        .map(|target| {
            json!({
                "what": target.what,
                "target": target.target,
                "measured": target.measured,
                "met": target.met,
            })
        })
        .collect()
}

fn cells(measurement: &Measurement) -> [String; 8] {
    let error = &measurement.error;
    [
        measurement.case.clone(),
        measurement.scheme.to_string(),
        format!("{:.1}", measurement.cost.median_ns),
        measurement
            .instructions
            .map_or_else(|| "-".to_owned(), |count| format!("{count:.0}")),
        if measurement.blew_up {
            "blew up".to_owned()
        } else {
            format!("{:.1e}", error.position_m)
        },
        format!("{:.1e}", error.force_n),
        error
            .event_time_s
            .map_or_else(|| "others".to_owned(), |time| format!("{time:.1e}")),
        format!("{:.1e}", measurement.energy_created_j),
    ]
}

fn row([case, scheme, cost, instructions, position, force, events, energy]: [String; 8]) -> String {
    format!("{case:36} {scheme:12} {cost:>10} {instructions:>12} {position:>11} {force:>9} {events:>9} {energy:>9}")
}

fn value(measurement: &Measurement) -> Value {
    let error = &measurement.error;
    json!({
        "case": measurement.case,
        "scheme": measurement.scheme.to_string(),
        "tick_ns_median": measurement.cost.median_ns,
        "tick_instructions": measurement.instructions,
        "position_error_m": error.position_m,
        "force_error_N": error.force_n,
        "relative_force_error": error.relative_force,
        "event_time_error_s": error.event_time_s,
        "energy_created_J": measurement.energy_created_j,
        "blew_up": measurement.blew_up,
    })
}

fn write(directory: &Path, measurements: &[Measurement], values: &Value) -> std::io::Result<()> {
    std::fs::create_dir_all(directory)?;
    accuracy::write_csv(
        measurements,
        BufWriter::new(File::create(directory.join("accuracy.csv"))?),
    )?;
    std::fs::write(directory.join("accuracy.json"), format!("{values:#}\n"))?;
    std::fs::write(directory.join("accuracy.html"), accuracy::page(measurements))
}
