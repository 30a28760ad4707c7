//! The client that sent a request.

use haptic_ipc::Peer;

/// A client, as the journal and the history know it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Requester<'a> {
    pub(super) session: u64,
    pub(super) peer: &'a Peer,
}
