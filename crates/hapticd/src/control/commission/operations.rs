//! `commission.begin`, `commission.pulse`, `commission.status`, `commission.store` and
//! `commission.end`.

use super::pulse as one_pulse;
use super::record::Record;
use super::state::Commissioning;
use super::watch::{keep_out, look};
use crate::control::RigHandle;
use crate::control::admission::{self, Purpose};
use crate::control::connected_device::ConnectedDevice;
use crate::control::journal::Completion;
use crate::control::requester::Requester;
use crate::control::rig_files::Origin;
use crate::telemetry::motion::Motion;
use haptic_ipc::quantity::number;
use haptic_ipc::{CommissionReply, ErrorCode, JournalEntry, LONGEST_COMMISSION_LEASE_MS, RigState, WireError};
use std::rc::Rc;

/// Default duration of a pulse, ms.
const USUAL_PULSE_MS: f64 = 200.0;

/// Smallest force of a pulse, N.
const LEAST_FORCE_N: f64 = 0.001;

/// Largest share of the rig's force that a pulse may have.
const LARGEST_SHARE: f64 = 0.5;

/// Begins a commissioning.
///
/// # Errors
/// Another client is commissioning the rig, the rig is not idle, or the client has no lease that is
/// short enough.
pub(in crate::control) async fn begin(rig: &RigHandle, by: Requester<'_>) -> Result<CommissionReply, WireError> {
    let stops = rig.stops();
    let (_turn, state) = rig.quiet_state().await;
    keep_out(rig, "commission the rig")?;
    let wrong = |message: &str| Err(WireError::new(ErrorCode::WrongState, message).about("state"));
    match state {
        RigState::Idle => {}
        RigState::Disconnected => return wrong("cannot commission: no device is connected"),
        RigState::Stopped => {
            let message = "cannot commission while the rig is stopped: reset it first";
            return Err(WireError::new(ErrorCode::Stopped, message).about("state"));
        }
        RigState::Faulted => {
            let message = "cannot commission while the rig is faulted: see `status`, and reset it first";
            return Err(WireError::new(ErrorCode::Faulted, message).about("state"));
        }
        state => return wrong(&format!("cannot commission while the rig is {state}: release it first")),
    }
    let Some(device) = ConnectedDevice::find(&rig.facts) else {
        return wrong("cannot commission: no device is connected");
    };
    if !rig.leases().is_held_by(by.session) || rig.leases().timeout_ms(by.session) > LONGEST_COMMISSION_LEASE_MS {
        return wrong(&format!(
            "cannot commission without a lease: take one of at most {LONGEST_COMMISSION_LEASE_MS} ms first (`lease`), \
             so \
             that the commissioning ends if this client dies"
        ));
    }
    rig.feed().motion = Some(Motion::new(device.resolution_m));
    let entry = JournalEntry {
        by: Some(by.peer.clone()),
        message: Some(device.rig.key.clone()),
        ..JournalEntry::of("commission.begin")
    };
    rig.enter(Completion::Done, entry);
    *rig.commissioning().borrow_mut() = Some(Commissioning {
        session: by.session,
        by: by.peer.clone(),
        device,
        stops,
        pulsing: false,
        ended: None,
        pulses: 0,
        last: None,
        positive_confirmed: false,
        negative_confirmed: false,
        path: None,
    });
    status(rig, by)
}

/// The state of the commissioning, for its client.
///
/// # Errors
/// This client is not commissioning the rig.
pub(in crate::control) fn status(rig: &RigHandle, by: Requester<'_>) -> Result<CommissionReply, WireError> {
    look(rig);
    let feed = rig.feed();
    let commissioning = rig.commissioning().borrow();
    let Some(current) = commissioning.as_ref().filter(|current| current.session == by.session) else {
        let message = "this client is not commissioning the rig: `commission.begin` comes first";
        return Err(WireError::new(ErrorCode::WrongState, message).about("state"));
    };
    let motion = feed.motion.as_ref();
    let (least_m, greatest_m) = motion.map_or((0.0, 0.0), Motion::range_m);
    Ok(CommissionReply {
        by: current.by.clone(),
        rig: current.device.rig.key.clone(),
        firmware: current.device.firmware.clone(),
        pulsing: current.pulsing,
        ended: current.ended.clone(),
        force_limit_n: LARGEST_SHARE * largest_force_n(rig, &current.device),
        rig_force_limit_n: largest_force_n(rig, &current.device),
        resolution_m: current.device.resolution_m,
        ramp_ms: rig.facts.ramp.as_secs_f64() * 1e3,
        pulses: current.pulses,
        last: current.last.clone(),
        positive_confirmed: current.positive_confirmed,
        negative_confirmed: current.negative_confirmed,
        position_m: motion.map_or(0.0, Motion::position_m),
        least_m,
        greatest_m,
        step_m: motion.and_then(Motion::step_m),
        path: current.path.clone(),
    })
}

/// The force limit of the rig, N: the smaller of the daemon's and the device's.
fn largest_force_n(rig: &RigHandle, device: &ConnectedDevice) -> f64 {
    rig.facts.servo.limits.force_n.min(device.force_limit_n)
}

