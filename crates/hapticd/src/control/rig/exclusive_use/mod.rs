//! One client has the rig to itself and moves the handle by motions of its own: by pulses, with
//! which a rig is commissioned, or along courses, from which it is identified.
//!
//! A motion is handled like a scene: compiled here, sent like one, and rendered by the loop
//! within all its limits, between an engagement and a release of its own. The motion of the handle
//! is read from the records of the ticks. Whatever ends the exclusive use ends its motion at once, and
//! restores the scene.

pub(in crate::control) mod motion;

use crate::control::RigHandle;
use crate::control::facts::no_device;
use crate::control::peer::Requester;
use crate::control::rig::both_motors::DrivenAlone;
use crate::control::rig::refused_in;
use crate::telemetry::motion::HandleMotion;
use device_io::link::DeviceInfo;
use haptic_core::scene::Coupling;
use haptic_ipc::{ErrorCode, ExcitationReport, MAX_COMMISSION_LEASE_MS, Peer, PulseReport, RigState, WireError};
use std::cell::Ref;

/// Largest share of the rig's force limit that a motion may have.
const MAX_SHARE: f64 = 0.5;

/// A client's use of the rig; it is kept until the next one begins.
#[derive(Debug)]
pub(in crate::control) struct ExclusiveUse {
    pub(in crate::control) session: u64,
    pub(in crate::control) by: Peer,
    pub(in crate::control) device: DeviceInfo,
    /// The count of stops when it began: a further stop ends it.
    pub(in crate::control) stops: u64,
    pub(in crate::control) moving: bool,
    pub(in crate::control) ended: Option<String>,
    pub(in crate::control) work: Work,
}

/// What a client uses the rig for.
#[derive(Debug)]
pub(in crate::control) enum Work {
    Commissioning(Commissioning),
    Identification(Identification),
}

#[derive(Debug, Default)]
pub(in crate::control) struct Commissioning {
    /// Of a rig of two axes the motor, counted from 0.
    pub(in crate::control) motor: Option<usize>,
    /// What the newest confirmed pulse has shown of such a motor.
    pub(in crate::control) alone: Option<DrivenAlone>,
    pub(in crate::control) pulses: u64,
    pub(in crate::control) last: Option<PulseReport>,
    /// How many positive and how many negative pulses have moved the handle their way.
    pub(in crate::control) confirmed: [u32; 2],
    pub(in crate::control) path: Option<String>,
    pub(in crate::control) coupling: Option<Coupling>,
}

/// What an identification may do, and what it has done.
#[derive(Debug)]
pub(in crate::control) struct Identification {
    /// Travel of the handle between its ends, m.
    pub(in crate::control) range_m: f64,
    /// Place of the handle when it began, m.
    pub(in crate::control) middle_m: f64,
    pub(in crate::control) friction_n: Option<f64>,
    pub(in crate::control) excitations: u64,
    pub(in crate::control) last: Option<ExcitationReport>,
    pub(in crate::control) path: Option<String>,
}

impl Work {
    /// What its client does to the rig, as in "cannot commission"; the same as in "is commissioning"; and its name, as in
    /// "the commissioning has ended".
    fn words(&self) -> [&'static str; 3] {
        match self {
            Self::Commissioning(_) => ["commission", "commissioning", "commissioning"],
            Self::Identification(_) => ["identify", "identifying", "identification"],
        }
    }
}

impl ExclusiveUse {
    /// Whether it keeps all other clients out.
    fn is_active(&self) -> bool {
        self.ended.is_none() || self.moving
    }

    pub(in crate::control) fn end(&mut self, why: &str) {
        self.ended.get_or_insert_with(|| why.to_owned());
    }

    /// The commissioning of a client, if this is one.
    pub(in crate::control) fn commissioning_of(&self, session: u64) -> Option<&Commissioning> {
        match &self.work {
            Work::Commissioning(found) if self.session == session => Some(found),
            _ => None,
        }
    }

    /// The identification of a client, if this is one.
    pub(in crate::control) fn identification_of(&self, session: u64) -> Option<&Identification> {
        match &self.work {
            Work::Identification(found) if self.session == session => Some(found),
            _ => None,
        }
    }
}

