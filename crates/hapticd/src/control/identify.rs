//! `identify.begin`, `identify.excite`, `identify.status`, `identify.store` and `identify.end`: one client has a
//! commissioned rig to itself and draws the handle along courses, to identify what the handle moves; and what was found
//! of the rig itself is stored.

use crate::control::RigHandle;
use crate::control::admission::{self, Purpose};
use crate::control::facts::no_device;
use crate::control::peer::Requester;
use crate::control::rig::commission_record::CommissionState;
use crate::control::rig::exclusive_use::motion::{self, ClientMotion};
use crate::control::rig::exclusive_use::{self, largest_force_n, resting_device};
use crate::control::rig::exclusive_use::{ExclusiveUse, Identification, Work};
use crate::rt::space::FIRST_AXIS;
use crate::telemetry::excitation::ObservedExcitation;
use crate::telemetry::feed::Feed;
use crate::telemetry::motion::HandleMotion;
use haptic_core::rig_friction::RigFriction;
use haptic_core::{BoundError, Excitation, OwnMotion};
use haptic_ipc::{ErrorCode, ExcitationEnd, IdentificationReply, WireError};
use std::rc::Rc;
use std::time::Duration;

/// Share of the range, to either side of its middle, that an excitation may use.
const SHARE_OF_RANGE: f64 = 0.5;

/// Time that an excitation may take beyond its course: a device whose clock is slow, and the handle
/// that comes to rest.
const GRACE: Duration = Duration::from_secs(5);

/// Begins an identification.
///
/// # Errors
/// The rig may not be engaged, its range is not known, another client has it to itself, it is not
/// idle, or the client has no lease that is short enough.
pub(super) async fn begin(
    rig: &RigHandle,
    by: Requester<'_>,
    range_m: Option<f64>,
) -> Result<IdentificationReply, WireError> {
    let device = rig.facts.connected_device().ok_or_else(|| no_device("identify"))?;
    // An uncommissioned rig is refused now, and not when it is to move.
    admission::admit(rig, Purpose::Identification).await?;
    let known = rig.known.records.known(&device, false).await;
    let (known_m, friction_n) = match known {
        CommissionState::Commissioned { findings, .. } => (findings.range_m, findings.friction_n),
        CommissionState::Not { .. } => (None, None),
    };
    let Some(range_m) = range_m.or(known_m) else {
        let message = "cannot identify: the range of the handle is not known: give `range_m`, or have `haptic-ctl \
                       commission` find it";
        return Err(WireError::new(ErrorCode::WrongState, message).about("range_m"));
    };
    // Read by now, so that the client sees it.
    rig.known.frictions.of(&device).await;
    let work = Work::Identification(Identification {
        range_m,
        middle_m: rig.feed().newest().map_or(0.0, |record| record.device_position),
        friction_n,
        excitations: 0,
        last: None,
        path: None,
    });
    exclusive_use::begin(rig, by, work, &device).await?;
    status(rig, by)
}

/// The state of the identification, for its client.
///
/// # Errors
/// This client is not identifying the rig.
pub(super) fn status(rig: &RigHandle, by: Requester<'_>) -> Result<IdentificationReply, WireError> {
    let doing = "identifying the rig: `identify.begin`";
    let (current, work) = exclusive_use::of_client(rig, by, ExclusiveUse::identification_of, doing)?;
    let feed = rig.feed();
    let position_m = feed.motion.as_ref().map_or(work.middle_m, HandleMotion::position_m);
    let (_, force_limit_n) = largest_force_n(rig, &current.device);
    Ok(IdentificationReply {
        by: current.by.clone(),
        rig: current.device.rig.key.clone(),
        firmware: current.device.firmware.clone(),
        moving: current.moving,
        ended: current.ended.clone(),
        force_limit_n,
        range_m: work.range_m,
        middle_m: work.middle_m,
        travel_limit_m: travel_limit_m(&work, position_m),
        friction_n: work.friction_n,
        friction: rig
            .known
            .frictions
            .known(current.device.connection)
            .and_then(|known| known.identified()),
        resolution_m: current.device.resolution_m,
        ramp_ms: rig.facts.ramp.as_secs_f64() * 1e3,
        position_m,
        excitations: work.excitations,
        gone_s: feed.excitation.as_ref().map(ObservedExcitation::gone_s),
        last: work.last.clone(),
        path: work.path.clone(),
    })
}

