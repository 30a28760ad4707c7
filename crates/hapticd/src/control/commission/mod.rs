//! `commission.*`: one client has the rig to itself and moves the handle by small pulses, to find out which way its motor pulls.
//!
//! A pulse goes the way of every scene: compiled here, left in the mailbox, rendered by the loop within all its limits, between an engagement and a release of its own. What the handle
//! does is read from the records of the ticks. Whatever ends a commissioning ends its pulse at once, and the scene comes back as it was.

mod pulse;
pub(in crate::control) mod record;

use crate::control::RigHandle;
use crate::control::connected::Device;
use crate::control::journal::Until;
use crate::control::requester::Requester;
use crate::telemetry::motion::Motion;
use haptic_ipc::quantity::number;
use haptic_ipc::{
    CommissionReply, ErrorCode, JournalEntry, LONGEST_COMMISSION_LEASE_MS, Peer, PulseReport, RigState, WireError,
};
use std::rc::Rc;
use std::time::{SystemTime, UNIX_EPOCH};

/// Duration of a pulse where none is asked for, ms.
const USUAL_PULSE_MS: f64 = 200.0;

/// Durations that a pulse may have, ms.
const PULSE_MS: (f64, f64) = (20.0, 300.0);

/// Smallest force of a pulse, N.
const LEAST_FORCE_N: f64 = 0.001;

/// Largest share of the rig's force that a pulse may have.
const LARGEST_SHARE: f64 = 0.5;

/// A range or a friction beyond that is none of a rig for a hand: m, N.
const LARGEST_FOUND: f64 = 1000.0;

/// A commissioning, until the next one begins.
#[derive(Debug)]
pub(crate) struct Commissioning {
    session: u64,
    by: Peer,
    device: Device,
    /// Stops asked for before it began: another one ends it.
    stops: u64,
    pulsing: bool,
    ended: Option<String>,
    pulses: u64,
    last: Option<PulseReport>,
    positive_confirmed: bool,
    negative_confirmed: bool,
    path: Option<String>,
}

impl Commissioning {
    /// Whether the rig is not to be touched by anybody else.
    fn is_active(&self) -> bool {
        self.ended.is_none() || self.pulsing
    }

    fn end(&mut self, why: &str) {
        self.ended.get_or_insert_with(|| why.to_owned());
    }
}

/// Who is commissioning the rig, if somebody is.
pub(super) fn by(rig: &RigHandle) -> Option<Peer> {
    look(rig);
    let commissioning = rig.commissioning().borrow();
    let active = commissioning.as_ref().filter(|commissioning| commissioning.is_active());
    active.map(|commissioning| commissioning.by.clone())
}

/// Refuses what would get in the way of somebody who is commissioning the rig.
///
/// # Errors
/// Somebody is; the error says who.
pub(super) fn keep_out(rig: &RigHandle, what: &str) -> Result<(), WireError> {
    match by(rig) {
        None => Ok(()),
        Some(by) => {
            let message =
                format!("cannot {what} while {by} is commissioning the rig: wait until that has ended; `stop` ends it");
            Err(WireError::new(ErrorCode::Commissioning, message).about("state"))
        }
    }
}

/// Sees whether something has happened that ends it.
fn look(rig: &RigHandle) {
    let mut commissioning = rig.commissioning().borrow_mut();
    let Some(current) = commissioning.as_mut().filter(|current| current.ended.is_none()) else {
        return;
    };
    let connection = Device::connected(rig).map(|device| device.connection);
    if rig.stops() != current.stops {
        current.end("the rig was stopped");
    } else if connection != Some(current.device.connection) {
        current.end("the device was disconnected");
    } else if !rig.leases().is_held_by(current.session) {
        current.end("its client holds no lease any more");
    }
}

/// A client has gone. A pulse of its own ends at once, and not only along the ramp that its lease lapses by.
pub(super) fn gone(rig: &RigHandle, session: u64) {
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
        pulse::let_go(rig);
    }
}

