//! `describe`: the scene's law and its parameters.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_core::friction::Friction;
use haptic_ipc::{Description, Request};

pub(crate) async fn run(daemon: &mut Daemon, json: bool) -> Result<(), Failure> {
    let description: Description = daemon.ask(Request::Describe {}).await?;
    if json {
        return output::json(&description);
    }
    let mut rows = vec![
        [
            "parameter",
            "symbol",
            "value",
            "unit",
            "accepted",
            "directions",
            "a larger value feels like",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    rows.extend(description.parameters.iter().map(|row| {
        vec![
            row.name.clone(),
            row.symbol.clone(),
            output::directional(row.value),
            row.unit.clone(),
            format!("{} .. {}", row.min, row.max),
            if row.directional {
                format!("{0}+ {0}-", row.symbol)
            } else {
                String::new()
            },
            row.feel.clone(),
        ]
    }));
    let summary = Friction::summary(&description.law).map_or_else(String::new, |summary| format!(": {summary}"));
    output::line(&format!("law {}{summary}\n\n{}", description.law, output::table(&rows)))
}
