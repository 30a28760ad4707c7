//! The connected device: the facts that are checked before its motor pulls a hand.

use crate::control::facts::Facts;
use crate::rt::handoff::ANY_CONNECTION;
use device_io::link::{LinkMonitor, LinkState, RigIdentity};
use haptic_ipc::{ErrorCode, WireError};

/// The connected device.
#[derive(Clone, Debug)]
pub(crate) struct ConnectedDevice {
    pub(crate) firmware: String,
    pub(crate) force_limit_n: f64,
    pub(crate) resolution_m: f64,
    pub(crate) sample_rate_hz: f64,
    pub(crate) watchdog_ms: Option<u32>,
    /// Buttons that there are, one bit each.
    pub(crate) buttons: u8,
    pub(crate) rig: RigIdentity,
    pub(crate) connection: u64,
    /// 1 or 2.
    pub(crate) motors: usize,
}

/// Why something cannot be done without a device; `what` names it.
pub(super) fn no_device(what: &str) -> WireError {
    let message = format!("cannot {what}: no device is connected; see `haptic-ctl doctor`");
    WireError::new(ErrorCode::WrongState, message).about("state")
}

impl ConnectedDevice {
    fn of(monitor: &LinkMonitor) -> Option<Self> {
        match monitor.state() {
            LinkState::Connected(device) => Some(Self {
                firmware: device.firmware,
                force_limit_n: device.force_limit_n,
                resolution_m: device.resolution_m,
                sample_rate_hz: device.sample_rate_hz,
                watchdog_ms: device.watchdog_ms,
                buttons: device.buttons,
                rig: device.rig,
                connection: device.connection,
                motors: if device.motors.is_some() { 2 } else { 1 },
            }),
            LinkState::Looking | LinkState::Waiting(_) => None,
        }
    }

    /// The device with the identity of one of its two motors, counted from 0.
    pub(super) fn of_motor(mut self, motor: usize) -> Self {
        self.rig = self.rig.with_part(&format!("motor{}", motor + 1));
        self
    }

    /// What is commissioned of it, each under a key of its own: the rig, or each of two motors.
    pub(super) fn parts(&self) -> Vec<Self> {
        if self.motors == 1 {
            return vec![self.clone()];
        }
        (0..self.motors).map(|motor| self.clone().of_motor(motor)).collect()
    }

    /// The device at the other end of the link, or the rig in this process; `None` if none is
    /// connected.
    pub(super) fn find(facts: &Facts) -> Option<Self> {
        match &facts.link {
            Some(monitor) => Self::of(monitor),
            None => Some(Self {
                firmware: facts.device.clone(),
                force_limit_n: facts.limits().force_n,
                resolution_m: facts.rig.resolution,
                sample_rate_hz: 1.0 / facts.period_s(),
                watchdog_ms: None,
                buttons: 0,
                rig: RigIdentity {
                    key: facts.address.to_string(),
                    has_serial_number: true,
                    reversed: false,
                },
                connection: ANY_CONNECTION,
                motors: if facts.is_plane() { 2 } else { 1 },
            }),
        }
    }
}
