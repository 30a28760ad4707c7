//! `undo` and `redo`: back and forth through the changes of all clients.

use crate::change::{Change, ChangeArguments, ChangeView};
use crate::daemon::Daemon;
use crate::failure::Failure;
use haptic_ipc::{ChangeReply, Request};

pub(crate) fn undo(change: &ChangeArguments) -> Request {
    Request::Undo {
        options: change.options(),
    }
}

pub(crate) fn redo(change: &ChangeArguments) -> Request {
    Request::Redo {
        options: change.options(),
    }
}

pub(crate) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let change = Change::prepare(daemon, &request, ChangeView::Differences, json).await?;
    let reply: ChangeReply = daemon.ask(request).await?;
    change.finish(daemon, &reply).await
}
