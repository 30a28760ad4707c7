//! `commission.begin`, `commission.pulse`, `commission.status`, `commission.store` and
//! `commission.end`.

use super::pulse as one_pulse;
use crate::control::facts::{no_device, of_motor};
use crate::control::peer::Requester;
use crate::control::rig::commission_record::{Findings, Record};
use crate::control::rig::exclusive_use::{self, largest_force_n, resting_device};
use crate::control::rig::exclusive_use::{Commissioning, ExclusiveUse, Work};
use crate::control::rig_files::Origin;
use crate::control::{RigHandle, change, judge};
use crate::telemetry::motion::HandleMotion;
use haptic_ipc::quantity::number;
use haptic_ipc::{CommissionReply, ErrorCode, StateReply, WireError};
use std::cell::Ref;
use std::rc::Rc;

/// Default duration of a pulse, ms.
const DEFAULT_PULSE_MS: f64 = 200.0;

/// Fewest pulses in either direction that show the direction: a single one may meet a hand that pulls just then.
pub(super) const MIN_CONFIRMED: u32 = 4;

/// Smallest force of a pulse, N.
const MIN_FORCE_N: f64 = 0.001;

/// Begins a commissioning.
///
/// # Errors
/// Another client is commissioning the rig, the rig is not idle, the client has no lease that is short enough, or a
/// rig that is to be checked was not commissioned.
pub(in crate::control) async fn begin(
    rig: &RigHandle,
    by: Requester<'_>,
    motor: Option<u32>,
    is_check: bool,
) -> Result<CommissionReply, WireError> {
    let device = rig.facts.connected_device().ok_or_else(|| no_device("commission"))?;
    // Before anything moves.
    if is_check && rig.facts.link.is_some() {
        rig.known.records.of_parts(&device).await?;
    }
    let refuse = |message: &str| Err(WireError::new(ErrorCode::NotApplicable, message).about("motor"));
    let motor = match (motor, rig.facts.is_plane()) {
        (None, false) => None,
        (Some(_), false) => return refuse("this rig has one motor: leave `motor` out"),
        (None, true) => return refuse("a rig of two axes is commissioned one motor at a time: name `motor` 1 or 2"),
        (Some(number), true) => Some(number as usize - 1),
    };
    if rig.facts.homing().is_some_and(|homing| !homing.is_homed()) {
        let message = "cannot commission: the home pose is not known: bring the hand there, and run `haptic-ctl home`";
        return Err(WireError::new(ErrorCode::WrongState, message).about("homed"));
    }
    let device = match motor {
        Some(motor) => of_motor(device, motor),
        None => device,
    };
    let work = Work::Commissioning(Commissioning {
        motor,
        ..Commissioning::default()
    });
    exclusive_use::begin(rig, by, work, &device).await?;
    let writable = rig.known.records.check(&device).await;
    Ok(CommissionReply {
        cannot_store: writable.err().map(|error| error.message),
        ..status(rig, by)?
    })
}

/// The exclusive use of a client and its commissioning.
///
/// # Errors
/// This client is not commissioning the rig.
fn current<'a>(
    rig: &'a RigHandle,
    by: Requester<'_>,
) -> Result<(Ref<'a, ExclusiveUse>, Ref<'a, Commissioning>), WireError> {
    let doing = "commissioning the rig: `commission.begin`";
    exclusive_use::of_client(rig, by, ExclusiveUse::commissioning_of, doing)
}

