//! The link to a rig, and the devices that are plugged in.

use crate::status::Problem;
use haptic_core::rig_friction::RigFriction;
use serde::{Deserialize, Serialize};

/// The link to a rig.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LinkStatus {
    /// The connected device.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<LinkedDevice>,
    /// Why no device is connected, or why one that is is not read, and the remedy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waiting: Option<String>,
    /// Newest time from a command to the first sample that names it, us.
    pub round_trip_us: f64,
    /// The longest round trip, us.
    pub round_trip_max_us: f64,
    /// Age of the newest sample when it was used, beyond the shortest transmission, us.
    pub age_us: f64,
    /// Drift of the device's clock, parts in a million, positive if fast.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock_drift_ppm: Option<f64>,
    /// Buttons pressed, one bit each.
    pub buttons: u64,
    /// Counts since the daemon began.
    pub counts: LinkCounts,
    /// The last error: the device's, or why the link was given up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_error: Option<LinkErrorStatus>,
}

/// An error of a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LinkErrorStatus {
    /// The system's message, or the device's code and detail.
    pub message: String,
    /// Its age, s.
    pub age_s: f64,
}

/// A device on a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LinkedDevice {
    /// Name and version of its firmware.
    pub firmware: String,
    /// Largest force of its motor, N; 0 of a probed device with rotary motors.
    #[serde(rename = "force_limit_N")]
    pub force_limit_n: f64,
    /// The sample rate, Hz.
    pub sample_rate_hz: f64,
    /// Distance between two counts of its encoder, m; 0 likewise.
    pub resolution_m: f64,
    /// Time without a command after which the motor is off, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub watchdog_ms: Option<u32>,
    /// The rig's serial number, else its address.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<String>,
}

/// Counts of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LinkCounts {
    /// The samples.
    pub samples: u64,
    /// Samples that never came, or after a newer one.
    pub lost: u64,
    /// Jumps of the sequence too long for losses.
    #[serde(default)]
    pub sequence_jumps: u64,
    /// Frames with a wrong CRC, or broken off.
    pub bad_crc: u64,
    /// Messages of a wrong version, kind, length or value.
    pub malformed: u64,
    /// Samples not newer than the newest.
    pub out_of_sequence: u64,
    /// Samples more than a period late.
    pub late: u64,
    /// Commands for which the link had no room.
    pub not_sent: u64,
    /// Commands cut to the device's own force limit.
    pub clipped: u64,
    /// The connections.
    pub connections: u64,
    /// The device's errors.
    pub device_errors: u64,
}

/// The answer to `devices`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DevicesReply {
    /// The devices found, or the probed one.
    pub devices: Vec<FoundDevice>,
}

/// A device that may be a rig.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FoundDevice {
    /// Its address, for `hapticd --device`.
    pub address: String,
    /// Its description.
    pub description: String,
    /// Whether this daemon uses it now.
    pub in_use: bool,
    /// Why it cannot be used, and the fix.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<Problem>,
    /// Its hello, if probed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<LinkedDevice>,
    /// Its two motors, if probed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motors: Option<ProbedMotors>,
    /// If probed and identified.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig_friction: Option<RigFriction>,
}

/// The motors of a probed device with two.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ProbedMotors {
    /// Whether they are rotary.
    pub are_rotary: bool,
    /// Distance between two counts of each, m or rad.
    pub counts: [f64; 2],
    /// Largest effort of each, N or N m.
    pub limits: [f64; 2],
}