/// Begins.
///
/// # Errors
/// Somebody else is at it, the rig is not idle, or the client has no lease that is short enough.
pub(super) async fn begin(rig: &RigHandle, by: Requester<'_>) -> Result<CommissionReply, WireError> {
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
    let Some(device) = Device::connected(rig) else {
        return wrong("cannot commission: no device is connected");
    };
    if !rig.leases().is_held_by(by.session) || rig.leases().longest_ms(by.session) > LONGEST_COMMISSION_LEASE_MS {
        return wrong(&format!(
            "cannot commission without a lease: take one of at most {LONGEST_COMMISSION_LEASE_MS} ms first (`lease`), so that all ends should this client die"
        ));
    }
    rig.feed().motion = Some(Motion::new(device.resolution_m));
    let entry = JournalEntry {
        by: Some(by.peer.clone()),
        message: Some(device.rig.key.clone()),
        ..JournalEntry::of("commission.begin")
    };
    rig.enter(Until::Done, entry);
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

/// How it stands, for the client whose it is.
///
/// # Errors
/// It is another's, or nobody's.
pub(super) fn status(rig: &RigHandle, by: Requester<'_>) -> Result<CommissionReply, WireError> {
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

/// The smaller of the daemon's and the device's limit, N.
fn largest_force_n(rig: &RigHandle, device: &Device) -> f64 {
    rig.facts.limits.force_n.min(device.force_limit_n)
}

/// The commissioning of a client that goes on and has no pulse under way.
fn at_rest(rig: &RigHandle, by: Requester<'_>) -> Result<Device, WireError> {
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
/// It is not bounded as it must be, another one is under way, or the rig may not be moved.
pub(super) async fn pulse(
    rig: &Rc<RigHandle>,
    by: Requester<'_>,
    force_n: f64,
    duration_ms: Option<f64>,
) -> Result<CommissionReply, WireError> {
    let device = at_rest(rig, by)?;
    let duration_ms = duration_ms.unwrap_or(USUAL_PULSE_MS);
    let out_of_range = |field: &str, value: f64, (min, max): (f64, f64), unit: &str| {
        let message = format!(
            "{field} = {} {unit} is out of range: it must be from {} to {} {unit}",
            number(value),
            number(min),
            number(max)
        );
        WireError::new(ErrorCode::OutOfRange, message)
            .about(field)
            .within(value, min, max, unit)
    };
    if !(PULSE_MS.0..=PULSE_MS.1).contains(&duration_ms) {
        return Err(out_of_range("duration_ms", duration_ms, PULSE_MS, "ms"));
    }
    let largest_n = LARGEST_SHARE * largest_force_n(rig, &device);
    if !(LEAST_FORCE_N..=largest_n).contains(&force_n.abs()) {
        return Err(out_of_range("force_N", force_n, (-largest_n, largest_n), "N"));
    }
    let shape = pulse::shape(force_n, duration_ms, device.resolution_m);
    // Refused now rather than later, while nobody waits.
    let admission = crate::control::admission::admit(rig, crate::control::admission::Purpose::Commissioning).await?;
    let stops = {
        let mut commissioning = rig.commissioning().borrow_mut();
        let Some(current) = commissioning.as_mut().filter(|current| !current.pulsing) else {
            return Err(WireError::new(ErrorCode::WrongState, "a pulse is under way"));
        };
        current.pulsing = true;
        current.stops
    };
    let (task_rig, peer) = (Rc::clone(rig), by.peer.clone());
    tokio::task::spawn_local(async move { pulse::run(&task_rig, shape, admission, stops, &peer).await });
    status(rig, by)
}

/// Takes in what came of a pulse. The rig is as it was before.
fn pulse_ended(rig: &RigHandle, report: Option<PulseReport>, interrupted: Option<String>) {
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
        if report.end == haptic_ipc::PulseEnd::WrongWay {
            current.end(
                "the handle moved against the force: the motor or the encoder is wired the other way (or somebody held the handle); nothing is kept",
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

/// Keeps what was found.
///
/// # Errors
/// The handle has not moved both ways yet, a number is none, or the file cannot be written.
pub(super) async fn store(
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
                "nothing to store: no {direction} pulse has moved the handle in the {direction} direction yet (`commission.pulse`)"
            );
            return Err(WireError::new(ErrorCode::WrongState, message).about("force_N"));
        }
    }
    for (field, value, unit) in [("range_m", range_m, "m"), ("friction_N", friction_n, "N")] {
        if let Some(value) = value.filter(|value| !(0.0..=LARGEST_FOUND).contains(value)) {
            let message = format!(
                "{field} = {} {unit} is out of range: it must be from 0 to {LARGEST_FOUND} {unit}",
                number(value)
            );
            return Err(WireError::new(ErrorCode::OutOfRange, message).about(field).within(
                value,
                0.0,
                LARGEST_FOUND,
                unit,
            ));
        }
    }
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let path = record::store(
        rig,
        record::Record {
            rig: device.rig.key,
            firmware: device.firmware,
            reversed: device.rig.reversed,
            resolution_m: device.resolution_m,
            step_m: found.step_m,
            range_m,
            friction_n,
            time_unix_s: now.as_secs_f64(),
            by: by.peer.to_string(),
        },
    )
    .await?;
    let path = path.display().to_string();
    let entry = JournalEntry {
        by: Some(by.peer.clone()),
        message: Some(path.clone()),
        ..JournalEntry::of("commission.store")
    };
    rig.enter(Until::Done, entry);
    if let Some(current) = rig.commissioning().borrow_mut().as_mut() {
        current.path = Some(path);
    }
    status(rig, by)
}

/// Ends it.
///
/// # Errors
/// It is another's, or nobody's.
pub(super) fn end(rig: &RigHandle, by: Requester<'_>) -> Result<CommissionReply, WireError> {
    status(rig, by)?;
    end_of(rig, by.session, "its client has ended it");
    status(rig, by)
}
