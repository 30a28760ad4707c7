//! One pulse, and what is made of its report.

use crate::control::RigHandle;
use crate::control::admission::Admission;
use crate::control::rig::exclusive_use::motion::{self, ExclusiveMotion};
use crate::control::rig::exclusive_use::state::Work;
use crate::telemetry::motion::Motion;
use haptic_core::pulse::{FARTHEST_PULSE_M, FASTEST_PULSE_MPS};
use haptic_core::{PulseShape, Renderer};
use haptic_ipc::{Peer, PulseEnd, PulseReport};
use std::time::Duration;

/// Share of a pulse that each of its edges takes.
const EDGE: f64 = 0.25;

/// How far the handle may move against the force: in encoder counts, and m. A count is noise.
const WRONG_WAY: (f64, f64) = (5.0, 1e-4);

/// Time that a pulse may take, until the handle rests again.
const LONGEST: Duration = Duration::from_secs(4);

/// Longest delay with which the mass is told, s: within it the force of a pulse hardly changes.
const MAX_DELAY_S: f64 = 5e-3;

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

/// Gives a pulse.
pub(super) async fn run(rig: &RigHandle, shape: PulseShape, admission: Admission, stops: u64, by: &Peer) {
    let given = match Renderer::pulse(shape, rig.facts.period_s()) {
        Err(error) => Err(error.to_string()),
        Ok(motion) => {
            let exclusive = ExclusiveMotion {
                motion,
                longest: LONGEST,
                admission,
                stops,
                by,
            };
            motion::lend(
                rig,
                exclusive,
                |feed| {
                    if let Some(motion) = feed.motion.as_mut() {
                        motion.begin_pulse(shape);
                    }
                },
                |feed| feed.motion.as_ref().is_some_and(Motion::pulse_is_over),
            )
            .await
        }
    };
    let was_interrupted = given.is_err();
    let mut report = rig
        .feed()
        .motion
        .as_mut()
        .and_then(|motion| motion.end_pulse(was_interrupted));
    if let Some(report) = &mut report
        && rig.facts.steady_delay_s() > MAX_DELAY_S
    {
        report.mass_kg = None;
    }
    ended(rig, report, given.err());
}

/// Processes the report of a pulse, after the scene is restored.
fn ended(rig: &RigHandle, report: Option<PulseReport>, interrupted: Option<String>) {
    let feed = rig.feed();
    let confirmed = report.as_ref().is_some_and(|report| {
        feed.motion
            .as_ref()
            .is_some_and(|motion| motion.is_confirmed_by(report))
    });
    let mut exclusive_use = rig.exclusive_use().borrow_mut();
    let Some(current) = exclusive_use.as_mut() else { return };
    current.moving = false;
    if let Work::Commissioning(found) = &mut current.work {
        found.pulses += 1;
        if let Some(report) = &report {
            found.positive_confirmed |= confirmed && report.force_n > 0.0;
            found.negative_confirmed |= confirmed && report.force_n < 0.0;
            found.last = Some(report.clone());
        }
    }
    if report.is_some_and(|report| report.end == PulseEnd::WrongWay) {
        current.end(
            "the handle moved against the force: the motor or the encoder is wired the other way (or somebody held the \
             handle); nothing is stored",
        );
    }
    if let Some(why) = interrupted {
        current.end(&why);
    }
}
