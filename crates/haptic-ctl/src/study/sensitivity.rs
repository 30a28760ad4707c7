//! `study sensitivity`: which constants of the simulated operator turn the result of a study.

use super::plan;
use crate::failure::Failure;
use crate::{output, progress};
use clap::Args;
use haptic_studies::operator::{Constants, OperatorError};
use haptic_studies::sensitivity::{Measure, Variation, measure, variations, vary};
use serde_json::{Map, Value, json};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Plan: fitts, perception, or a PLAN.toml
    #[arg(value_name = "PLAN")]
    plan: String,

    /// Number of subjects of each study
    #[arg(long, value_name = "N", default_value = "2", value_parser = clap::value_parser!(u32).range(1..=999))]
    subjects: u32,

    /// Seed of the studies
    #[arg(long, value_name = "S", default_value = "1")]
    seed: u64,
}

pub(crate) fn run(arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    let (plan, _) = plan::read(&arguments.plan)?;
    let (seed, subjects) = (arguments.seed, arguments.subjects);
    let failed = |error: OperatorError| Failure::Usage(error.to_string());
    let usual = measure(&plan, &Constants::default(), seed, subjects).map_err(failed)?;
    let all: Vec<(&str, f64)> = variations().collect();
    let bar = progress::steps(all.len());
    let mut varied = Vec::new();
    for (name, value) in all {
        bar.set_message(format!("{name} = {value}"));
        varied.push(vary(&plan, name, value, seed, subjects).map_err(failed)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    if as_json {
        return output::json(&json!({
            "operator": "simulated",
            "usual": object(&usual),
            "variations": varied.iter().map(|one| json!({
                "name": one.name,
                "value": one.value,
                "measures": one.measures.as_deref().map(object),
            })).collect::<Vec<_>>(),
        }));
    }
    output::text(
        "operator: simulated. Means of the study, and below them their change where one constant is halved or doubled.",
    )?;
    let name = |measure: &Measure| format!("{} {}", measure.of, measure.what);
    for (number, measure) in (1..).zip(&usual) {
        output::text(&format!("  [{number}] {:<30} {:>8.3}", name(measure), measure.value))?;
    }
    let head: String = (1..=usual.len())
        .map(|number| format!("{:>8}", format!("[{number}]")))
        .collect();
    output::text(&format!("{:<34}{head}", "constant"))?;
    varied.iter().try_for_each(|one| output::text(&line(one, &usual)))
}

/// The change of each measure.
fn line(one: &Variation, usual: &[Measure]) -> String {
    let changes: String = match &one.measures {
        None => "   no valid click within a minute".to_owned(),
        Some(measures) => measures
            .iter()
            .zip(usual)
            .map(|(measure, usual)| format!("{:>+8.3}", measure.value - usual.value))
            .collect(),
    };
    format!("{:<24}{:>10}{changes}", one.name, one.value)
}

fn object(measures: &[Measure]) -> Value {
    let mut object = Map::new();
    for measure in measures {
        object
            .entry(measure.of.clone())
            .or_insert_with(|| json!({}))
            .as_object_mut()
            .map(|inner| inner.insert(measure.what.to_owned(), json!(measure.value)));
    }
    Value::Object(object)
}
