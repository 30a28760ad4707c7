//! Constants of a run: the rig's limits, the loop's rate, and the directories. With them the connected device: the
//! facts that are checked before its motor pulls a hand.

use crate::config::{Configuration, EngageRules, FrictionOptions};
use crate::control::hand::PointerHand;
use crate::processor_share::ProcessorShare;
use crate::rt::handoff::ANY_CONNECTION;
use crate::rt::inbox::RigSetup;
use crate::telemetry::link;
use device_boards::Address;
use device_io::kinematics::Kinematics;
use device_io::link::{DeviceInfo, Homing, LinkMonitor, LinkState, RigIdentity, RunningKeeper};
use haptic_core::Scheme;
use haptic_core::adviser::RigFacts;
use haptic_core::limiter::Limits;
use haptic_core::scene::SceneFile;
use haptic_core::servo::Settings;
use haptic_ipc::{ErrorCode, ForceLimitBy, RealTimeStatus, SAMPLE_COLUMNS, SAMPLE_Y_COLUMNS, ServoSetup, WireError};
use std::cell::Cell;
use std::path::PathBuf;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;

/// Constants of a run.
#[derive(Debug)]
pub(crate) struct Facts {
    pub(crate) server: String,
    pub(crate) device: String,
    pub(crate) address: Address,
    /// The settings of the loop's servo, at the newest record.
    pub(crate) servo: Cell<Settings>,
    /// Where the configuration comes from.
    pub(crate) configuration: Configuration,
    /// Keeps the processors awake while it is open.
    pub(crate) _awake: Option<std::fs::File>,
    /// The loop's share of its processor, if it is pinned to one.
    pub(crate) share: Option<ProcessorShare>,
    pub(crate) rig: RigFacts,
    /// What the options say of the rig's own friction.
    pub(crate) friction: FrictionOptions,
    /// The hand on the rig, where clients move it.
    pub(crate) hand: Option<PointerHand>,
    /// The link to the rig, unless the rig is simulated in this process.
    pub(crate) link: Option<LinkMonitor>,
    /// Keeps that link connected.
    pub(crate) keeper: Option<RunningKeeper>,
    /// How the motors of a rig of two axes move the hand.
    pub(crate) kinematics: Option<Kinematics>,
    pub(crate) period_ns: u64,
    /// Duration of engaging and of releasing.
    pub(crate) ramp: Duration,
    /// Checks of a device that are waived.
    pub(crate) rules: EngageRules,
    /// Directory of the commissioning records.
    pub(crate) state_dir: PathBuf,
    pub(crate) scheme: Scheme,
    /// The first scene, where its coupling may be the rig's: its file leaves it to the rig, or nobody has named a
    /// scene.
    pub(crate) first_scene: Option<SceneFile>,
    /// Directory of saved scenes.
    pub(crate) scene_dir: PathBuf,
    /// The real-time thread's properties when the loop began.
    pub(crate) real_time: RealTimeStatus,
}

/// Why something cannot be done without a device; `what` names it.
pub(super) fn no_device(what: &str) -> WireError {
    let message = format!("cannot {what}: no device is connected; see `haptic-ctl doctor`");
    WireError::new(ErrorCode::WrongState, message).about("state")
}

/// The device with the identity of one of its two motors, counted from 0.
pub(super) fn of_motor(mut device: DeviceInfo, motor: usize) -> DeviceInfo {
    device.rig = device.rig.with_part(&format!("motor{}", motor + 1));
    device
}

/// A device whose samples are farther apart than its rate says, by more than this share, has the rate that is measured.
const SLOWER: f64 = 1.25;

/// The time between a device's samples, s, by the rate that it says and by what was measured, s; 0 before that.
fn sample_period_s(rate_hz: f64, measured_s: f64) -> f64 {
    let nominal_s = 1.0 / rate_hz;
    if measured_s <= SLOWER * nominal_s {
        return nominal_s;
    }
    // A mean that is measured anew each time is no other rig.
    let grain_s = nominal_s / 4.0;
    (measured_s / grain_s).ceil() * grain_s
}

impl Facts {
    /// The device at the other end of the link, if there is a link and one is connected.
    pub(super) fn linked_device(&self) -> Option<DeviceInfo> {
        match self.link.as_ref()?.state() {
            LinkState::Connected(device) => Some(device),
            LinkState::Looking | LinkState::Waiting(_) => None,
        }
    }

    /// The device at the other end of the link, or the rig in this process as if it were one; `None` if none is
    /// connected.
    pub(super) fn connected_device(&self) -> Option<DeviceInfo> {
        if self.link.is_some() {
            return self.linked_device();
        }
        Some(DeviceInfo {
            firmware: self.device.clone(),
            force_limit_n: self.limits().force_n,
            resolution_m: self.rig.resolution,
            sample_rate_hz: 1.0 / self.period_s(),
            watchdog_ms: None,
            buttons: 0,
            rig: RigIdentity {
                key: self.address.to_string(),
                has_serial_number: true,
                reversed: false,
            },
            connection: ANY_CONNECTION,
            motors: None,
        })
    }

