//! One motion, from the engagement to the release, and the return of the scene.

use super::end_if_over;
use crate::control::RigHandle;
use crate::control::admission::Admission;
use crate::control::rig::Asked;
use crate::rt::space::FIRST_AXIS;
use crate::telemetry::feed::Feed;
use haptic_core::OwnMotion;
use haptic_core::planar::Plane;
use haptic_core::servo::Command;
use haptic_ipc::{Peer, RigState, WireError};
use std::time::{Duration, Instant};

/// Time between two looks at the rig.
const POLL_PERIOD: Duration = Duration::from_millis(1);

/// Time that a ramp may take beyond its duration.
const RAMP_GRACE: Duration = Duration::from_secs(1);

/// A motion that the loop renders for the client that has the rig to itself.
pub(in crate::control) struct ExclusiveMotion<'a> {
    pub(in crate::control) motion: OwnMotion,
    /// Time that it may take, until the handle rests again.
    pub(in crate::control) longest: Duration,
    pub(in crate::control) admission: Admission,
    /// The count of stops when the exclusive use began.
    pub(in crate::control) stops: u64,
    pub(in crate::control) by: &'a Peer,
}

/// Ends the force of a motion within one tick.
pub(in crate::control) fn rest(rig: &RigHandle) {
    rig.lend_loop(OwnMotion::REST, FIRST_AXIS);
}

/// Engages without a scene, has the motion rendered from when `is_ready` until it is over, releases, and restores the
/// scene. `observe` is called right before the motion begins, and says along which direction of two axes it goes.
///
/// # Errors
/// The reason of an interruption.
pub(in crate::control) async fn lend(
    rig: &RigHandle,
    exclusive: ExclusiveMotion<'_>,
    is_ready: impl FnMut(&Feed) -> Result<bool, String>,
    observe: impl FnOnce(&RigHandle) -> Result<Plane, WireError>,
    is_over: impl Fn(&Feed) -> bool,
) -> Result<(), String> {
    let by = exclusive.by;
    let given = give(rig, exclusive, is_ready, observe, is_over).await;
    take_back(rig, by).await;
    given
}

async fn give(
    rig: &RigHandle,
    exclusive: ExclusiveMotion<'_>,
    mut is_ready: impl FnMut(&Feed) -> Result<bool, String>,
    observe: impl FnOnce(&RigHandle) -> Result<Plane, WireError>,
    is_over: impl Fn(&Feed) -> bool,
) -> Result<(), String> {
    rest(rig);
    rig.carry_out(
        Command::Engage,
        exclusive.admission,
        exclusive.stops,
        Asked::By(exclusive.by),
    )
    .await
    .map_err(|error| error.message)?;
    until(rig, rig.facts.ramp + RAMP_GRACE, |state| Ok(state == RigState::Engaged)).await?;
    until(rig, exclusive.longest, |_| is_ready(&rig.feed())).await?;
    let along = observe(rig).map_err(|error| error.message)?;
    rig.lend_loop(exclusive.motion, along);
    until(rig, exclusive.longest, |_| Ok(is_over(&rig.feed()))).await
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
            .exclusive_use()
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
