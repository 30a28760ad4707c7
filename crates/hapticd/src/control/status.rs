//! `status`: the state of the rig and of the daemon.

use crate::control::{RigHandle, admission, advise, exclusive_use, judge};
use device_io::link::Homing;
use haptic_ipc::{DeviceStatus, RigState, Status};
use std::rc::Rc;

pub(super) async fn status(rig: &RigHandle) -> Status {
    let mut engage_refused = admission::problems(rig).await;
    if engage_refused.is_empty() && rig.channel.state() == RigState::Idle {
        let scene = Rc::clone(&rig.scene());
        engage_refused.extend(judge::problem(&rig.known, scene).await);
    }
    let mut status = rig.status_without_admission();
    status.device.engage_refused = engage_refused;
    status.broken_bounds = advise::broken_bounds(rig);
    status
}

impl RigHandle {
    /// The status, but for what keeps the rig from being engaged: that waits for files.
    pub(crate) fn status_without_admission(&self) -> Status {
        // All of one tick: a rig without force shows none.
        let (newest, y, state, uptime_s, link) = {
            let feed = self.feed();
            let (newest, y) = (feed.newest().copied(), feed.newest_y());
            (newest, y, feed.state(), feed.uptime_s(), feed.link())
        };
        let scheduled = self.schedule().status();
        let facts = &self.facts;
        let (force_limit_n, force_limit_by) = facts.force_limit();
        let (limits, velocity) = (facts.limits(), facts.servo.get().velocity);
        let (undo_depth, redo_depth) = self.history().depth();
        Status {
            server: facts.server.clone(),
            state,
            fault: newest.and_then(|record| record.fault).map(|fault| fault.to_string()),
            tick: newest.map_or(0, |record| record.tick),
            uptime_s,
            rate_hz: 1.0 / facts.period_s(),
            scheme: facts.scheme.to_string(),
            velocity_estimator: velocity.to_string(),
            revision: self.revision(),
            scene: self.scene().name.clone(),
            broken_bounds: Vec::new(),
            library_scene: self.history().library_scene(),
            scheduled,
            command_force_n: newest.map_or(0.0, |record| record.command_force),
            energy_excess_j: newest.map_or(0.0, |record| record.energy_excess),
            device_position_m: newest.map_or(0.0, |record| record.device_position),
            device_position_y_m: y.map(|y| y.device_position_m),
            command_force_y_n: y.map(|y| y.command_force_n),
            undo_depth,
            redo_depth,
            clients: self.clients.get(),
            leases: self.leases.count(),
            commissioning: exclusive_use::by(self),
            device: DeviceStatus {
                engage_refused: Vec::new(),
                description: facts.device.clone(),
                axes: if facts.is_plane() { 2 } else { 1 },
                kinematics: facts.kinematics.as_ref().map(ToString::to_string),
                homed: facts.homing().map(Homing::is_homed),
                force_limit_n,
                force_limit_by,
                samples_forgotten: newest.map_or(0, |record| record.samples_forgotten),
                slew_limit_n_per_s: limits.slew_n_per_s,
                speed_limit_mps: limits.speed_mps,
                acceleration_limit_mps2: limits.acceleration_mps2,
                takes_hand: facts.hand.is_some(),
                rig_friction: Some(self.known.friction_status()),
                link,
            },
            real_time: facts.real_time(),
        }
    }
}