/// The state of the commissioning, for its client.
///
/// # Errors
/// This client is not commissioning the rig.
pub(in crate::control) fn status(rig: &RigHandle, by: Requester<'_>) -> Result<CommissionReply, WireError> {
    let (current, found) = current(rig, by)?;
    let feed = rig.feed();
    let motion = feed.motion.as_ref();
    // Along two directions positions and steps are not of one line.
    let on_a_line = motion.filter(|_| found.motor.is_none());
    let (least_m, greatest_m) = on_a_line.map(HandleMotion::range_m).unzip();
    let (rig_force_limit_n, force_limit_n) = largest_force_n(rig, &current.device);
    Ok(CommissionReply {
        by: current.by.clone(),
        rig: current.device.rig.key.clone(),
        firmware: current.device.firmware.clone(),
        motor: found.motor.and_then(|motor| u32::try_from(motor + 1).ok()),
        pulsing: current.moving,
        ended: current.ended.clone(),
        cannot_store: None,
        force_limit_n,
        rig_force_limit_n,
        resolution_m: current.device.resolution_m,
        ramp_ms: rig.facts.ramp.as_secs_f64() * 1e3,
        pulses: found.pulses,
        last: found.last.clone(),
        positive_confirmed: found.confirmed[0] > 0,
        negative_confirmed: found.confirmed[1] > 0,
        position_m: motion.map_or(0.0, HandleMotion::position_m),
        least_m,
        greatest_m,
        step_m: on_a_line.and_then(HandleMotion::step_m),
        path: found.path.clone(),
        coupling: found.coupling,
    })
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
    status(rig, by)?;
    let device = resting_device(rig)?;
    let duration_ms = duration_ms.unwrap_or(DEFAULT_PULSE_MS);
    let (_, largest_n) = largest_force_n(rig, &device);
    if !(MIN_FORCE_N..=largest_n).contains(&force_n.abs()) {
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
    one_pulse::begin(rig, by, shape).await?;
    status(rig, by)
}

/// Stores the findings.
///
/// # Errors
/// The handle has not moved both ways yet, or the file cannot be written.
pub(in crate::control) async fn store(
    rig: &RigHandle,
    by: Requester<'_>,
    findings: Findings,
) -> Result<CommissionReply, WireError> {
    let found = status(rig, by)?;
    let device = resting_device(rig)?;
    let (confirmed, alone) = current(rig, by).map(|(_, work)| (work.confirmed, work.alone))?;
    for (direction, times) in ["positive", "negative"].into_iter().zip(confirmed) {
        if times < MIN_CONFIRMED {
            let message = format!(
                "nothing to store: {times} {direction} pulses have moved the handle from rest to rest in the {direction} \
                 direction, and at least {MIN_CONFIRMED} must (`commission.pulse`)"
            );
            return Err(WireError::new(ErrorCode::WrongState, message).about("force_N"));
        }
    }
    let mut record = Record {
        origin: Origin::now(&device, by.peer),
        step_m: found.step_m,
        findings,
        alone,
        coupling: None,
    };
    let whole = rig.facts.connected_device();
    if let Some(whole) = &whole
        && let Some(findings) = rig.known.records.findings_with(whole, &record).await
    {
        record.coupling = judge::stiffest_coupling(&rig.known, findings).await;
    }
    let coupling = record.coupling;
    let path = rig.known.records.store(record, device.connection).await?;
    // It holds from now on.
    if let Some(whole) = whole {
        drop(rig.known.records.known(&whole, false).await);
    }
    let path = path.display().to_string();
    rig.enter_done("commission.store", Some(by.peer), Some(path.clone()));
    if let Some(current) = rig.exclusive_use.borrow_mut().as_mut()
        && let Work::Commissioning(found) = &mut current.work
    {
        (found.path, found.coupling) = (Some(path), coupling);
    }
    status(rig, by)
}

/// Takes the connected device for the rig that was commissioned.
///
/// # Errors
/// None is connected or was commissioned, it has changed, or that cannot be kept.
pub(in crate::control) async fn confirm(rig: &RigHandle, by: Requester<'_>) -> Result<StateReply, WireError> {
    let device = rig
        .facts
        .connected_device()
        .ok_or_else(|| no_device("confirm the rig"))?;
    if rig.facts.link.is_some() {
        rig.known.records.confirm(&device, by.peer).await?;
    }
    let message = format!("{} ({})", device.rig.key, device.firmware);
    rig.enter_done("commission.confirm", Some(by.peer), Some(message));
    Ok(rig.state_reply())
}

/// Ends the commissioning; a scene that leaves its grip to the rig has the one that was found, before the answer.
///
/// # Errors
/// This client is not commissioning the rig.
pub(in crate::control) fn end(rig: &RigHandle, by: Requester<'_>) -> Result<CommissionReply, WireError> {
    status(rig, by)?;
    exclusive_use::end(rig, by.session, "its client has ended it");
    let ended = status(rig, by)?;
    if ended.path.is_some() {
        change::suit_the_rig(rig);
    }
    Ok(ended)
}
