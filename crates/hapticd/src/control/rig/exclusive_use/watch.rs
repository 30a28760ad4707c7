//! Which client has the rig to itself, and what ends that.

use crate::control::RigHandle;
use crate::control::connected_device::ConnectedDevice;
use haptic_ipc::{ErrorCode, MAX_COMMISSION_LEASE_MS, Peer, WireError};

/// The client that has the rig to itself.
pub(in crate::control) fn by(rig: &RigHandle) -> Option<Peer> {
    end_if_over(rig);
    let exclusive_use = rig.exclusive_use().borrow();
    let active = exclusive_use.as_ref().filter(|exclusive_use| exclusive_use.is_active());
    active.map(|exclusive_use| exclusive_use.by.clone())
}

/// Refuses what would disturb an exclusive use.
///
/// # Errors
/// A client has the rig to itself; the error says which.
pub(in crate::control) fn refuse_others(rig: &RigHandle, what: &str) -> Result<(), WireError> {
    end_if_over(rig);
    let exclusive_use = rig.exclusive_use().borrow();
    let Some(active) = exclusive_use.as_ref().filter(|exclusive_use| exclusive_use.is_active()) else {
        return Ok(());
    };
    let message = format!(
        "cannot {what} while {} is {} the rig: wait for its end, or end it with `stop`",
        active.by,
        active.work.participle()
    );
    Err(WireError::new(ErrorCode::Commissioning, message).about("state"))
}

/// Ends the exclusive use if the rig was stopped, its device has changed, or its lease has expired or was
/// lengthened.
pub(in crate::control) fn end_if_over(rig: &RigHandle) {
    let mut exclusive_use = rig.exclusive_use().borrow_mut();
    let Some(current) = exclusive_use.as_mut().filter(|current| current.ended.is_none()) else {
        return;
    };
    let connection = ConnectedDevice::find(&rig.facts).map(|device| device.connection);
    if rig.stops() != current.stops {
        current.end("the rig was stopped");
    } else if connection != Some(current.device.connection) {
        current.end("the device was disconnected");
    } else {
        match rig.leases().timeout_ms(current.session) {
            None => current.end("the lease of its client has expired"),
            Some(timeout_ms) if timeout_ms > MAX_COMMISSION_LEASE_MS => {
                current.end(&format!(
                    "its client has taken a lease of {timeout_ms} ms, and at most {MAX_COMMISSION_LEASE_MS} ms \
                     are allowed"
                ));
            }
            Some(_) => {}
        }
    }
}
