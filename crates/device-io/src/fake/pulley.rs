//! The fake rig behind a pulley: a controller turns a shaft, and the carriage goes with it.

use super::{FakeRig, Hand, RigProperties};
use std::f64::consts::TAU;

/// The fake rig as a motor controller has it.
#[derive(Debug)]
pub(super) struct Pulley {
    rig: FakeRig,
    radius_m: f64,
    torque_nm: f64,
    largest_torque_nm: f64,
    /// What is added to the angle, rad.
    offset_rad: f64,
}

impl Pulley {
    pub(super) fn new(properties: RigProperties, hand: Hand, radius_m: f64) -> Self {
        Self {
            rig: FakeRig::new(properties, hand),
            radius_m,
            torque_nm: 0.0,
            largest_torque_nm: 0.0,
            offset_rad: 0.0,
        }
    }

    pub(super) fn live_until(&mut self, now_ns: u64) {
        self.rig.live_until(now_ns);
    }

    pub(super) fn drive(&mut self, torque_nm: f64) {
        self.torque_nm = torque_nm;
        self.largest_torque_nm = self.largest_torque_nm.max(torque_nm.abs());
        self.rig.drive(torque_nm / self.radius_m);
    }

    pub(super) fn force_n(&self) -> f64 {
        self.torque_nm / self.radius_m
    }

    pub(super) fn take_largest_force_n(&mut self) -> f64 {
        std::mem::replace(&mut self.largest_torque_nm, self.torque_nm.abs()) / self.radius_m
    }

    pub(super) fn angle_rad(&self) -> f64 {
        self.offset_rad + self.rig.plant().position_m() / self.radius_m
    }

    pub(super) fn speed_rad_per_s(&self) -> f64 {
        self.rig.plant().velocity_mps() / self.radius_m
    }

    pub(super) fn turn_by(&mut self, angle_rad: f64) {
        self.offset_rad += angle_rad;
    }

    pub(super) fn counts_per_turn(&self) -> Option<f64> {
        let resolution_m = self.rig.properties().resolution_m;
        (resolution_m > 0.0).then(|| (TAU * self.radius_m / resolution_m).round())
    }

    pub(super) fn rig(&self) -> &FakeRig {
        &self.rig
    }
}