/// Gives a client the rig to itself, for some work with the device that is connected.
///
/// # Errors
/// Another client has the rig to itself, the rig is not idle, the client has no lease that is short
/// enough, or the device is not one for that work.
pub(in crate::control) async fn begin(
    rig: &RigHandle,
    by: Requester<'_>,
    work: Work,
    expected: &DeviceInfo,
) -> Result<(), WireError> {
    let stops = rig.channel.stops();
    let [verb, _, name] = work.words();
    if rig.facts.is_plane() && matches!(work, Work::Identification(_)) {
        let message = format!("cannot {verb} a rig of two axes: that is for one axis");
        return Err(WireError::new(ErrorCode::NotApplicable, message));
    }
    let (_turn, state) = rig.quiet_state().await;
    refuse_others(rig, &format!("{verb} the rig"))?;
    rig.schedule().refuse(&format!("{verb} the rig"))?;
    let is_disconnected = state == RigState::Disconnected;
    if let Some(refusal) = rig.refusal_in(state, verb).filter(|_| !is_disconnected) {
        return Err(refusal);
    }
    if state.is_live() {
        return Err(refused_in(state, ErrorCode::WrongState, verb, "release it first"));
    }
    let connected = rig.facts.connected_device().map(|device| device.connection);
    if is_disconnected || connected != Some(expected.connection) {
        return Err(no_device(verb));
    }
    let device = expected.clone();
    let timeout_ms = rig.leases.timeout_ms(by.session);
    if timeout_ms.is_none_or(|timeout_ms| timeout_ms > MAX_COMMISSION_LEASE_MS) {
        let message = format!(
            "cannot {verb} without a lease: take one of at most {MAX_COMMISSION_LEASE_MS} ms first (`lease`), so \
             that the {name} ends if this client dies"
        );
        return Err(WireError::new(ErrorCode::WrongState, message).about("state"));
    }
    begin_observing(rig, device.resolution_m);
    let op = format!("{verb}.begin");
    rig.enter_done(&op, Some(by.peer), Some(device.rig.key.clone()));
    *rig.exclusive_use.borrow_mut() = Some(ExclusiveUse {
        session: by.session,
        by: by.peer.clone(),
        device,
        stops,
        moving: false,
        ended: None,
        work,
    });
    Ok(())
}

/// Observes the handle from the newest tick on: the first answer says where it lies, before there is another tick.
fn begin_observing(rig: &RigHandle, resolution_m: f64) {
    let mut feed = rig.feed();
    let mut motion = HandleMotion::new(resolution_m);
    let feed_y = feed.newest_y();
    if let Some(newest) = feed.newest() {
        motion.take(newest, feed_y);
    }
    feed.motion = Some(motion);
}

/// The newest exclusive use, which has ended if it is over.
fn newest(rig: &RigHandle) -> Ref<'_, Option<ExclusiveUse>> {
    end_if_over(rig);
    rig.exclusive_use.borrow()
}

/// The exclusive use of a client and its work, which `of` finds; `doing` names that in the refusal.
///
/// # Errors
/// The client does no such work.
pub(in crate::control) fn of_client<'a, W>(
    rig: &'a RigHandle,
    by: Requester<'_>,
    of: impl Fn(&ExclusiveUse, u64) -> Option<&W>,
    doing: &str,
) -> Result<(Ref<'a, ExclusiveUse>, Ref<'a, W>), WireError> {
    let found = Ref::filter_map(newest(rig), Option::as_ref).ok();
    let work = found
        .as_ref()
        .and_then(|found| Ref::filter_map(Ref::clone(found), |found| of(found, by.session)).ok());
    found.zip(work).ok_or_else(|| {
        let message = format!("this client is not {doing} comes first");
        WireError::new(ErrorCode::WrongState, message).about("state")
    })
}

