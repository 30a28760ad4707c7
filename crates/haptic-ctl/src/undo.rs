//! `undo` and `redo`: back and forth through the changes of all clients.

use crate::change::{self, How, Shown};
use crate::daemon::Daemon;
use crate::failure::Failure;
use haptic_ipc::{ChangeReply, Request};

pub(crate) fn undo(how: &How) -> Request {
    Request::Undo {
        if_revision: how.if_revision,
        ramp_ms: how.ramp_ms(),
        dry_run: how.dry_run,
    }
}

pub(crate) fn redo(how: &How) -> Request {
    Request::Redo {
        if_revision: how.if_revision,
        ramp_ms: how.ramp_ms(),
        dry_run: how.dry_run,
    }
}

pub(crate) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: ChangeReply = daemon.ask(request).await?;
    change::show(&reply, Shown::Differences, json)
}
