//! Which client commissions the rig, and what ends the commissioning.

use crate::control::RigHandle;
use crate::control::connected_device::ConnectedDevice;
use haptic_ipc::{ErrorCode, Peer, PulseEnd, PulseReport, WireError};

/// The client that commissions the rig.
pub(in crate::control) fn by(rig: &RigHandle) -> Option<Peer> {
    look(rig);
    let commissioning = rig.commissioning().borrow();
    let active = commissioning.as_ref().filter(|commissioning| commissioning.is_active());
    active.map(|commissioning| commissioning.by.clone())
}

/// Refuses what would disturb a commissioning.
///
/// # Errors
/// A client is commissioning the rig; the error says which.
pub(in crate::control) fn keep_out(rig: &RigHandle, what: &str) -> Result<(), WireError> {
    match by(rig) {
        None => Ok(()),
        Some(by) => {
            let message =
                format!("cannot {what} while {by} is commissioning the rig: wait for its end, or end it with `stop`");
            Err(WireError::new(ErrorCode::Commissioning, message).about("state"))
        }
    }
}

/// Ends the commissioning if the rig was stopped, its device has changed, or its lease has expired.
pub(super) fn look(rig: &RigHandle) {
    let mut commissioning = rig.commissioning().borrow_mut();
    let Some(current) = commissioning.as_mut().filter(|current| current.ended.is_none()) else {
        return;
    };
    let connection = ConnectedDevice::find(&rig.facts).map(|device| device.connection);
    if rig.stops() != current.stops {
        current.end("the rig was stopped");
    } else if connection != Some(current.device.connection) {
        current.end("the device was disconnected");
    } else if !rig.leases().is_held_by(current.session) {
        current.end("the lease of its client has expired");
    }
}

/// Processes the report of a pulse, after the scene is restored.
pub(super) fn pulse_ended(rig: &RigHandle, report: Option<PulseReport>, interrupted: Option<String>) {
    let feed = rig.feed();
    let confirmed = report.as_ref().is_some_and(|report| {
        feed.motion
            .as_ref()
            .is_some_and(|motion| motion.is_confirmed_by(report))
    });
    let mut commissioning = rig.commissioning().borrow_mut();
    let Some(current) = commissioning.as_mut() else { return };
    current.pulsing = false;
    current.pulses += 1;
    if let Some(report) = report {
        if report.end == PulseEnd::WrongWay {
            current.end(
                "the handle moved against the force: the motor or the encoder is wired the other way (or somebody held \
                 the handle); nothing is stored",
            );
        }
        current.positive_confirmed |= confirmed && report.force_n > 0.0;
        current.negative_confirmed |= confirmed && report.force_n < 0.0;
        current.last = Some(report);
    }
    if let Some(why) = interrupted {
        current.end(&why);
    }
}