/// The device under commission, if the commissioning is active and has no pulse under way.
fn at_rest(rig: &RigHandle, by: Requester<'_>) -> Result<ConnectedDevice, WireError> {
    let status = status(rig, by)?;
    if let Some(why) = status.ended {
        let code = match rig.state() {
            RigState::Stopped => ErrorCode::Stopped,
            RigState::Faulted => ErrorCode::Faulted,
            _ => ErrorCode::WrongState,
        };
        return Err(WireError::new(code, format!("the commissioning has ended: {why}")).about("state"));
    }
    if status.pulsing {
        let message = "a pulse is still under way: ask `commission.status` until `pulsing` is false";
        return Err(WireError::new(ErrorCode::WrongState, message).about("state"));
    }
    let commissioning = rig.commissioning().borrow();
    let device = commissioning.as_ref().map(|current| current.device.clone());
    device.ok_or_else(|| WireError::new(ErrorCode::WrongState, "nobody is commissioning the rig"))
}

/// Begins a pulse.
///
/// # Errors
/// The force is out of range, another pulse is under way, or the rig may not be moved.
pub(in crate::control) async fn pulse(
    rig: &Rc<RigHandle>,
    by: Requester<'_>,
    force_n: f64,
    duration_ms: Option<f64>,
) -> Result<CommissionReply, WireError> {
    let device = at_rest(rig, by)?;
    let duration_ms = duration_ms.unwrap_or(USUAL_PULSE_MS);
    let largest_n = LARGEST_SHARE * largest_force_n(rig, &device);
    if !(LEAST_FORCE_N..=largest_n).contains(&force_n.abs()) {
        let message = format!(
            "force_N = {} N is out of range: it must be from {} to {} N",
            number(force_n),
            number(-largest_n),
            number(largest_n)
        );
        return Err(WireError::new(ErrorCode::OutOfRange, message)
            .about("force_N")
            .within(force_n, -largest_n, largest_n, "N"));
    }
    let shape = one_pulse::shape(force_n, duration_ms, device.resolution_m);
    // Now, while the client waits for the answer.
    let admission = admission::admit(rig, Purpose::Commissioning).await?;
    let stops = {
        let mut commissioning = rig.commissioning().borrow_mut();
        let Some(current) = commissioning.as_mut().filter(|current| !current.pulsing) else {
            return Err(WireError::new(ErrorCode::WrongState, "a pulse is under way"));
        };
        current.pulsing = true;
        current.stops
    };
    let (task_rig, peer) = (Rc::clone(rig), by.peer.clone());
    tokio::task::spawn_local(async move { one_pulse::run(&task_rig, shape, admission, stops, &peer).await });
    status(rig, by)
}

/// Stores the findings.
///
/// # Errors
/// The handle has not moved both ways yet, or the file cannot be written.
pub(in crate::control) async fn store(
    rig: &RigHandle,
    by: Requester<'_>,
    range_m: Option<f64>,
    friction_n: Option<f64>,
) -> Result<CommissionReply, WireError> {
    let device = at_rest(rig, by)?;
    let found = status(rig, by)?;
    for (direction, confirmed) in [
        ("positive", found.positive_confirmed),
        ("negative", found.negative_confirmed),
    ] {
        if !confirmed {
            let message = format!(
                "nothing to store: no {direction} pulse has moved the handle in the {direction} direction yet \
                 (`commission.pulse`)"
            );
            return Err(WireError::new(ErrorCode::WrongState, message).about("force_N"));
        }
    }
    let record = Record {
        origin: Origin::now(&device, by.peer),
        step_m: found.step_m,
        range_m,
        friction_n,
    };
    let path = rig.records().store(&rig.facts.state_dir, record).await?;
    let path = path.display().to_string();
    let entry = JournalEntry {
        by: Some(by.peer.clone()),
        message: Some(path.clone()),
        ..JournalEntry::of("commission.store")
    };
    rig.enter(Completion::Done, entry);
    if let Some(current) = rig.commissioning().borrow_mut().as_mut() {
        current.path = Some(path);
    }
    status(rig, by)
}

/// Ends the commissioning.
///
/// # Errors
/// This client is not commissioning the rig.
pub(in crate::control) fn end(rig: &RigHandle, by: Requester<'_>) -> Result<CommissionReply, WireError> {
    status(rig, by)?;
    end_of(rig, by.session, "its client has ended it");
    status(rig, by)
}

/// Ends the commissioning of a client that has closed its connection. A pulse ends at once, instead
/// of along the ramp of the expired lease.
pub(in crate::control) fn closed(rig: &RigHandle, session: u64) {
    end_of(rig, session, "its client has closed the connection");
}

fn end_of(rig: &RigHandle, session: u64, why: &str) {
    let pulsing = {
        let mut commissioning = rig.commissioning().borrow_mut();
        let Some(current) = commissioning.as_mut().filter(|current| current.session == session) else {
            return;
        };
        current.end(why);
        current.pulsing
    };
    if pulsing {
        one_pulse::rest(rig);
    }
}
