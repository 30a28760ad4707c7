//! One pulse, from the engagement to the release, and the return of the scene.

use super::watch;
use crate::control::RigHandle;
use crate::control::admission::Admission;
use haptic_core::pulse::{FARTHEST_PULSE_M, FASTEST_PULSE_MPS};
use haptic_core::servo::Command;
use haptic_core::{PulseShape, Renderer};
use haptic_ipc::{Peer, RigState};
use std::time::{Duration, Instant};

/// Share of a pulse that each of its edges takes.
const EDGE: f64 = 0.25;

/// How far the handle may move against the force: in encoder counts, and m. A count is noise.
const WRONG_WAY: (f64, f64) = (5.0, 1e-4);

/// Time between two looks at the rig.
const POLL_PERIOD: Duration = Duration::from_millis(1);

/// Time that a ramp may take beyond its duration.
const RAMP_GRACE: Duration = Duration::from_secs(1);

/// Time that a pulse may take, until the handle rests again.
const LONGEST: Duration = Duration::from_secs(4);

/// A pulse of a force (N) and duration (ms), on an encoder of this resolution (m).
pub(super) fn shape(force_n: f64, duration_ms: f64, resolution_m: f64) -> PulseShape {
    let duration_s = duration_ms * 1e-3;
    let edge_s = EDGE * duration_s;
    let (counts, least_m) = WRONG_WAY;
    PulseShape {
        force_n,
        rise_s: edge_s,
        hold_s: duration_s - 2.0 * edge_s,
        fall_s: edge_s,
        travel_limit_m: FARTHEST_PULSE_M,
        speed_limit_mps: FASTEST_PULSE_MPS,
        wrong_way_limit_m: (counts * resolution_m).max(least_m).min(FARTHEST_PULSE_M),
    }
}

/// Ends the force of a pulse within one tick.
pub(super) fn rest(rig: &RigHandle) {
    if let Ok(rest) = Renderer::pulse(PulseShape::REST, rig.facts.period_s()) {
        rig.lend_loop(rest);
    }
}

/// Engages without a scene, gives the pulse, releases, and restores the scene.
pub(super) async fn run(rig: &RigHandle, shape: PulseShape, admission: Admission, stops: u64, by: &Peer) {
    let given = give(rig, shape, admission, stops, by).await;
    let was_interrupted = given.is_err();
    take_back(rig, by).await;
    let report = rig
        .feed()
        .motion
        .as_mut()
        .and_then(|motion| motion.end_pulse(was_interrupted));
    watch::pulse_ended(rig, report, given.err());
}

/// Gives the pulse, and waits until the handle rests again.
///
/// # Errors
/// The reason of an interruption.
async fn give(rig: &RigHandle, shape: PulseShape, admission: Admission, stops: u64, by: &Peer) -> Result<(), String> {
    let pulse = Renderer::pulse(shape, rig.facts.period_s()).map_err(|error| error.to_string())?;
    rest(rig);
    rig.carry_out(Command::Engage, admission, stops, Some(by))
        .await
        .map_err(|error| error.message)?;
    until(rig, rig.facts.ramp + RAMP_GRACE, |state| {
        (state == RigState::Engaged).then_some(())
    })
    .await?;
    if let Some(motion) = rig.feed().motion.as_mut() {
        motion.begin_pulse(shape);
    }
    rig.lend_loop(pulse);
    until(rig, LONGEST, |_| {
        let feed = rig.feed();
        let motion = feed.motion.as_ref()?;
        motion.pulse_is_over().then_some(())
    })
    .await
}

/// Waits for a condition while the commissioning is active and the rig is engaging or engaged.
///
/// # Errors
/// The commissioning or the engagement has ended, or the condition does not hold after `timeout`.
async fn until<T>(
    rig: &RigHandle,
    timeout: Duration,
    mut condition: impl FnMut(RigState) -> Option<T>,
) -> Result<T, String> {
    let began = Instant::now();
    loop {
        let state = rig.state();
        watch::look(rig);
        let ended = rig
            .commissioning()
            .borrow()
            .as_ref()
            .and_then(|current| current.ended.clone());
        if let Some(why) = ended {
            return Err(why);
        }
        if !matches!(state, RigState::Engaging | RigState::Engaged) {
            let fault = rig.feed().newest().and_then(|record| record.fault);
            let why = fault.map_or_else(String::new, |fault| format!(": {fault}"));
            return Err(format!("the rig is {state}{why}"));
        }
        if let Some(found) = condition(state) {
            return Ok(found);
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
    rig.carry_out(Command::Release, Admission::NONE, rig.stops(), Some(by))
        .await
        .map_or_else(drop, drop);
    let began = Instant::now();
    while rig.state().is_live() {
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
