//! `scene list`: the library.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_ipc::{Request, SceneListReply};

pub(super) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: SceneListReply = daemon.ask(request).await?;
    if json {
        return output::json(&reply);
    }
    let mut rows = vec![["name", "law", "title", "file"].map(str::to_owned).to_vec()];
    rows.extend(reply.scenes.iter().map(|scene| {
        vec![
            scene.name.clone(),
            scene.law.clone(),
            scene
                .problem
                .as_ref()
                .map_or_else(|| scene.title.clone(), |_| "cannot be loaded".to_owned()),
            scene.path.clone().unwrap_or_else(|| "built in".to_owned()),
        ]
    }));
    output::line(&output::table(&rows))?;
    // Below the table, which no broken file makes wider.
    for scene in &reply.scenes {
        if let Some(problem) = &scene.problem {
            output::line(&format!("\n{} cannot be loaded: {problem}", scene.name))?;
        }
    }
    Ok(())
}
