//! Under which circumstances a recording was made.

use haptic_core::Scene;
use haptic_ipc::ServoSetup;
use serde::{Deserialize, Serialize};

/// Under which circumstances a recording was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metadata {
    /// Name and version of the daemon.
    pub server: String,
    /// What the rig is.
    pub device: String,
    /// Nominal rate of the daemon's loop, Hz.
    pub loop_rate_hz: f64,
    /// Rows a second, Hz: the loop's rate, or less where samples were thinned.
    pub rate_hz: f64,
    /// Program that recorded, with its version, and the user who ran it; absent from an earlier program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recorded_by: Option<String>,
    /// When it began, in seconds since 1970 (UTC).
    pub started_unix_s: f64,
    /// Revision of the scene that was active when it began.
    pub revision: u64,
    /// That scene.
    pub scene: Scene,
    /// What the rows are computed with until a mark says otherwise; absent from an earlier daemon.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub servo: Option<ServoSetup>,
    /// Notes of the person who made it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub notes: Option<String>,
    /// The daemon's whole answer to `status` when it began.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub configuration: Option<serde_json::Value>,
}

/// Who records: a program, with its version, and the user who runs it.
#[must_use]
pub fn recorded_by(program: &str) -> String {
    let user = ["USER", "LOGNAME"]
        .into_iter()
        .find_map(|name| std::env::var(name).ok());
    match user.filter(|user| !user.is_empty()) {
        Some(user) => format!("{program}, {user}"),
        None => program.to_owned(),
    }
}
