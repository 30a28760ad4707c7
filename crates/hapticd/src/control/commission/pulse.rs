//! One pulse, from the engagement to the release, and the scene back in its place.

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

/// How far the handle may go against the force: in counts of the encoder, and m. A count is noise.
const WRONG_WAY: (f64, f64) = (5.0, 1e-4);

/// Between two looks at the rig.
const LOOK: Duration = Duration::from_millis(1);

/// What a ramp may take beyond its time.
const RAMP_GRACE: Duration = Duration::from_secs(1);

/// What a pulse may take with its way back to rest.
const LONGEST: Duration = Duration::from_secs(4);

/// A pulse of a force (N) and duration (ms), on an encoder with such a distance between two counts
/// (m).
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

/// Ends the force of a pulse, in the tick that hears of it.
pub(super) fn rest(rig: &RigHandle) {
    if let Ok(rest) = Renderer::pulse(PulseShape::REST, rig.facts.period_s()) {
        rig.lend_loop(rest);
    }
}

/// Engages without a scene, gives the pulse, releases, and puts the scene back.
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

/// Until the handle rests again.
///
/// # Errors
/// What has interrupted it.
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

/// Waits for a condition, as long as the commissioning goes on and the rig is engaged or about to
/// be.
async fn until<T>(rig: &RigHandle, patience: Duration, mut so: impl FnMut(RigState) -> Option<T>) -> Result<T, String> {
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
        if let Some(found) = so(state) {
            return Ok(found);
        }
        if began.elapsed() > patience {
            return Err(format!("it took longer than {:.1} s", patience.as_secs_f64()));
        }
        tokio::time::sleep(LOOK).await;
    }
}

/// Without force, and with the scene that there was.
async fn take_back(rig: &RigHandle, by: &Peer) {
    rest(rig);
    // A rig that is stopped, faulted or disconnected refuses, and has no force.
    rig.carry_out(Command::Release, Admission::NONE, rig.stops(), Some(by))
        .await
        .map_or_else(drop, drop);
    let began = Instant::now();
    while rig.state().is_live() {
        if began.elapsed() > rig.facts.ramp + RAMP_GRACE {
            // Only without force may the scene come back.
            let stop = rig.raise_stop(by);
            rig.stopped(stop).await.map_or_else(drop, drop);
            break;
        }
        tokio::time::sleep(LOOK).await;
    }
    rig.give_loop_back();
}
