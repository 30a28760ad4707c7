//! The fake rig behind a pulley: a controller turns a shaft, and the carriage moves with it.

use device_io::fake::{FakeRig, Hand, RigProperties};
use std::f64::consts::TAU;

/// Counts of a turn where the rig's encoder is perfect.
const DEFAULT_COUNTS: f64 = 8192.0;

/// The fake rig as a motor controller sees it.
#[derive(Debug)]
pub(super) struct Pulley {
    rig: FakeRig,
    radius_m: f64,
    torque_nm: f64,
    largest_torque_nm: f64,
    /// Added to the angle, rad.
    offset_rad: f64,
}

impl Pulley {
    /// A rig on a pulley of such a radius, m.
    pub(super) fn new(properties: RigProperties, hand: Hand, radius_m: f64) -> Self {
        Self {
            rig: FakeRig::new(properties, hand),
            radius_m,
            torque_nm: 0.0,
            largest_torque_nm: 0.0,
            offset_rad: 0.0,
        }
    }

    /// Lives until a time, ns.
    pub(super) fn live_until(&mut self, now_ns: u64) {
        self.rig.live_until(now_ns);
    }

    /// Gives a torque to the shaft, Nm, until the next call.
    pub(super) fn drive(&mut self, torque_nm: f64) {
        self.torque_nm = torque_nm;
        self.largest_torque_nm = self.largest_torque_nm.max(torque_nm.abs());
        self.rig.drive(torque_nm / self.radius_m);
    }

    /// Force on the handle, N.
    pub(super) fn force_n(&self) -> f64 {
        self.torque_nm / self.radius_m
    }

    /// Largest force on the handle since the last call, N.
    pub(super) fn take_largest_force_n(&mut self) -> f64 {
        std::mem::replace(&mut self.largest_torque_nm, self.torque_nm.abs()) / self.radius_m
    }

    /// Angle of the shaft as its encoder counts it, turns.
    pub(super) fn turns(&self) -> f64 {
        let turns = (self.offset_rad + self.rig.plant().position_m() / self.radius_m) / TAU;
        self.counts().map_or(turns, |counts| (turns * counts).round() / counts)
    }

    /// Speed of the shaft, rad/s.
    pub(super) fn speed_rad_per_s(&self) -> f64 {
        self.rig.plant().velocity_mps() / self.radius_m
    }

    /// Makes the encoder jump by a number of counts.
    pub(super) fn jump(&mut self, counts: i32) {
        self.offset_rad += f64::from(counts) / self.counts_per_turn() * TAU;
    }

    /// Counts of its encoder in a turn.
    pub(super) fn counts_per_turn(&self) -> f64 {
        self.counts().unwrap_or(DEFAULT_COUNTS)
    }

    /// The same; nothing for a perfect encoder.
    fn counts(&self) -> Option<f64> {
        let resolution_m = self.rig.properties().resolution_m;
        (resolution_m > 0.0).then(|| (TAU * self.radius_m / resolution_m).round())
    }

    /// The rig.
    pub(super) fn rig(&self) -> &FakeRig {
        &self.rig
    }
}
