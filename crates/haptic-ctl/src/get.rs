//! `get`: the scene in force.

use crate::failure::Failure;
use crate::{Daemon, output};
use haptic_ipc::{Description, Request, SceneReply};

pub(crate) async fn run(daemon: &mut Daemon, json: bool) -> Result<(), Failure> {
    let reply: SceneReply = daemon.ask(Request::get()).await?;
    if json {
        return output::json(&reply);
    }
    // The table has the order, the symbols and the units; the values are those of the one answer.
    let description: Description = daemon.ask(Request::Describe {}).await?;
    let rows: Vec<Vec<String>> = description
        .parameters
        .iter()
        .filter_map(|row| {
            let value = output::directional(*reply.params.get(&row.name)?);
            Some(vec![row.name.clone(), row.symbol.clone(), value, row.unit.clone()])
        })
        .collect();
    output::line(&format!(
        "{} (revision {})\n{}",
        reply.scene.name,
        reply.revision,
        output::table(&rows)
    ))
}