    /// The adviser's facts of the rig as far as its link reports them: the connected device's
    /// resolution and rate, and the measured delay.
    pub(crate) fn linked_facts(&self) -> RigFacts {
        let Some(link) = &self.link else { return self.rig };
        let mut times = link::times(link);
        let mut rig = self.rig;
        match self.linked_device() {
            Some(device) => {
                rig.resolution = device.resolution_m;
                times.sample_period_s = sample_period_s(device.sample_rate_hz, times.sample_period_s);
            }
            None => times.sample_period_s = 0.0,
        }
        rig.sample_period_s = times.sample_period_s;
        rig.delay_s = times.delay_s(rig.period_s);
        rig
    }

    /// From a sample to the motor that gives the force for it, s, without what is late now and then; a period of the
    /// slower side until it is measured.
    pub(crate) fn steady_delay_s(&self) -> f64 {
        let Some(link) = &self.link else { return 0.0 };
        match link.counters().steady_round_trip_ns.load(Relaxed) {
            0 => self.linked_facts().effective_period_s(),
            #[expect(clippy::cast_precision_loss, reason = "a duration far below 2^53 ns")]
            steady_ns => steady_ns as f64 * 1e-9,
        }
    }

    /// Whether the delay of the link was measured, or there is none.
    pub(crate) fn is_delay_measured(&self) -> bool {
        self.link
            .as_ref()
            .is_none_or(|monitor| link::times(monitor).round_trip_s > 0.0)
    }

    /// The real-time thread's properties, with the problems that have come up since.
    pub(crate) fn real_time(&self) -> RealTimeStatus {
        let mut status = self.real_time.clone();
        status
            .problems
            .extend(self.share.as_ref().and_then(ProcessorShare::problem));
        status
    }

    /// Names of a row's columns.
    pub(crate) fn sample_columns(&self) -> Vec<String> {
        let second = if self.is_plane() { &SAMPLE_Y_COLUMNS[..] } else { &[] };
        SAMPLE_COLUMNS.iter().chain(second).map(ToString::to_string).collect()
    }

    /// Whether the rig's home pose is known, and how to tell it, where it has one.
    pub(crate) fn homing(&self) -> Option<&Homing> {
        let has_home = self.kinematics.is_some_and(|kinematics| kinematics.home().is_some());
        self.link.as_ref().map(LinkMonitor::homing).filter(|_| has_home)
    }

    /// Whether the rig moves a hand in a plane.
    pub(crate) fn is_plane(&self) -> bool {
        self.kinematics.is_some()
    }

    /// The largest force sent to the rig, N, and the source of that limit.
    pub(crate) fn force_limit(&self) -> (f64, ForceLimitBy) {
        let force_n = self.limits().force_n;
        match self.linked_device() {
            Some(device) if device.force_limit_n < force_n => (device.force_limit_n, ForceLimitBy::Device),
            _ => (force_n, ForceLimitBy::Configuration),
        }
    }

    pub(crate) fn limits(&self) -> Limits {
        self.servo.get().limits
    }

    /// Notes that the loop has other limits.
    pub(crate) fn set_limits(&self, limits: Limits) {
        self.servo.set(Settings {
            limits,
            ..self.servo.get()
        });
    }

    /// Whether the properties of the device are known: there is no link to it, or it is connected.
    pub(crate) fn is_device_known(&self) -> bool {
        self.link.is_none() || self.linked_device().is_some()
    }

    /// What the loop computes its forces with, on the device that is connected, where it knows so
    /// much of the rig.
    pub(crate) fn servo_setup(&self, rig: RigSetup) -> ServoSetup {
        let (device_resolution_m, force_limit_n) = match self.linked_device() {
            Some(device) => (device.resolution_m, device.force_limit_n),
            None => (self.rig.resolution, f64::INFINITY),
        };
        ServoSetup {
            settings: Settings {
                losses: rig.losses,
                compensation: rig.compensation,
                ..self.servo.get()
            },
            scheme: self.scheme,
            device_resolution_m,
            // JSON has no infinity.
            device_force_limit_n: force_limit_n.is_finite().then_some(force_limit_n),
            version: haptic_core::servo::VERSION,
        }
    }

    pub(crate) fn period_s(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "a period is far below 2^53 ns")]
        let period_ns = self.period_ns as f64;
        period_ns * 1e-9
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_that_a_device_does_not_keep_is_not_believed() {
        for (measured_s, period_s) in [(0.0, 1e-3), (1.2e-3, 1e-3), (1.3e-3, 1.5e-3), (9.9e-3, 10e-3)] {
            assert!(
                (sample_period_s(1000.0, measured_s) - period_s).abs() < 1e-12,
                "{measured_s} s"
            );
        }
    }
}
