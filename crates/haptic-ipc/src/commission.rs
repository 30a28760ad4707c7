//! The state and the findings of a commissioning.

use crate::journal::Peer;
use serde::{Deserialize, Serialize};

/// Longest lease of a client that commissions a rig, ms.
pub const MAX_COMMISSION_LEASE_MS: u32 = 2000;

/// Masses, kg, of all of which the coupling holds that is reported for a rig of unknown mass.
pub const UNKNOWN_MASS_KG: [f64; 2] = [0.05, 3.0];

/// Answer to `commission.*`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CommissionReply {
    /// The commissioning client.
    pub by: Peer,
    /// The rig's serial number, else its address.
    pub rig: String,
    /// Its firmware.
    pub firmware: String,
    /// Motor of a rig of two axes, 1 or 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motor: Option<u32>,
    /// Whether a pulse is under way.
    pub pulsing: bool,
    /// Why it has ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<String>,
    /// Why what is found could not be stored, in the answer to `commission.begin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cannot_store: Option<String>,
    /// Largest force of a pulse, N: half of the rig's force limit.
    #[serde(rename = "force_limit_N")]
    pub force_limit_n: f64,
    /// The rig's force limit, N.
    #[serde(rename = "rig_force_limit_N")]
    pub rig_force_limit_n: f64,
    /// The resolution, m.
    pub resolution_m: f64,
    /// Duration of engaging and releasing, ms.
    pub ramp_ms: f64,
    /// Ended pulses.
    pub pulses: u64,
    /// The newest pulse.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last: Option<PulseReport>,
    /// Whether a positive force moved the handle that way.
    pub positive_confirmed: bool,
    /// Whether a negative one did.
    pub negative_confirmed: bool,
    /// Position of the handle, m; of two axes along the newest pulse.
    pub position_m: f64,
    /// Smallest position so far, m; absent on two axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_m: Option<f64>,
    /// Largest, m, likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub greatest_m: Option<f64>,
    /// Smallest step of the position, m, likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_m: Option<f64>,
    /// File of the findings, after `commission.store`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<String>,
    /// After `commission.store`: the stiffest coupling that the rig bears with a factor of two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coupling: Option<haptic_core::scene::Coupling>,
}

/// The report of a pulse.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PulseReport {
    /// The requested force, N.
    #[serde(rename = "force_N")]
    pub force_n: f64,
    /// The largest force, N.
    #[serde(rename = "largest_force_N")]
    pub largest_force_n: f64,
    /// What ended the pulse.
    pub end: PulseEnd,
    /// Its duration, ms.
    pub duration_ms: f64,
    /// Displacement of the handle, m.
    pub moved_m: f64,
    /// Largest displacement along the force, m.
    pub forward_m: f64,
    /// Largest displacement against the force, m.
    pub backward_m: f64,
    /// The largest speed, m/s.
    pub largest_speed_mps: f64,
    /// Friction of the rig, N, by the motor's work.
    #[serde(default, rename = "friction_N", skip_serializing_if = "Option::is_none")]
    pub friction_n: Option<f64>,
    /// Displacement of each of two motors, m or rad, in the hand's first 5 mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motors_moved: Option<[f64; 2]>,
    /// Moved mass, kg, likewise; absent where encoder, friction or a link of 5 ms hide it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<f64>,
    /// How far that may be off, kg, by the encoder's steps and the link's delay.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_within_kg: Option<f64>,
}

/// How a pulse ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum PulseEnd {
    /// Its time.
    Time,
    /// Its travel.
    Travel,
    /// Its speed.
    Speed,
    /// The handle moved against the force.
    WrongWay,
    /// The rig was stopped, faulted, released or disconnected.
    Interrupted,
    /// Some ticks were not recorded: the report is void.
    Unrecorded,
    /// Something that a later server knows.
    #[serde(other)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unknown,
}
