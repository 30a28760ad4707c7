//! One motion of the client that has the rig to itself, a pulse or an excitation: from its request over the engagement
//! and the release to its report, and the return of the scene.

use super::{begin_motion, end_if_over};
use crate::control::RigHandle;
use crate::control::admission::{self, Admission, Purpose};
use crate::control::peer::Requester;
use crate::control::rig::Asked;
use crate::control::rig::exclusive_use::Work;
use crate::log::{Level, say_at};
use crate::rt::space::FIRST_AXIS;
use crate::telemetry::feed::Feed;
use haptic_core::OwnMotion;
use haptic_core::planar::Plane;
use haptic_core::servo::Command;
use haptic_ipc::{Peer, RigState, WireError};
use std::rc::Rc;
use std::time::{Duration, Instant};

/// Time between two looks at the rig.
const POLL_PERIOD: Duration = Duration::from_millis(1);

/// Time that a ramp may take beyond its duration.
const RAMP_GRACE: Duration = Duration::from_secs(1);

/// A motion for which the client asks that has the rig to itself, and what is made of its records.
pub(in crate::control) struct ClientMotion<R, O> {
    pub(in crate::control) motion: OwnMotion,
    pub(in crate::control) purpose: Purpose,
    /// Time that it may take, until the handle rests again.
    pub(in crate::control) longest: Duration,
    /// Whether it may begin, once the rig is engaged.
    pub(in crate::control) is_ready: R,
    /// Begins to observe it, right before it begins; returns its direction on a rig of two axes.
    pub(in crate::control) observe: O,
    /// Whether it has ended and the handle rests again.
    pub(in crate::control) is_over: fn(&Feed) -> bool,
    /// Takes the report into the work, also of a motion that was interrupted. Returns why the work ends with it, if it
    /// does: the handle moved the wrong way.
    pub(in crate::control) report: fn(&RigHandle, &mut Work, bool) -> Option<&'static str>,
}

/// Admits the rig while the client waits for the answer, and begins the motion, which goes on beside the requests.
///
/// # Errors
/// The rig may not be moved, or another motion is under way.
pub(in crate::control) async fn begin<R, O>(
    rig: &Rc<RigHandle>,
    by: Requester<'_>,
    asked: ClientMotion<R, O>,
) -> Result<(), WireError>
where
    R: FnMut(&Feed) -> Result<bool, String> + 'static,
    O: FnOnce(&RigHandle) -> Result<Plane, WireError> + 'static,
{
    let admission = admission::admit(rig, asked.purpose).await?;
    let stops = begin_motion(rig, by.session)?;
    let (rig, peer) = (Rc::clone(rig), by.peer.clone());
    tokio::task::spawn_local(async move {
        let report = asked.report;
        let given = give(&rig, asked, admission, stops, &peer).await;
        take_back(&rig, &peer).await;
        let mut refuted = None;
        if let Some(current) = rig.exclusive_use.borrow_mut().as_mut() {
            current.moving = false;
            if let Some(why) = report(&rig, &mut current.work, given.is_err()) {
                // Before anybody hears of it, and may engage.
                rig.known.records.refute(&current.device);
                refuted = Some(current.device.clone());
                current.end(why);
            }
            if let Err(why) = given {
                current.end(&why);
            }
        }
        if let Some(device) = refuted
            && let Err(why) = rig.known.records.withdraw(&device).await
        {
            let left = "the record of a rig whose motor moves it the wrong way is left: remove it by hand";
            say_at(Level::Error, &format!("{left}: {why}"));
        }
    });
    Ok(())
}

/// Ends the force of a motion within one tick.
pub(super) fn rest(rig: &RigHandle) {
    rig.lend_loop(OwnMotion::REST, FIRST_AXIS);
}

/// Engages without a scene, and has the motion rendered from when it may begin until it is over.
///
/// # Errors
/// The reason of an interruption.
async fn give<R, O>(
    rig: &RigHandle,
    mut asked: ClientMotion<R, O>,
    admission: Admission,
    stops: u64,
    by: &Peer,
) -> Result<(), String>
where
    R: FnMut(&Feed) -> Result<bool, String>,
    O: FnOnce(&RigHandle) -> Result<Plane, WireError>,
{
    rest(rig);
    rig.carry_out(Command::Engage, admission, stops, Asked::By(by))
        .await
        .map_err(|error| error.message)?;
    until(rig, rig.facts.ramp + RAMP_GRACE, |state| Ok(state == RigState::Engaged)).await?;
    until(rig, asked.longest, |_| (asked.is_ready)(&rig.feed())).await?;
    let along = (asked.observe)(rig).map_err(|error| error.message)?;
    rig.lend_loop(asked.motion, along);
    until(rig, asked.longest, |_| Ok((asked.is_over)(&rig.feed()))).await
}

/// Waits for a condition while the exclusive use is active and the rig is engaging or engaged.
///
/// # Errors
/// The exclusive use or the engagement has ended, the condition says why it never holds, or it does not hold after
/// `timeout`.
async fn until(
    rig: &RigHandle,
    timeout: Duration,
    mut condition: impl FnMut(RigState) -> Result<bool, String>,
) -> Result<(), String> {
    let began = Instant::now();
    loop {
        let state = rig.channel.state();
        end_if_over(rig);
        let ended = rig
            .exclusive_use
            .borrow()
            .as_ref()
            .and_then(|current| current.ended.clone());
        if let Some(why) = ended {
            return Err(why);
        }
        match state {
            RigState::Engaging | RigState::Engaged if condition(state)? => return Ok(()),
            // Where it comes from, its end says: a fault that lets the force down, or somebody's wish.
            RigState::Engaging | RigState::Engaged | RigState::Releasing => {}
            RigState::Faulted => return Err(rig.faulted()),
            state => return Err(format!("the rig is {state}")),
        }
        if began.elapsed() > timeout {
            return Err(format!("it took longer than {:.1} s", timeout.as_secs_f64()));
        }
        tokio::time::sleep(POLL_PERIOD).await;
    }
}

/// Takes the force away, and restores the scene.
async fn take_back(rig: &RigHandle, by: &Peer) {
    rest(rig);
    // A rig that is stopped, faulted or disconnected refuses a release, and has no force.
    rig.carry_out(Command::Release, Admission::NONE, rig.channel.stops(), Asked::By(by))
        .await
        .map_or_else(drop, drop);
    let began = Instant::now();
    while rig.channel.state().is_live() {
        if began.elapsed() > rig.facts.ramp + RAMP_GRACE {
            // The scene may only return without force.
            let stop = rig.raise_stop(by);
            rig.stopped(stop).await.map_or_else(drop, drop);
            break;
        }
        tokio::time::sleep(POLL_PERIOD).await;
    }
    rig.give_loop_back();
}
