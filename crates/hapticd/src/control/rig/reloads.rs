//! What is kept of reloads.

use std::cell::RefCell;
use std::sync::Arc;
use tokio::sync::Mutex;

/// What is kept of reloads.
#[derive(Debug, Default)]
pub(in crate::control) struct Reloads {
    /// One at a time.
    pub(in crate::control) turn: Arc<Mutex<()>>,
    /// Why the newest one was refused, if it was.
    pub(in crate::control) refusal: RefCell<Option<String>>,
}
