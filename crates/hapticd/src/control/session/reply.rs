//! The lines that answer requests.

use haptic_ipc::WireError;
use serde::Serialize;

/// An answer, serialised without a tree of values in between: some are long.
#[derive(Serialize)]
struct Reply<T> {
    id: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ok: Option<T>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<WireError>,
}

/// The line that answers a request.
pub(super) fn answer<T: Serialize>(id: Option<u64>, result: Result<T, WireError>) -> String {
    let (ok, error) = match result {
        Ok(ok) => (Some(ok), None),
        Err(error) => (None, Some(error)),
    };
    line(&Reply { id, ok, error })
}

/// A message as a line.
pub(super) fn line(message: &impl Serialize) -> String {
    let mut line = serde_json::to_string(message).expect("messages hold nothing that JSON cannot");
    line.push('\n');
    line
}