/// Farthest that an excitation may go from a position, m.
fn travel_limit_m(work: &Identification, position_m: f64) -> f64 {
    (SHARE_OF_RANGE * work.range_m - (position_m - work.middle_m).abs()).max(0.0)
}

/// Begins an excitation.
///
/// # Errors
/// It is out of bounds, another one is under way, or the rig may not be moved.
pub(super) async fn excite(
    rig: &Rc<RigHandle>,
    by: Requester<'_>,
    excitation: Excitation,
) -> Result<IdentificationReply, WireError> {
    let now = status(rig, by)?;
    resting_device(rig)?;
    BoundError::check(
        "force_limit_N",
        excitation.force_limit_n,
        haptic_core::excitation::MIN_FORCE_N,
        now.force_limit_n,
        "N",
    )?;
    let travel_m = excitation.travel_limit_m;
    BoundError::check("travel_limit_m", travel_m, 0.0, now.travel_limit_m, "m")?;
    let asked = ClientMotion {
        motion: OwnMotion::excitation(excitation, rig.facts.period_s())?,
        purpose: Purpose::Identification,
        longest: Duration::from_secs_f64(1.1 * excitation.duration_s()) + GRACE,
        is_ready: |_: &Feed| Ok(true),
        observe: move |rig: &RigHandle| {
            let mut feed = rig.feed();
            let last = feed.newest().copied();
            feed.excitation = Some(ObservedExcitation::new(excitation, last));
            Ok(FIRST_AXIS)
        },
        is_over: |feed| feed.excitation.as_ref().is_some_and(ObservedExcitation::is_over),
        report,
    };
    motion::begin(rig, by, asked).await?;
    status(rig, by)
}

fn report(rig: &RigHandle, work: &mut Work, was_interrupted: bool) -> Option<&'static str> {
    let observed = rig.feed().excitation.take();
    let report = observed.and_then(|observed| observed.report(was_interrupted));
    let end = report.as_ref().map(|report| report.end);
    if let Work::Identification(done) = work {
        done.excitations += 1;
        done.last = report;
    }
    (end == Some(ExcitationEnd::WrongWay)).then_some(
        "the handle moved against the force: the motor or the encoder is wired the other way, or its firmware \
         has it so (or somebody moved the handle); its commissioning no longer counts",
    )
}

/// Stores what was identified of the rig itself.
///
/// # Errors
/// Nothing has moved the handle yet, a value is out of range, or the file cannot be written.
pub(super) async fn store(
    rig: &RigHandle,
    by: Requester<'_>,
    friction: RigFriction,
) -> Result<IdentificationReply, WireError> {
    let now = status(rig, by)?;
    let device = resting_device(rig)?;
    if now.excitations == 0 {
        let message = "nothing to store: no excitation has moved the handle yet (`identify.excite`)";
        return Err(WireError::new(ErrorCode::WrongState, message).about("friction"));
    }
    let path = rig.known.frictions.store(&device, friction, by.peer).await?;
    let path = path.display().to_string();
    rig.enter_done("identify.store", Some(by.peer), Some(path.clone()));
    if let Some(current) = rig.exclusive_use.borrow_mut().as_mut()
        && let Work::Identification(work) = &mut current.work
    {
        work.path = Some(path);
    }
    status(rig, by)
}

/// Ends the identification.
///
/// # Errors
/// This client is not identifying the rig.
pub(super) fn end(rig: &RigHandle, by: Requester<'_>) -> Result<IdentificationReply, WireError> {
    status(rig, by)?;
    exclusive_use::end(rig, by.session, "its client has ended it");
    status(rig, by)
}
