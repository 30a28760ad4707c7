//! Metadata of a subject's trials, in a file of their name, as Psych-DS has it: what is known of the subject's screen.

use super::super::screen::{HOW_MEASURED, ScreenSummary};
use super::super::trial::{FittsTrial, Trial};
use serde_json::{Value, json};

/// The metadata of trials; none where no screen was measured.
pub(super) fn of_trials(name: &str, trials: &[FittsTrial]) -> Option<Value> {
    let screen = ScreenSummary::of(trials)?;
    let mut variables: Vec<Value> = Vec::new();
    for column in FittsTrial::names() {
        let (value, unit, what) = match column {
            "cursor_latency_s" => (Some(screen.cursor_latency_s), "s", "median of the trials' medians"),
            "cursor_latency_p95_s" => (
                Some(screen.cursor_latency_p95_s),
                "s",
                "median of the trials' 95th percentiles",
            ),
            "frame_rate_hz" => (
                screen.frame_rate_hz,
                "Hz",
                "frames a second of the subject's screen: median of the trials'",
            ),
            _ => (None, "", ""),
        };
        variables.push(match value {
            None => json!(column),
            Some(value) => json!({
                "@type": "PropertyValue",
                "name": column,
                "value": value,
                "unitText": unit,
                "description": what,
                "measurementTechnique": HOW_MEASURED,
            }),
        });
    }
    Some(json!({
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": name,
        "description": format!("What was measured of the subject's screen in {} trials", screen.trials),
        "variableMeasured": variables,
    }))
}