/// The device of the current exclusive use, if that is active and has no motion under way.
///
/// # Errors
/// It has ended, or a motion is under way.
pub(in crate::control) fn resting_device(rig: &RigHandle) -> Result<DeviceInfo, WireError> {
    let exclusive_use = newest(rig);
    let state = rig.channel.state();
    let Some(current) = exclusive_use.as_ref() else {
        return Err(WireError::new(ErrorCode::WrongState, "no exclusive session is active").about("state"));
    };
    if let Some(why) = &current.ended {
        let code = match state {
            RigState::Stopped => ErrorCode::Stopped,
            RigState::Faulted => ErrorCode::Faulted,
            _ => ErrorCode::WrongState,
        };
        let [.., name] = current.work.words();
        return Err(WireError::new(code, format!("the {name} has ended: {why}")).about("state"));
    }
    if current.moving {
        let message = "a motion is still under way: ask for the status until it is over";
        return Err(WireError::new(ErrorCode::WrongState, message).about("state"));
    }
    Ok(current.device.clone())
}

/// Begins a motion of a client that has the rig to itself; returns the count of stops when its sole
/// use began.
///
/// # Errors
/// Its exclusive use has ended, or a motion is under way.
fn begin_motion(rig: &RigHandle, session: u64) -> Result<u64, WireError> {
    resting_device(rig)?;
    let mut exclusive_use = rig.exclusive_use.borrow_mut();
    // Another client may have begun while this one waited.
    let Some(current) = exclusive_use.as_mut().filter(|current| current.session == session) else {
        return Err(WireError::new(ErrorCode::WrongState, "another client has the rig to itself").about("state"));
    };
    current.moving = true;
    Ok(current.stops)
}

/// The force limit of the rig, N: the smaller of the daemon's and the device's; and the largest
/// force of a motion.
pub(in crate::control) fn largest_force_n(rig: &RigHandle, device: &DeviceInfo) -> (f64, f64) {
    let limit_n = rig.facts.limits().force_n.min(device.force_limit_n);
    (limit_n, MAX_SHARE * limit_n)
}

/// Ends the exclusive use of a client, and its motion at once.
pub(in crate::control) fn end(rig: &RigHandle, session: u64, why: &str) {
    let moving = {
        let mut exclusive_use = rig.exclusive_use.borrow_mut();
        let Some(current) = exclusive_use.as_mut().filter(|current| current.session == session) else {
            return;
        };
        current.end(why);
        current.moving
    };
    if moving {
        motion::rest(rig);
    }
}

/// The exclusive use that keeps all other clients out.
fn active(rig: &RigHandle) -> Option<Ref<'_, ExclusiveUse>> {
    Ref::filter_map(newest(rig), |newest| {
        newest.as_ref().filter(|newest| newest.is_active())
    })
    .ok()
}

/// The client that has the rig to itself.
pub(in crate::control) fn by(rig: &RigHandle) -> Option<Peer> {
    active(rig).map(|active| active.by.clone())
}

/// Refuses what would disturb an exclusive use.
///
/// # Errors
/// A client has the rig to itself; the error says which.
pub(in crate::control) fn refuse_others(rig: &RigHandle, what: &str) -> Result<(), WireError> {
    let Some(active) = active(rig) else { return Ok(()) };
    let [_, doing, _] = active.work.words();
    let message = format!(
        "cannot {what} while {} is {doing} the rig: wait for its end, or end it with `stop`",
        active.by
    );
    Err(WireError::new(ErrorCode::Commissioning, message).about("state"))
}

/// Ends the exclusive use if the rig was stopped, its device has changed, or its lease has expired or was
/// lengthened.
pub(in crate::control) fn end_if_over(rig: &RigHandle) {
    let mut exclusive_use = rig.exclusive_use.borrow_mut();
    let Some(current) = exclusive_use.as_mut().filter(|current| current.ended.is_none()) else {
        return;
    };
    let connection = rig.facts.connected_device().map(|device| device.connection);
    if rig.channel.stops() != current.stops {
        current.end("the rig was stopped");
    } else if connection != Some(current.device.connection) {
        current.end("the device was disconnected");
    } else {
        match rig.leases.timeout_ms(current.session) {
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
