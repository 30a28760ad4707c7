//! `status`: how the rig and the daemon are.

use crate::control::RigHandle;
use device_io::link::{LinkMonitor, LinkState, UNKNOWN_DRIFT};
use haptic_ipc::{DeviceStatus, LinkCounts, LinkStatus, LinkedDevice, RigState, Status};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

pub(super) fn status(rig: &RigHandle) -> Status {
    let (newest, uptime_s) = {
        let feed = rig.feed();
        (feed.newest().copied(), feed.uptime_s())
    };
    let facts = &rig.facts;
    Status {
        server: facts.server.clone(),
        state: match newest {
            Some(record) => record.state,
            None if facts.link.is_some() => RigState::Disconnected,
            None => RigState::Idle,
        },
        fault: newest.and_then(|record| record.fault).map(|fault| fault.to_string()),
        tick: newest.map_or(0, |record| record.tick),
        uptime_s,
        rate_hz: 1.0 / facts.period_s(),
        scheme: facts.scheme.to_string(),
        velocity_estimator: facts.velocity.to_string(),
        revision: rig.revision(),
        scene: rig.scene().name,
        command_force_n: newest.map_or(0.0, |record| record.command_force),
        energy_excess_j: newest.map_or(0.0, |record| record.energy_excess),
        device_position_m: newest.map_or(0.0, |record| record.device_position),
        clients: rig.clients().get(),
        device: DeviceStatus {
            description: facts.device.clone(),
            force_limit_n: facts.limits.force_n,
            slew_limit_n_per_s: facts.limits.slew_n_per_s,
            speed_limit_mps: facts.limits.speed_mps,
            acceleration_limit_mps2: facts.limits.acceleration_mps2,
            link: facts.link.as_ref().map(link),
        },
        real_time: facts.real_time.clone(),
    }
}

/// How the link to the rig is.
fn link(monitor: &LinkMonitor) -> LinkStatus {
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
        } => (
            Some(LinkedDevice {
                firmware,
                force_limit_n,
                sample_rate_hz,
                resolution_m,
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
