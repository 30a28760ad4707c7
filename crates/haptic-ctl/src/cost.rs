//! `cost`: what a tick of each kind of scene costs, in instructions, bytes and nanoseconds.

use crate::failure::Failure;
use crate::{output, progress};
use haptic_lab::cost::{self, CountError, Probe, SceneCost};
use serde_json::{Value, json};

/// The name of the hidden subcommand that callgrind runs.
pub(crate) const PROBE: &str = "measured-ticks";

/// Runs the ticks that are counted, and nothing else.
pub(crate) fn run_probe(probe: Probe) -> Result<(), Failure> {
    probe.run().map_err(|error| Failure::Usage(error.to_string()))
}

/// Counts instructions where valgrind is there, and says so where it is not.
pub(crate) fn count(probe: Probe) -> Result<Option<Vec<u64>>, Failure> {
    let directory = tempfile::tempdir()?;
    match cost::count(
        &std::env::current_exe()?,
        &[PROBE, &probe.to_string()],
        directory.path(),
    ) {
        Ok(totals) => Ok(Some(totals)),
        Err(error @ CountError::NoValgrind) => {
            eprintln!("haptic-ctl: instructions are not counted: {error}");
            Ok(None)
        }
        Err(error) => Err(Failure::Usage(error.to_string())),
    }
}

pub(crate) fn run(as_json: bool) -> Result<(), Failure> {
    let bar = progress::busy("counting instructions");
    let (scenes, excitations) = (count(Probe::Scenes)?, count(Probe::Excitations)?);
    bar.set_message("measuring");
    let mut costs = cost::measure(scenes.as_deref()).map_err(|error| Failure::Usage(error.to_string()))?;
    let excitations = cost::measure_excitations(excitations.as_deref());
    costs.extend(excitations.map_err(|error| Failure::Usage(error.to_string()))?);
    bar.finish_and_clear();
    if as_json {
        let values: Value = costs.iter().map(value).collect();
        return output::json(&values);
    }
    let mut rows = vec![
        ["scene", "bytes of state", "instructions a tick", "ns a tick"]
            .map(str::to_owned)
            .to_vec(),
    ];
    rows.extend(costs.iter().map(|cost| {
        vec![
            cost.scene.to_owned(),
            cost.state_bytes.to_string(),
            cost.instructions
                .map_or_else(|| "-".to_owned(), |count| format!("{count:.0}")),
            format!("{:.1}", cost.median_ns),
        ]
    }));
    output::line(&output::table(&rows))
}

fn value(cost: &SceneCost) -> Value {
    json!({
        "scene": cost.scene,
        "state_bytes": cost.state_bytes,
        "tick_instructions": cost.instructions,
        "tick_ns_median": cost.median_ns,
    })
}
