//! What is found out about a rig while it is commissioned.

use crate::journal::Peer;
use serde::{Deserialize, Serialize};

/// Longest silence that a client may allow itself while it commissions a rig, ms: its lease must be
/// no longer.
pub const LONGEST_COMMISSION_LEASE_MS: u32 = 2000;

/// Answer to the operations `commission.*`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CommissionReply {
    /// Who commissions the rig.
    pub by: Peer,
    /// Which rig it is: by its serial number, else by where it is.
    pub rig: String,
    /// Name and version of its firmware.
    pub firmware: String,
    /// Whether a pulse is under way, from its ramp on until the rig is idle again.
    pub pulsing: bool,
    /// Why it is over, where it is: nothing more can be asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<String>,
    /// Largest force of a pulse, N: half of what the rig may give.
    #[serde(rename = "force_limit_N")]
    pub force_limit_n: f64,
    /// Largest force that the rig may give otherwise, N.
    #[serde(rename = "rig_force_limit_N")]
    pub rig_force_limit_n: f64,
    /// Distance between two counts of the encoder, as the device says, m.
    pub resolution_m: f64,
    /// Time that engaging and releasing take, ms.
    pub ramp_ms: f64,
    /// Pulses that have ended.
    pub pulses: u64,
    /// The newest of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last: Option<PulseReport>,
    /// Whether a positive force has moved the handle in the positive direction.
    pub positive_confirmed: bool,
    /// Whether a negative force has moved the handle in the negative direction.
    pub negative_confirmed: bool,
    /// Position of the handle, m.
    pub position_m: f64,
    /// The least position since this began, m.
    pub least_m: f64,
    /// The greatest position since this began, m.
    pub greatest_m: f64,
    /// The smallest step by which the position was seen to change, m; absent before it has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_m: Option<f64>,
    /// Where it is kept, after `commission.store`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<String>,
}

/// What came of a pulse.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PulseReport {
    /// The force that was asked for, N.
    #[serde(rename = "force_N")]
    pub force_n: f64,
    /// The largest force commanded, N, with its sign.
    #[serde(rename = "largest_force_N")]
    pub largest_force_n: f64,
    /// How it ended.
    pub end: PulseEnd,
    /// From the first force to the last, ms.
    pub duration_ms: f64,
    /// How far the handle went altogether, m, with its sign.
    pub moved_m: f64,
    /// How far it went the way that it was pushed, at most, m.
    pub forward_m: f64,
    /// How far it went against that, at most, m.
    pub backward_m: f64,
    /// Its largest speed, m/s.
    pub largest_speed_mps: f64,
    /// Friction of the rig, N: the work of the motor by the way that the handle went until it
    /// rested again. Absent where it hardly moved.
    #[serde(default, rename = "friction_N", skip_serializing_if = "Option::is_none")]
    pub friction_n: Option<f64>,
}

/// How a pulse ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum PulseEnd {
    /// In its time.
    Time,
    /// The handle had gone as far as a pulse may let it.
    Travel,
    /// The handle was as fast as a pulse may let it be.
    Speed,
    /// The handle went the other way.
    WrongWay,
    /// The rig was stopped, faulted, released or disconnected.
    Interrupted,
    /// Some of its ticks were not recorded: nothing can be said of it.
    Unrecorded,
    /// Something that a later server knows.
    #[serde(other)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unknown,
}
