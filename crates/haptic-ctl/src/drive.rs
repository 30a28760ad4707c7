//! `engage`, `release`, `stop`, `reset`: what moves the rig from state to state.

use crate::failure::Failure;
use crate::{Daemon, output};
use haptic_ipc::{Request, StateReply};

pub(crate) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: StateReply = daemon.ask(request).await?;
    if json {
        return output::json(&reply);
    }
    output::line(&format!("{} at tick {}", reply.state, reply.tick))
}
