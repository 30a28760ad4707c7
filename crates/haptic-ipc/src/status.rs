//! The state of the rig and of the daemon.

use crate::journal::Peer;
use crate::link::LinkStatus;
use crate::rig_friction::RigFrictionStatus;
use crate::sample_y::{is_one_axis, one_axis};
use crate::schedule::ScheduleStatus;
pub use haptic_core::servo::RigState;
use serde::{Deserialize, Serialize};

/// Answer to `status`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Status {
    /// The server.
    pub server: String,
    /// State of the rig.
    pub state: RigState,
    /// Why it is faulted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
    /// The last tick.
    pub tick: u64,
    /// Time since the loop began, s.
    pub uptime_s: f64,
    /// Nominal rate of the loop, Hz.
    pub rate_hz: f64,
    /// Integration of the block: `exact`, `implicit`, `literal` or `literal:N`.
    pub scheme: String,
    /// Estimator of the velocity.
    pub velocity_estimator: String,
    /// Revision of the active scene.
    pub revision: u64,
    /// Name of the active scene.
    pub scene: String,
    /// Broken bounds of the adviser; up to a second old.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub broken_bounds: Vec<String>,
    /// The library's scene that it was loaded from or saved as.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub library_scene: Option<LibraryScene>,
    /// The waiting changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scheduled: Option<ScheduleStatus>,
    /// Force commanded on the hand in the last tick, N.
    #[serde(rename = "command_force_N")]
    pub command_force_n: f64,
    /// Energy created by sampling, J, beyond the rig's own losses.
    #[serde(default, rename = "energy_excess_J")]
    pub energy_excess_j: f64,
    /// Position of the device in the last tick, m.
    pub device_position_m: f64,
    /// Position along the second axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device_position_y_m: Option<f64>,
    /// Force commanded along the second axis, N.
    #[serde(default, skip_serializing_if = "Option::is_none", rename = "command_force_y_N")]
    pub command_force_y_n: Option<f64>,
    /// Changes that `undo` can undo.
    #[serde(default)]
    pub undo_depth: usize,
    /// Changes that `redo` can redo.
    #[serde(default)]
    pub redo_depth: usize,
    /// The clients.
    pub clients: usize,
    /// Clients with a lease.
    #[serde(default)]
    pub leases: usize,
    /// The commissioning or identifying client.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub commissioning: Option<Peer>,
    /// The rig.
    pub device: DeviceStatus,
    /// The real-time thread.
    pub real_time: RealTimeStatus,
}

impl Status {
    /// Whether there is a device. A stop or a fault outlasts one that is gone.
    #[must_use]
    pub fn has_device(&self) -> bool {
        let link = self.device.link.as_ref();
        self.state != RigState::Disconnected && link.is_none_or(|link| link.waiting.is_none())
    }

    /// The force that is commanded on the hand, N: with its sign on a rig of one axis, on one of two its length.
    #[must_use]
    pub fn force_on_hand_n(&self) -> f64 {
        let x_n = self.command_force_n;
        self.command_force_y_n.map_or(x_n, |y_n| x_n.hypot(y_n))
    }
}

/// The scene of the library that the active scene comes from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LibraryScene {
    /// Its name there.
    pub name: String,
    /// Whether it was changed since.
    pub changed: bool,
}

/// The rig, as `status` shows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DeviceStatus {
    /// Its description.
    pub description: String,
    /// 1 or 2.
    #[serde(default = "one_axis", skip_serializing_if = "is_one_axis")]
    pub axes: u8,
    /// How two motors move the hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kinematics: Option<String>,
    /// Whether the home pose is known, where two axes need one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub homed: Option<bool>,
    /// Force limit, N: the smaller of the daemon's and the device's.
    #[serde(rename = "force_limit_N")]
    pub force_limit_n: f64,
    /// Whose limit that is.
    #[serde(default)]
    pub force_limit_by: ForceLimitBy,
    /// Discarded samples, which no hand can have made.
    #[serde(default)]
    pub samples_forgotten: u64,
    /// Fastest change of that force, N/s.
    #[serde(default, rename = "slew_limit_N_per_s")]
    pub slew_limit_n_per_s: f64,
    /// Speed at which the force is taken away, m/s.
    #[serde(default)]
    pub speed_limit_mps: f64,
    /// Acceleration at which the force is taken away, m/s^2.
    #[serde(default)]
    pub acceleration_limit_mps2: f64,
    /// Why an `engage` would be refused now.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub engage_refused: Vec<Problem>,
    /// Whether `hand` moves the hand on it.
    #[serde(default, skip_serializing_if = "crate::fields::is_default")]
    pub takes_hand: bool,
    /// Its own friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig_friction: Option<RigFrictionStatus>,
    /// The link.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<LinkStatus>,
}

/// The source of the smaller force limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ForceLimitBy {
    /// The daemon's configuration.
    #[default]
    Configuration,
    /// The device's hello.
    Device,
    /// A name that only a later server knows.
    #[serde(other)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unknown,
}

/// The real-time thread, as `status` shows it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RealTimeStatus {
    /// SCHED_FIFO priority.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fifo_priority: Option<u8>,
    /// Its processor, if pinned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu: Option<usize>,
    /// Whether it is scheduled by SCHED_DEADLINE.
    #[serde(default)]
    pub deadline_scheduled: bool,
    /// Whether its memory is locked.
    pub memory_locked: bool,
    /// Whether the processors are kept out of deep sleep.
    #[serde(default)]
    pub cpus_kept_awake: bool,
    /// Time that it spins before each deadline, us.
    #[serde(default)]
    pub spin_us: u64,
    /// Whether denormal numbers count as zero.
    #[serde(default)]
    pub denormals_flushed: bool,
    /// Its problems.
    pub problems: Vec<Problem>,
}

impl RealTimeStatus {
    /// How it is scheduled, for people.
    #[must_use]
    pub fn scheduling(&self) -> String {
        match self.fifo_priority {
            Some(priority) => format!("SCHED_FIFO {priority}"),
            None if self.deadline_scheduled => "SCHED_DEADLINE".to_owned(),
            None => "ordinary priority".to_owned(),
        }
    }

    /// Where it runs, for people.
    #[must_use]
    pub fn place(&self) -> String {
        self.cpu
            .map_or_else(|| "not pinned".to_owned(), |cpu| format!("processor {cpu}"))
    }

    /// Whether its memory stays in place, for people.
    #[must_use]
    pub fn memory(&self) -> &'static str {
        if self.memory_locked {
            "memory locked"
        } else {
            "memory not locked"
        }
    }
}

/// A problem and its remedy.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Problem {
    /// The problem, with the system's message.
    pub what: String,
    /// The remedy.
    pub remedy: String,
}

/// Answer to `engage`, `release`, `stop`, `reset` and `home`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StateReply {
    /// The state.
    pub state: RigState,
    /// The tick that carried it out.
    pub tick: u64,
}

/// Answer to `hand`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct HandReply {
    /// Time without another `hand` after which the arm lets go, ms.
    pub lets_go_after_ms: u32,
}
