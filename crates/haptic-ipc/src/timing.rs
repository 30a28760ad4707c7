//! How well the loop keeps time.

use crate::link::LinkStatus;
use serde::{Deserialize, Serialize};

/// Answer to `timing`, and the timing event: counts and percentiles since the loop began.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Timing {
    /// Nominal rate of the loop, Hz.
    pub rate_hz: f64,
    /// Since the loop began.
    #[serde(flatten)]
    pub since_start: TimingWindow,
    /// The same over the last ten seconds.
    pub last_10_s: TimingWindow,
    /// How long stops took, since the daemon began.
    #[serde(default)]
    pub stops: StopTimes,
    /// The link to the rig; absent where the rig is in the daemon itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<LinkStatus>,
}

/// How well the loop kept time over a while.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TimingWindow {
    /// Ticks done.
    pub ticks: u64,
    /// Ticks that took longer than their period.
    pub overruns: u64,
    /// Deadlines that passed without a tick.
    pub missed_periods: u64,
    /// Samples lost because the telemetry ring was full.
    pub telemetry_dropped: u64,
    /// How long after its deadline a tick began.
    pub wake_latency_ns: Percentiles,
    /// How long a tick took, the device's read and write included.
    pub tick_ns: Percentiles,
    /// How long the device's read and write took; zero where the rig is in the daemon itself.
    pub device_round_trip_ns: Percentiles,
    /// Time from one tick to the next.
    pub period_ns: Percentiles,
    /// The same durations in buckets, each twice as wide as the one before.
    #[serde(default)]
    pub histogram: TimingHistogram,
}

/// How long stops took: from the reading of the line that asks for one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StopTimes {
    /// Stops after which the device had its motor off.
    pub confirmed: u64,
    /// Stops after which the device was sent zero force and did not say within 100 ms that its
    /// motor is off.
    pub unconfirmed: u64,
    /// Stops that no device was there to hear.
    pub without_device: u64,
    /// Until zero force was written.
    pub to_written_ns: Percentiles,
    /// Until the device had said that its motor is off; a rig that says nothing of its motor, until
    /// it had taken the zero force.
    pub to_confirmed_ns: Percentiles,
}

/// Durations in buckets. The buckets follow one another; the first begins at 0.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TimingHistogram {
    /// How long after its deadline a tick began.
    pub wake_latency_ns: Vec<Bucket>,
    /// How long a tick took.
    pub tick_ns: Vec<Bucket>,
}

/// A bucket of a histogram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Bucket {
    /// The durations in it are up to this, ns, and above that of the bucket before.
    pub up_to: u64,
    /// How many there were.
    pub count: u64,
}

/// Percentiles of a duration, ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Percentiles {
    /// Half are below.
    pub p50: u64,
    /// 99 % are below.
    pub p99: u64,
    /// 99.9 % are below.
    pub p999: u64,
    /// The largest.
    pub max: u64,
}
