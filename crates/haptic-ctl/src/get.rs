//! `get`: a scene's parameters.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::scene::reference;
use crate::{complete, output, units};
use clap_complete::engine::ArgValueCompleter;
use haptic_core::parameters::TABLE;
use haptic_ipc::{Request, SceneReply};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Scene: a name of the library, a revision as @42, or a FILE.toml [default: active]
    #[arg(add = ArgValueCompleter::new(complete::scenes))]
    scene: Option<String>,
}

impl Arguments {
    pub(crate) fn request(&self) -> Result<Request, Failure> {
        Ok(Request::Get {
            scene: reference::read_optional(self.scene.as_ref())?,
        })
    }
}

pub(crate) async fn run(
    daemon: &mut Daemon,
    arguments: &Arguments,
    request: Request,
    json: bool,
) -> Result<(), Failure> {
    let reply: SceneReply = reference::ask(daemon, request).await?;
    if json {
        return output::json(&reply);
    }
    let rows: Vec<Vec<String>> = TABLE
        .iter()
        .filter_map(|row| {
            let value = output::directional(*reply.params.get(row.name)?);
            Some(vec![
                row.name.to_owned(),
                row.symbol.to_owned(),
                value,
                units::shown(row.unit).to_owned(),
            ])
        })
        .collect();
    let which = match &arguments.scene {
        None => format!("revision {}", reply.revision),
        Some(scene) => scene.clone(),
    };
    output::line(&format!(
        "{} ({which}, {})\n{}",
        reply.scene.name,
        reply.scene.friction.law(),
        output::table(&rows)
    ))
}
