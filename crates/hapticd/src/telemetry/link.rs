//! How the link to a rig is, for those who ask and for those who listen.

use device_io::link::{LinkMonitor, LinkState, UNKNOWN_DRIFT};
use haptic_ipc::{LinkCounts, LinkStatus, LinkedDevice};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// How the link to the rig is.
pub(crate) fn status(monitor: &LinkMonitor) -> LinkStatus {
    let counters = monitor.counters();
    let count = |counter: &AtomicU64| counter.load(Relaxed);
    #[expect(clippy::cast_precision_loss, reason = "durations far below 2^53 ns")]
    let us = |counter: &AtomicU64| count(counter) as f64 * 1e-3;
    let (device, waiting) = match monitor.state() {
        LinkState::Connected {
            firmware,
            force_limit_n,
            sample_rate_hz,
            resolution_m,
            watchdog_ms,
            rig,
            ..
        } => (
            Some(LinkedDevice {
                firmware,
                force_limit_n,
                sample_rate_hz,
                resolution_m,
                watchdog_ms,
                rig: Some(rig.key),
            }),
            None,
        ),
        LinkState::Looking => (None, Some("looking for the device".to_owned())),
        LinkState::Waiting(why) => (None, Some(why.to_string())),
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
            bad_crc: count(&counters.bad_crc),
            malformed: count(&counters.malformed),
            out_of_sequence: count(&counters.out_of_sequence),
            late: count(&counters.late),
            not_sent: count(&counters.not_sent),
            clipped: count(&counters.clipped),
            connections: count(&counters.connections),
            device_errors: count(&counters.device_errors),
        },
    }
}
