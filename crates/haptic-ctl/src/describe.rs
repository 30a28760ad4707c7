//! `describe`: the law of a scene, and its parameters.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::scene::offline;
use crate::{complete, output};
use clap_complete::engine::ArgValueCompleter;
use haptic_core::Scene;
use haptic_core::friction::{Friction, LAWS};
use haptic_core::nearest::nearest;
use haptic_ipc::{Description, Request};
use std::path::Path;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Scene: NAME, @REVISION or FILE.toml [default: active]; or a friction law
    #[arg(add = ArgValueCompleter::new(complete::scenes))]
    pub(crate) scene: Option<String>,
}

pub(crate) async fn active(daemon: &mut Daemon, json: bool) -> Result<(), Failure> {
    let description: Description = daemon.ask(Request::Describe {}).await?;
    show(&description, json)
}

/// Describes a scene that is named, or a law with its default values.
pub(crate) async fn named(socket: Option<&Path>, text: &str, json: bool) -> Result<(), Failure> {
    let scene = match (offline::find_on_rig(socket, text).await, Scene::paper().with_law(text)) {
        (Err(_), Some(Ok(of_law))) => of_law,
        (Err(failure), None) => {
            let Some(law) = nearest(text, &LAWS) else {
                return Err(failure);
            };
            return Err(Failure::Usage(format!(
                "there is no law `{text}`, did you mean `{law}`?"
            )));
        }
        (found, _) => found?,
    };
    show(&Description::of(&scene), json)
}

fn show(description: &Description, json: bool) -> Result<(), Failure> {
    if json {
        return output::json(description);
    }
    let feel = "a larger value feels like";
    let head = ["parameter", "symbol", "value", "unit", "accepted", "directions", feel];
    let mut rows = vec![output::row(head)];
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
