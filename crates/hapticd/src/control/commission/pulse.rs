//! One pulse, and what is made of its report.

use super::motion::{self, ClientMotion};
use crate::control::RigHandle;
use crate::control::admission::Purpose;
use crate::control::peer::Requester;
use crate::control::rig::exclusive_use::state::Work;
use crate::telemetry::feed::Feed;
use crate::telemetry::motion::Motion;
use haptic_core::own_motion::{FARTHEST_PULSE_M, FASTEST_PULSE_MPS};
use haptic_core::{OwnMotion, PulseShape};
use haptic_ipc::{PulseEnd, WireError};
use std::rc::Rc;
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

/// Begins a pulse.
///
/// # Errors
/// The rig may not be moved, or another motion is under way.
pub(super) async fn begin(rig: &Rc<RigHandle>, by: Requester<'_>, shape: PulseShape) -> Result<(), WireError> {
    let asked = ClientMotion {
        motion: OwnMotion::pulse(shape, rig.facts.period_s())?,
        purpose: Purpose::Commissioning,
        longest: LONGEST,
        observe: move |feed: &mut Feed| {
            if let Some(motion) = feed.motion.as_mut() {
                motion.begin_pulse(shape);
            }
        },
        is_over: |feed| feed.motion.as_ref().is_some_and(Motion::pulse_is_over),
        report,
    };
    motion::begin(rig, by, asked).await
}

fn report(rig: &RigHandle, work: &mut Work, was_interrupted: bool) -> Option<&'static str> {
    let Work::Commissioning(found) = work else { return None };
    found.pulses += 1;
    let mut feed = rig.feed();
    let motion = feed.motion.as_mut()?;
    let mut report = motion.end_pulse(was_interrupted)?;
    if rig.facts.steady_delay_s() > MAX_DELAY_S {
        report.mass_kg = None;
    }
    let confirmed = motion.is_confirmed_by(&report);
    found.positive_confirmed |= confirmed && report.force_n > 0.0;
    found.negative_confirmed |= confirmed && report.force_n < 0.0;
    let is_wrong = report.end == PulseEnd::WrongWay;
    found.last = Some(report);
    is_wrong.then_some(
        "the handle moved against the force: the motor or the encoder is wired the other way (or somebody held the \
         handle); nothing is stored",
    )
}
