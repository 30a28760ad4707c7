//! Finding and greeting a device: what every kind of link does in its own way.

use super::health::LinkCounters;
use super::identity::RigIdentity;
use crate::device::{DeviceError, Measurement, Written};
use std::ffi::OsStr;
use std::path::PathBuf;
use std::sync::Arc;
use thiserror::Error;

/// Why a device cannot be used, now.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ConnectError {
    /// It is not plugged in.
    #[error("{what} is not there")]
    Absent {
        /// What was looked for.
        what: String,
    },
    /// Something is in the way that goes away by itself or by a person: no right, in use, a wrong
    /// kind of file.
    #[error("{what}: {why}; {remedy}")]
    Refused {
        /// The device.
        what: String,
        /// What the system says.
        why: String,
        /// The remedy.
        remedy: String,
    },
    /// It is there, and does not speak the protocol.
    #[error("{what}: {problem}")]
    Protocol {
        /// The device.
        what: String,
        /// What came instead of an answer.
        problem: String,
    },
}

impl ConnectError {
    /// The remedy.
    #[must_use]
    pub fn remedy(&self) -> &str {
        match self {
            Self::Absent { .. } => "plug it in; `haptic-ctl devices` lists what is there",
            Self::Refused { remedy, .. } => remedy,
            Self::Protocol { .. } => "docs/device-protocol.md specifies the answers of a firmware",
        }
    }

    /// The error and its remedy in one line.
    #[must_use]
    pub fn with_remedy(&self) -> String {
        match self {
            // It has the remedy already.
            Self::Refused { .. } => self.to_string(),
            _ => format!("{self}; {}", self.remedy()),
        }
    }
}

/// A device, as it was greeted.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceInfo {
    /// Number of the connection, from 1; 0 until the keeper has handed it over.
    pub connection: u64,
    /// Name and version of its firmware.
    pub firmware: String,
    /// Largest force of its motor, N; 0 of rotary motors without kinematics.
    pub force_limit_n: f64,
    /// Samples a second, Hz.
    pub sample_rate_hz: f64,
    /// Distance between two counts of its encoder, m; 0 likewise.
    pub resolution_m: f64,
    /// Time without a command after which it switches its motor off, ms; nothing where it is not
    /// known to do so.
    pub watchdog_ms: Option<u32>,
    /// Buttons that there are, one bit each.
    pub buttons: u8,
    /// Which rig it is.
    pub rig: RigIdentity,
    /// Its motors, where it has two.
    pub motors: Option<TwoMotors>,
}

/// The two motors of a device, and their encoders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoMotors {
    /// Distance between two counts of each, m or rad.
    pub counts: [f64; 2],
    /// Largest effort of each, N or N m.
    pub limits: [f64; 2],
    /// Whether they are rotary: rad and N m.
    pub are_rotary: bool,
    /// Whether count 0 of both is the home pose, also after power-on.
    pub are_absolute: bool,
}

/// A device after its greeting.
#[derive(Debug)]
pub struct GreetedDevice {
    /// The way to read and write it.
    pub connection: Box<dyn Connection>,
    /// What it is.
    pub device: DeviceInfo,
}

/// What a device is measured against, once it is connected.
#[derive(Clone, Copy, Debug)]
pub struct LoopTiming {
    /// Period of the loop, ns.
    pub period_ns: u64,
    /// Longest time for which a sample may be old under force, ns.
    pub stale_ns: u64,
}

impl Default for LoopTiming {
    /// 1 kHz and 20 ms, the daemon's defaults.
    fn default() -> Self {
        Self {
            period_ns: 1_000_000,
            stale_ns: 20_000_000,
        }
    }
}

/// Finds and greets one kind of device.
pub trait Connector: Send + std::fmt::Debug {
    /// What it connects to, for people.
    fn address(&self) -> String;

    /// The folder in which the device's node appears and disappears.
    fn folder(&self) -> PathBuf;

    /// Whether a change of a node with this name in that folder may be one of the device.
    fn concerns(&self, node: &OsStr) -> bool;

    /// Finds the device, opens and greets it. May take a second.
    ///
    /// # Errors
    /// Why it cannot be used.
    fn connect(&mut self, timing: LoopTiming, counters: &Arc<LinkCounters>) -> Result<GreetedDevice, ConnectError>;
}

/// A device after its greeting. Of one with one motor the second position is 0, and the second effort means nothing.
///
/// Neither method waits, allocates or locks. [`DeviceError::Disconnected`] ends the connection.
pub trait Connection: Send + std::fmt::Debug {
    /// The newest sample, with the position of each motor, m or rad; nothing before the first.
    ///
    /// # Errors
    /// As [`Device::read`](crate::Device::read).
    fn read(&mut self, now_ns: u64) -> Result<Option<Measurement<[f64; 2]>>, DeviceError>;

    /// Commands the efforts of the motors, N or N m, as [`Device::write`](crate::Device::write).
    ///
    /// # Errors
    /// As [`Device::write`](crate::Device::write).
    fn write(&mut self, efforts: [f64; 2], enabled: bool, now_ns: u64) -> Result<Written, DeviceError>;
}
