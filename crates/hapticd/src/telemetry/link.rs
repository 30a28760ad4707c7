//! The status of the link to a rig, for `status` and for events.

use crate::rt::clock::now_ns;
use device_io::link::{ConnectError, DeviceInfo, LinkCounters, LinkMonitor, LinkState, UNKNOWN_DRIFT};
use haptic_core::adviser::LinkTimes;
use haptic_ipc::{LinkCounts, LinkErrorStatus, LinkStatus, LinkedDevice};
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

/// Age of the newest sample of a device that is silent, ns: longer than a hold-up, shorter than a person's glance.
const SILENT_NS: u64 = 100_000_000;

pub(crate) fn times(monitor: &LinkMonitor) -> LinkTimes {
    let counters = monitor.counters();
    #[expect(clippy::cast_precision_loss, reason = "durations far below 2^53 ns")]
    let seconds = |counter: &AtomicU64| counter.load(Relaxed) as f64 * 1e-9;
    LinkTimes {
        sample_period_s: seconds(&counters.period_ns),
        round_trip_s: seconds(&counters.usual_round_trip_ns),
        age_s: seconds(&counters.usual_age_ns),
    }
}

/// A device in the protocol's terms.
pub(crate) fn linked(device: DeviceInfo) -> LinkedDevice {
    LinkedDevice {
        firmware: device.firmware,
        force_limit_n: device.force_limit_n,
        sample_rate_hz: device.sample_rate_hz,
        resolution_m: device.resolution_m,
        watchdog_ms: device.watchdog_ms,
        rig: Some(device.rig.key),
    }
}

/// The status of the link to the rig.
pub(crate) fn status(monitor: &LinkMonitor) -> LinkStatus {
    let counters = monitor.counters();
    let count = |counter: &AtomicU64| counter.load(Relaxed);
    #[expect(clippy::cast_precision_loss, reason = "durations far below 2^53 ns")]
    let us = |counter: &AtomicU64| count(counter) as f64 * 1e-3;
    let (device, waiting) = match monitor.state() {
        LinkState::Connected(device) => (Some(linked(device)), silence(count(&counters.age_ns))),
        state => (None, Some(waiting(&state, counters))),
    };
    let drift_ppb = counters.drift_ppb.load(Relaxed);
    LinkStatus {
        device,
        waiting,
        round_trip_us: us(&counters.round_trip_ns),
        round_trip_max_us: us(&counters.round_trip_max_ns),
        age_us: us(&counters.age_ns),
        #[expect(clippy::cast_precision_loss, reason = "a drift far below 2^53 ppb")]
        clock_drift_ppm: (drift_ppb != UNKNOWN_DRIFT).then_some(drift_ppb as f64 * 1e-3),
        buttons: count(&counters.buttons),
        counts: LinkCounts {
            samples: count(&counters.samples),
            lost: count(&counters.lost),
            sequence_jumps: count(&counters.sequence_jumps),
            bad_crc: count(&counters.bad_crc),
            malformed: count(&counters.malformed),
            out_of_sequence: count(&counters.out_of_sequence),
            late: count(&counters.late),
            not_sent: count(&counters.not_sent),
            clipped: count(&counters.clipped),
            connections: count(&counters.connections),
            device_errors: count(&counters.device_errors),
        },
        last_error: counters.last_error().map(|(error, at_ns)| LinkErrorStatus {
            message: error.to_string(),
            age_s: seconds_since(at_ns),
        }),
    }
}

#[expect(clippy::cast_precision_loss, reason = "durations far below 2^53 ns")]
fn seconds_since(at_ns: u64) -> f64 {
    now_ns().saturating_sub(at_ns) as f64 * 1e-9
}

/// What is wrong with a connected device that sends no samples, by the age of its newest, ns. The loop is without it by
/// then, and the link gives it up later.
#[expect(clippy::cast_precision_loss, reason = "an age far below 2^53 ns")]
fn silence(age_ns: u64) -> Option<String> {
    (age_ns > SILENT_NS).then(|| {
        format!(
            "it is connected and silent: no sample for {:.1} s",
            age_ns as f64 * 1e-9
        )
    })
}

/// Why no device is connected, for people.
fn waiting(state: &LinkState, counters: &LinkCounters) -> String {
    let asking = counters.asking_since_ns().map(seconds_since);
    let why = match (state, asking) {
        // A board that is reset when its port is opened needs a second or two.
        (LinkState::Looking | LinkState::Waiting(ConnectError::Absent { .. }), Some(since_s)) => {
            format!("the device is there, but has not answered the hello yet ({since_s:.1} s)")
        }
        (LinkState::Waiting(why), _) => why.to_string(),
        _ => "looking for the device".to_owned(),
    };
    match counters.last_error() {
        // Before the first connection an older error says nothing more.
        Some((error, _)) if counters.connections.load(Relaxed) > 0 => format!("{why}; before that, {error}"),
        _ => why,
    }
}
