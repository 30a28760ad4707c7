//! The client that sent a request.

use haptic_ipc::Peer;

/// A client, as the journal and the history know it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Requester<'a> {
    pub(crate) session: u64,
    pub(crate) peer: &'a Peer,
}
