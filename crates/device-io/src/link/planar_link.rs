//! The real-time end of a link to a rig of two axes: from the positions of its motors to the hand, and from a force on
//! the hand to their efforts.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use super::link_device::LinkDevice;
use crate::device::{Device, DeviceBounds, DeviceError, Measurement, Written};
use crate::kinematics::{Jacobian, Kinematics};
use haptic_core::planar::Plane;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::{Acquire, Release};

/// Whether it is known which counts are the home pose of a rig of two axes. Relative encoders lose it with each
/// connection.
#[derive(Clone, Debug, Default)]
pub struct Homing(Arc<Words>);

#[derive(Debug, Default)]
struct Words {
    /// Number of the newest connection.
    connection: AtomicU64,
    /// The connection whose home pose is known, or need not be.
    homed: AtomicU64,
    /// The connection whose hand is at home now, as a person says; 0 once that is taken.
    at_home: AtomicU64,
}

impl Homing {
    /// Whether the home pose of the newest connection is known, or need not be.
    #[must_use]
    pub fn is_homed(&self) -> bool {
        self.0.homed.load(Acquire) == self.0.connection.load(Acquire)
    }

    /// The hand is in the home pose now: the next reading takes its counts for that.
    pub fn tell(&self) {
        self.0.at_home.store(self.0.connection.load(Acquire), Release);
    }

    /// What was announced and not taken yet is void.
    pub fn withdraw(&self) {
        self.0.at_home.store(0, Release);
    }

    /// Whether what was announced last has been taken by a reading.
    #[must_use]
    pub fn is_taken(&self) -> bool {
        self.0.at_home.load(Acquire) == 0
    }

    /// A connection with a number has come, which needs a home pose or not.
    pub(super) fn connected(&self, connection: u64, needs_none: bool) {
        if needs_none {
            self.0.homed.store(connection, Release);
        }
        self.0.connection.store(connection, Release);
    }

    /// Whether a connection's hand is at home in this reading.
    fn is_at_home(&self, connection: u64) -> bool {
        self.0.at_home.load(Acquire) == connection
    }

    fn homed(&self, connection: u64) {
        self.0.homed.store(connection, Release);
        self.0.at_home.store(0, Release);
    }
}

/// The real-time end of a link to a rig of two axes.
#[derive(Debug)]
pub struct PlanarLink {
    link: LinkDevice,
    kinematics: Kinematics,
    homing: Homing,
    /// The connection that `origin` is of.
    connection: u64,
    /// What the link's positions leave out, m or rad: a rig that has not been homed is taken to have been in its home
    /// pose at the first sample.
    origin: [f64; 2],
    /// How the hand moves with the motors where it was read last; `None` where no motor may be driven.
    jacobian: Option<Jacobian>,
}

impl PlanarLink {
    pub(super) fn new(link: LinkDevice, kinematics: Kinematics, homing: Homing) -> Self {
        Self {
            link,
            kinematics,
            homing,
            connection: 0,
            origin: [0.0; 2],
            jacobian: None,
        }
    }
}

impl Device<Plane> for PlanarLink {
    fn description(&self) -> String {
        format!("{}, {}", self.link.description(), self.kinematics)
    }

    fn bounds(&self) -> DeviceBounds {
        self.link.bounds()
    }

    fn read(&mut self, now_ns: u64) -> Result<Measurement<Plane>, DeviceError> {
        // Whatever is written until the next sample must not go by another connection's hand.
        self.jacobian = None;
        let measured = self.link.read_motors(now_ns)?;
        let connection = self.link.bounds().connection;
        let home = self.kinematics.home().unwrap_or_default();
        if connection != self.connection {
            (self.connection, self.origin) = (connection, home);
        }
        if self.homing.is_at_home(connection) {
            // Without a home pose the counts themselves are the motors' positions.
            if self.kinematics.home().is_some() {
                self.origin = [0, 1].map(|motor| home[motor] - measured.position_m[motor]);
            }
            self.homing.homed(connection);
        }
        let motors = [0, 1].map(|motor| self.origin[motor] + measured.position_m[motor]);
        let position;
        (position, self.jacobian) = self.kinematics.reading(motors).parts();
        Ok(measured.at(position))
    }

    fn write(&mut self, force_n: Plane, enabled: bool) -> Result<Written, DeviceError> {
        let efforts = self.jacobian.map_or([0.0; 2], |jacobian| jacobian.efforts(force_n));
        self.link.write_motors(efforts, enabled)
    }
}
