//! The timing of the loop.

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
    /// Stops since the daemon began, timed from the client's line.
    #[serde(default)]
    pub stops: StopTimes,
    /// The link.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<LinkStatus>,
}

/// The timing of the loop over a period.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TimingWindow {
    /// Ticks done.
    pub ticks: u64,
    /// Ticks that took longer than their period.
    pub overruns: u64,
    /// Deadlines that passed without a tick.
    pub missed_periods: u64,
    /// Samples lost to a full telemetry ring.
    pub telemetry_dropped: u64,
    /// Time from a deadline to its tick.
    pub wake_latency_ns: Percentiles,
    /// Duration of a tick, with the device's read and write.
    pub tick_ns: Percentiles,
    /// Duration of the device's read and write; 0 within the daemon.
    pub device_round_trip_ns: Percentiles,
    /// Time from one tick to the next.
    pub period_ns: Percentiles,
    /// The same durations in buckets, each twice as wide as the previous one.
    #[serde(default)]
    pub histogram: TimingHistogram,
}

/// Duration of stops, from the reading of the client's line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StopTimes {
    /// Stops confirmed by the device.
    pub confirmed: u64,
    /// Stops not confirmed within 100 ms.
    pub unconfirmed: u64,
    /// Stops without a connected device.
    pub without_device: u64,
    /// Time until zero force was written.
    pub to_written_ns: Percentiles,
    /// Time until the device confirmed that, or, if it cannot, had taken the zero force.
    pub to_confirmed_ns: Percentiles,
}

/// Durations in buckets. The buckets follow one another; the first begins at 0.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TimingHistogram {
    /// Time from a deadline to its tick.
    pub wake_latency_ns: Vec<Bucket>,
    /// Duration of a tick.
    pub tick_ns: Vec<Bucket>,
}

/// A bucket of a histogram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Bucket {
    /// Its longest duration, ns.
    pub up_to: u64,
    /// Number of durations.
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
