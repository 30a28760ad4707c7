//! A client that is served, and the answers to its requests.

use super::newcomer::Newcomer;
use crate::control::RigHandle;
use crate::control::change::PendingChange;
use crate::telemetry::subscribers::Line;
use haptic_ipc::{Peer, Rights};
use std::rc::Rc;
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};

/// Clients served at once.
pub(in crate::control) const MAX_CLIENTS: usize = 32;

/// Bytes of a client's requests that may wait to be answered (with the memory of each beside its
/// text), of its changes that may wait to be rendered, and of answers that may wait to be written;
/// a longer one waits alone. The daemon stops reading from a client that pipelines more, some
/// thousand requests, until there is room. All of it is in locked memory.
pub(super) const WAITING_BYTES: usize = 256 * 1024;

/// Room for lines that wait.
pub(super) fn room() -> Arc<Semaphore> {
    Arc::new(Semaphore::new(WAITING_BYTES))
}

/// Waits for room for `bytes`.
pub(super) async fn take_room(room: &Arc<Semaphore>, bytes: usize) -> Option<OwnedSemaphorePermit> {
    let bytes = u32::try_from(bytes.clamp(1, WAITING_BYTES)).ok()?;
    Arc::clone(room).acquire_many_owned(bytes).await.ok()
}

/// A client that is served.
pub(super) struct Client {
    pub(super) rig: Rc<RigHandle>,
    pub(super) lines: mpsc::Sender<Line>,
    /// Room for answers.
    pub(super) unwritten: Arc<Semaphore>,
    /// Room for changes that are not answered yet.
    pub(super) unrendered: Arc<Semaphore>,
    /// Room for events.
    pub(super) events: Arc<Semaphore>,
    pub(super) session: u64,
    pub(super) peer: Peer,
    pub(super) rights: Rights,
    /// It has no place.
    pub(super) newcomer: Option<Rc<Newcomer>>,
}

/// The answer to a change that the real-time thread has yet to render.
pub(super) struct PendingAnswer {
    pub(super) id: u64,
    pub(super) change: PendingChange,
    pub(super) room: Option<OwnedSemaphorePermit>,
}

/// The answer to a request.
pub(super) enum Answer {
    Now(String),
    OnceRendered(PendingAnswer),
}

impl Client {
    /// Queues a line for the client, once there is room for it.
    pub(super) async fn send(&self, text: String) -> Result<(), Closed> {
        let room = take_room(&self.unwritten, text.len()).await;
        self.lines.send(Line { text, room }).await.map_err(|_| Closed)
    }
}

/// The client has closed its connection.
pub(super) struct Closed;
