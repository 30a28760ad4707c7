//! The link to a rig, and the devices that may be one.

use crate::problem::Problem;
use serde::{Deserialize, Serialize};

/// The link to a rig, as `status` shows it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LinkStatus {
    /// The device that is connected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<LinkedDevice>,
    /// Why none is, and what would help.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waiting: Option<String>,
    /// From the sending of a command to the arrival of the first sample that knows it, newest, us.
    pub round_trip_us: f64,
    /// The longest of those, us.
    pub round_trip_max_us: f64,
    /// How old the newest sample was when it was last used, beyond what the quickest ones take to
    /// come, us.
    pub age_us: f64,
    /// How much faster the device's clock runs than ours, parts in a million; absent until that is
    /// known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock_drift_ppm: Option<f64>,
    /// Buttons pressed, one bit each.
    pub buttons: u64,
    /// What was counted since the daemon began.
    pub counts: LinkCounts,
    /// The last thing that went wrong on it: an error that the device reported, or why it was given
    /// up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_error: Option<LinkErrorStatus>,
}

/// Something that went wrong on a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LinkErrorStatus {
    /// What, with the system's error, or the code and the detail of the device.
    pub message: String,
    /// How long ago, s.
    pub age_s: f64,
}

/// A device at the other end of a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LinkedDevice {
    /// Name and version of its firmware.
    pub firmware: String,
    /// Largest force of its motor, N.
    #[serde(rename = "force_limit_N")]
    pub force_limit_n: f64,
    /// Samples a second, Hz.
    pub sample_rate_hz: f64,
    /// Distance between two counts of its encoder, m.
    pub resolution_m: f64,
    /// Time without a command after which the device itself switches its motor off, ms; absent
    /// where it is not known to do so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub watchdog_ms: Option<u32>,
    /// The rig: by its serial number, else by its place. What was found when it was commissioned is
    /// kept under this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<String>,
}

/// What was counted on a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LinkCounts {
    /// Samples taken.
    pub samples: u64,
    /// Samples that never came, or came after a newer one.
    pub lost: u64,
    /// Jumps of the device's sequence that are too long for lost samples.
    #[serde(default)]
    pub sequence_jumps: u64,
    /// Frames with a wrong CRC, or broken off.
    pub bad_crc: u64,
    /// Messages of another version, kind or length, or with impossible values.
    pub malformed: u64,
    /// Samples that were not newer than the newest.
    pub out_of_sequence: u64,
    /// Samples that came more than a period later than they should.
    pub late: u64,
    /// Commands that the link had no room for.
    pub not_sent: u64,
    /// Commands cut to the device's own force limit.
    pub clipped: u64,
    /// Connections made.
    pub connections: u64,
    /// Errors that the device reported.
    pub device_errors: u64,
}

/// The answer to `devices`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DevicesReply {
    /// What is plugged in, or the one that was asked.
    pub devices: Vec<FoundDevice>,
}

/// A device that may be a rig.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FoundDevice {
    /// How to name it, for `hapticd --device`.
    pub address: String,
    /// What it is, for people.
    pub description: String,
    /// Whether this daemon uses it now.
    pub in_use: bool,
    /// Why it cannot be used, and the fix.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<Problem>,
    /// What it answered, where it was asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<LinkedDevice>,
}
