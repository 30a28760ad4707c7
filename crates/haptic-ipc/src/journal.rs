//! Who changed what, and when.

use crate::scene::Difference;
use crate::state::RigState;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Something that was changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct JournalEntry {
    /// Counts the entries since the daemon began, from 1.
    pub seq: u64,
    /// When, in seconds since 1970 (UTC).
    pub time_unix_s: f64,
    /// The tick that carried it out, where one did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tick: Option<u64>,
    /// Who did it; absent where the daemon did it itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by: Option<Peer>,
    /// The operation; `fault`, `lease_lapsed`, `disconnected` and `connected` are the daemon's own.
    pub op: String,
    /// The newest revision after it.
    pub revision: u64,
    /// State of the rig before and after, where it was meant to change it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<StateChange>,
    /// In what the scene has changed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub changes: Vec<Difference>,
    /// Time over which it changed, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp_ms: Option<f64>,
    /// What else there is to say: why there is a fault, why a lease has lapsed, which device was
    /// lost or found, the file of a scene that was saved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
}

impl JournalEntry {
    /// An entry of which only the operation is known yet.
    #[must_use]
    pub fn of(op: &str) -> Self {
        Self {
            seq: 0,
            time_unix_s: 0.0,
            tick: None,
            by: None,
            op: op.to_owned(),
            revision: 0,
            state: None,
            changes: Vec::new(),
            ramp_ms: None,
            message: None,
        }
    }
}

/// Who, what and how, in one line and one more for each change: all but the time, which is a matter
/// of where one is.
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
    /// What it was.
    pub before: RigState,
    /// What it is.
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
    /// The user's name, where the system has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub user: Option<String>,
    /// Its process, where it is in sight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pid: Option<i32>,
    /// The program that it runs, where it is in sight.
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
    /// The oldest entry that is still kept.
    pub oldest_kept: u64,
}

/// Answer to `lease`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LeaseReply {
    /// How long the client may be silent, ms; 0 where there is no lease any more.
    pub timeout_ms: u32,
}
