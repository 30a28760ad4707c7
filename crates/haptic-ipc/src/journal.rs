//! The journal on the wire: who changed what, and when.

use crate::scene::Difference;
use crate::status::RigState;
use serde::{Deserialize, Serialize};
use std::fmt;

/// An entry of the journal.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct JournalEntry {
    /// Number since the daemon began, from 1.
    pub seq: u64,
    /// Time, seconds since 1970 (UTC).
    pub time_unix_s: f64,
    /// The tick that carried it out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tick: Option<u64>,
    /// Its client; absent for the daemon's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by: Option<Peer>,
    /// The operation, or the daemon's `fault`, `lease_lapsed`, `disconnected`, `connected`, `schedule_cancelled`,
    /// `reload_refused`, `reload` by a signal.
    pub op: String,
    /// The newest revision after it.
    pub revision: u64,
    /// Change of the rig's state.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<StateChange>,
    /// Code of a `fault`, or of a `stop` by the rig's own button.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
    /// The changes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub changes: Vec<Difference>,
    /// Its ramp, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp_ms: Option<f64>,
    /// The requested tick of a scheduled change.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_tick: Option<u64>,
    /// Its schedule.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub schedule: Option<String>,
    /// A reason, a device, a file, or the changes of a reload.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
}

impl JournalEntry {
    /// An entry with nothing but its operation.
    #[must_use]
    pub fn of(op: &str) -> Self {
        Self {
            op: op.to_owned(),
            ..Self::default()
        }
    }
}

/// The client, the operation and its details in one line, and a line for each change. The time is left
/// out: it depends on the reader's time zone.
impl fmt::Display for JournalEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.by {
            Some(by) => write!(f, "{by}  {}", self.op)?,
            None => write!(f, "hapticd  {}", self.op)?,
        }
        if let Some(state) = &self.state {
            write!(f, "  {} -> {}", state.before, state.after)?;
        }
        if let Some(tick) = self.tick {
            write!(f, "  tick {tick}")?;
        }
        if !self.changes.is_empty() {
            write!(f, "  revision {}", self.revision)?;
        }
        if let Some(ramp) = self.ramp_ms {
            write!(f, "  over {ramp} ms")?;
        }
        if let Some(schedule) = &self.schedule {
            write!(f, "  schedule {schedule}")?;
        }
        if let (Some(tick), Some(at_tick)) = (self.tick, self.at_tick)
            && tick != at_tick
        {
            write!(f, "  scheduled for tick {at_tick}")?;
        }
        if let Some(message) = &self.message {
            write!(f, "  {message}")?;
        }
        for change in &self.changes {
            write!(f, "\n    {change}")?;
        }
        Ok(())
    }
}

/// A change of the rig's state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StateChange {
    /// The state before.
    pub before: RigState,
    /// The state after.
    pub after: RigState,
}

/// A client, as the kernel knows it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Peer {
    /// Name of its connection, as in its greeting.
    pub session: String,
    /// Its user.
    pub uid: u32,
    /// The user's name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub user: Option<String>,
    /// Its process, if visible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pid: Option<i32>,
    /// Its program, if visible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program: Option<String>,
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.user {
            Some(user) => f.write_str(user)?,
            None => write!(f, "user {}", self.uid)?,
        }
        match (&self.program, self.pid) {
            (Some(program), Some(pid)) => write!(f, " ({program}, process {pid})"),
            (None, Some(pid)) => write!(f, " (process {pid})"),
            _ => Ok(()),
        }
    }
}

/// Answer to `log`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LogReply {
    /// The entries, oldest first.
    pub entries: Vec<JournalEntry>,
    /// The oldest kept.
    pub oldest_kept: u64,
}

/// Answer to `lease`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LeaseReply {
    /// Longest silence of the client, ms; 0 without a lease.
    pub timeout_ms: u32,
}
