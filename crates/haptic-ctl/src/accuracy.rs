//! `accuracy`: what each scheme costs and how far it is from the true motion, on easy and hard
//! scenes.

use crate::failure::Failure;
use crate::{output, progress};
use haptic_lab::accuracy::{self, Extent, LawMeasurement, Measurement, PlaneMeasurement, cases};
use serde_json::{Value, json};

pub(crate) fn run(as_json: bool) -> Result<(), Failure> {
    let cases = measured_cases(as_json)?;
    let laws = measured_laws()?;
    let plane = accuracy::measure_plane(None).map_err(|error| Failure::Usage(error.to_string()))?;
    if as_json {
        return output::json(&json!({
            "laws": laws.iter().map(law_value).collect::<Value>(),
            "cases": cases.iter().map(value).collect::<Value>(),
            "plane": plane.iter().map(plane_value).collect::<Value>(),
        }));
    }
    output::line("")?;
    show_laws(&laws)?;
    output::line("")?;
    show_plane(&plane)
}

fn measured_cases(as_json: bool) -> Result<Vec<Measurement>, Failure> {
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
    let cases = cases::all();
    let bar = progress::steps(cases.len());
    for case in cases {
        bar.set_message(case.name.clone());
        let measured =
            accuracy::measure(&case, None).map_err(|error| Failure::Usage(format!("{}: {error}", case.name)))?;
        bar.inc(1);
        for measurement in &measured {
            if !as_json {
                bar.suspend(|| output::line(&row(cells(measurement))))?;
            }
        }
        measurements.extend(measured);
    }
    bar.finish_and_clear();
    Ok(measurements)
}

fn measured_laws() -> Result<Vec<LawMeasurement>, Failure> {
    let bar = progress::busy("laws under hands");
    let measured = accuracy::measure_laws(Extent::REPORT, None, |law| bar.set_message(law.to_owned()));
    bar.finish_and_clear();
    measured.map_err(|error| Failure::Usage(error.to_string()))
}

fn show_laws(laws: &[LawMeasurement]) -> Result<(), Failure> {
    let header = [
        "law",
        "scheme",
        "hand",
        "block",
        "median N",
        "breakaway N",
        "reversal N",
        "worst N",
        "at bound",
        "their worst N",
        "changes",
        "median ns",
        "dearest ns",
    ];
    let mut rows = vec![output::row(header)];
    rows.extend(laws.iter().map(|one| {
        let e = &one.errors;
        let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.0}"));
        vec![
            one.law.to_owned(),
            one.scheme.to_string(),
            one.hand.to_owned(),
            match one.mass_kg {
                Some(mass) => format!("{mass} kg"),
                None if one.is_on_device() => "on the device".to_owned(),
                None => "any".to_owned(),
            },
            format!("{:.0e}", e.median_n),
            format!("{:.0e}", e.breakaway_n),
            format!("{:.0e}", e.reversal_n),
            format!("{:.0e}", e.worst_n),
            e.at_bound.to_string(),
            format!("{:.0e}", e.at_bound_worst_n),
            e.same_changes
                .map_or("-", |same| if same { "same" } else { "others" })
                .to_owned(),
            number(one.cost.map(|cost| cost.median_ns)),
            number(one.cost.map(|cost| cost.dearest_ns)),
        ]
    }));
    output::line(&output::table(&rows))
}

/// The block in the plane along four motions.
fn show_plane(plane: &[PlaneMeasurement]) -> Result<(), Failure> {
    let header = ["in the plane", "tick", "median N", "worst N", "median ns", "dearest ns"];
    let mut rows = vec![output::row(header)];
    rows.extend(plane.iter().map(|one| {
        vec![
            one.case.to_owned(),
            one.scheme.to_string(),
            format!("{:.0e}", one.median_n),
            format!("{:.0e}", one.worst_n),
            format!("{:.0}", one.cost.median_ns),
            format!("{:.0}", one.cost.dearest_ns),
        ]
    }));
    output::line(&output::table(&rows))
}

fn plane_value(one: &PlaneMeasurement) -> Value {
    json!({
        "motion": one.case,
        "scheme": one.scheme.to_string(),
        "force_error_median_N": one.median_n,
        "force_error_worst_N": one.worst_n,
        "tick_ns_median": one.cost.median_ns,
        "tick_ns_dearest": one.cost.dearest_ns,
    })
}

fn law_value(one: &LawMeasurement) -> Value {
    let e = &one.errors;
    json!({
        "law": one.law,
        "scheme": one.scheme.to_string(),
        "hand": one.hand,
        "mass_kg": one.mass_kg,
        "on_device": one.is_on_device(),
        "ticks": e.ticks,
        "force_error_median_N": e.median_n,
        "force_error_breakaway_N": e.breakaway_n,
        "force_error_reversal_N": e.reversal_n,
        "force_error_worst_N": e.worst_n,
        "ticks_at_bound": e.at_bound,
        "force_error_at_bound_N": e.at_bound_worst_n,
        "same_contact_changes": e.same_changes,
        "reference_error_N": e.uncertainty_n,
        "tick_ns_median": one.cost.map(|cost| cost.median_ns),
        "tick_ns_dearest": one.cost.map(|cost| cost.dearest_ns),
    })
}

fn cells(measurement: &Measurement) -> [String; 7] {
    let error = &measurement.error;
    [
        measurement.case.clone(),
        measurement.scheme.to_string(),
        format!("{:.1}", measurement.cost.median_ns),
        if measurement.blew_up {
            "blew up".to_owned()
        } else {
            format!("{:.1e}", error.position_m)
        },
        format!("{:.1e}", error.force_n),
        measurement.events_text(),
        format!("{:.1e}", measurement.energy_created_j),
    ]
}

fn row([case, scheme, cost, position, force, events, energy]: [String; 7]) -> String {
    format!("{case:36} {scheme:12} {cost:>10} {position:>11} {force:>9} {events:>9} {energy:>9}")
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
