//! `reload`: has the daemon read its configuration again.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_ipc::{ReloadReply, Request};

/// For the help text.
pub(crate) const HELP: &str = "\
Force flows on. Only limits take effect: a higher limit of force along the ramp of engaging (`ramp-ms`); a lower one lets no force \
grow beyond it at once, and takes a force that is beyond it down to it within that time, at most 200 ms. Options that need a restart are \
named. Nothing changes where any value of the file is wrong.

Scenes of the library are read whenever they are loaded; here files that hold none are named. The active scene never changes by itself.

A SIGHUP to a daemon without a terminal does the same, as does `systemctl reload hapticd`.";

pub(crate) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: ReloadReply = daemon.ask(request).await?;
    if json {
        return output::json(&reply);
    }
    output::unless_quiet(&reply.to_string().replace("; ", "\n"))?;
    match &reply.changed_scene {
        Some(name) => output::unless_quiet(&format!("to feel it: haptic-ctl scene load {name}")),
        None => Ok(()),
    }
}
