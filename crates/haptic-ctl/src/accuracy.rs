//! `accuracy`: what each scheme costs and how far it is from the true motion, on easy and hard scenes.

use crate::failure::Failure;
use crate::output;
use clap::Args;
use haptic_lab::accuracy::{self, Measurement, cases};
use serde_json::{Value, json};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Where to write accuracy.csv, accuracy.json and accuracy.html, a page with a plot
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    let mut measurements = Vec::new();
    if !as_json {
        output::line(&row([
            "case",
            "scheme",
            "ns a tick",
            "position m",
            "force N",
            "events s",
            "energy J",
        ]
        .map(str::to_owned)))?;
    }
    for case in cases::of_karnopp() {
        let measured = accuracy::measure(&case).map_err(|error| Failure::Usage(format!("{}: {error}", case.name)))?;
        for measurement in &measured {
            if !as_json {
                output::line(&row(cells(measurement)))?;
            }
        }
        measurements.extend(measured);
    }
    let values: Value = measurements.iter().map(value).collect();
    if let Some(directory) = &arguments.out {
        write(directory, &measurements, &values)
            .map_err(|error| Failure::Usage(format!("{}: {error}", directory.display())))?;
    }
    if as_json { output::json(&values) } else { Ok(()) }
}

fn cells(measurement: &Measurement) -> [String; 7] {
    let error = &measurement.error;
    [
        measurement.case.to_owned(),
        measurement.scheme.to_string(),
        format!("{:.1}", measurement.cost.median_ns),
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

fn row([case, scheme, cost, position, force, events, energy]: [String; 7]) -> String {
    format!("{case:26} {scheme:12} {cost:>10} {position:>11} {force:>9} {events:>9} {energy:>9}")
}

fn value(measurement: &Measurement) -> Value {
    let error = &measurement.error;
    json!({
        "case": measurement.case,
        "scheme": measurement.scheme.to_string(),
        "tick_ns_median": measurement.cost.median_ns,
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
