//! One pulse, and what is made of its report.

use crate::control::RigHandle;
use crate::control::admission::Purpose;
use crate::control::peer::Requester;
use crate::control::rig::both_motors::DrivenAlone;
use crate::control::rig::exclusive_use::Work;
use crate::control::rig::exclusive_use::motion::{self, ClientMotion};
use crate::rt::space::FIRST_AXIS;
use crate::telemetry::feed::Feed;
use crate::telemetry::motion::HandleMotion;
use crate::telemetry::rest::Wait;
use device_io::kinematics::{Kinematics, Reading};
use haptic_core::own_motion::{FARTHEST_PULSE_M, FASTEST_PULSE_MPS};
use haptic_core::planar::Plane;
use haptic_core::{OwnMotion, PulseShape};
use haptic_ipc::{ErrorCode, PulseEnd, WireError};
use std::f64::consts::TAU;
use std::hash::{BuildHasher, RandomState};
use std::rc::Rc;
use std::time::Duration;

/// Share of a pulse that each of its edges takes.
const EDGE: f64 = 0.25;

/// How far the handle may move against the force: in encoder counts, and m. A count is noise.
const WRONG_WAY: (f64, f64) = (5.0, 1e-4);

/// Time that a pulse may take, until the handle rests again; and, before, that the handle may take to rest.
const MAX_PULSE: Duration = Duration::from_secs(7);

/// Longest delay with which the mass is reported, s: within it the force of a pulse hardly changes.
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
    // Refused at once where there is none. The rig engages first, and meanwhile the hand may move on.
    direction(rig)?;
    // From 0 to 1 by chance: the hash has a key of its own.
    let chance = RandomState::new().hash_one(());
    #[expect(clippy::cast_precision_loss, reason = "any share does")]
    let mut wait = Wait::new(shape.duration_s(), chance as f64 / u64::MAX as f64);
    let asked = ClientMotion {
        motion: OwnMotion::pulse(shape, rig.facts.period_s())?,
        purpose: Purpose::Commissioning,
        longest: MAX_PULSE,
        is_ready: move |feed: &Feed| {
            feed.motion
                .as_ref()
                .map_or(Ok(true), |motion| motion.rests_for(&mut wait))
        },
        observe: move |rig: &RigHandle| {
            let along = direction(rig)?;
            if let Some(motion) = rig.feed().motion.as_mut() {
                motion.begin_pulse(shape, along);
            }
            Ok(along)
        },
        is_over: |feed| feed.motion.as_ref().is_some_and(HandleMotion::pulse_is_over),
        report,
    };
    motion::begin(rig, by, asked).await
}

/// The direction in which one motor alone pushes the hand, from where it is; on a line there is only one.
fn direction(rig: &RigHandle) -> Result<Plane, WireError> {
    let motor = match rig.exclusive_use.borrow().as_ref().map(|current| &current.work) {
        Some(Work::Commissioning(found)) => found.motor,
        _ => None,
    };
    let (Some(motor), Some(kinematics)) = (motor, &rig.facts.kinematics) else {
        return Ok(FIRST_AXIS);
    };
    let hand = hand_now(rig).filter(|hand| kinematics.inside(*hand));
    let motors = hand.and_then(|hand| kinematics.motors(hand));
    let Some(Reading::Position(pose)) = motors.map(|motors| kinematics.reading(motors)) else {
        let message = "by its encoders the hand is outside the workspace: bring it there; if it is there, the plugs of the \
                       encoders are swapped, one counts the other way, or the home pose is another";
        return Err(WireError::new(ErrorCode::WrongState, message).about("state"));
    };
    let force = pose.jacobian.force_of_motor(motor);
    Ok(force * (1.0 / force.length()))
}

/// Where the hand of a rig of two axes is, m.
fn hand_now(rig: &RigHandle) -> Option<Plane> {
    let feed = rig.feed();
    Some(Plane::new(
        feed.newest()?.device_position,
        feed.newest_y()?.device_position_m,
    ))
}

/// How the motors moved, by two places of the hand, m: each angle the shorter way.
fn driven_alone(kinematics: &Kinematics, hand: [Plane; 2]) -> Option<DrivenAlone> {
    let [at, to] = [kinematics.motors(hand[0])?, kinematics.motors(hand[1])?];
    let moved = [0, 1].map(|motor| {
        let distance = to[motor] - at[motor];
        if kinematics.are_rotary() {
            distance - TAU * (distance / TAU).round()
        } else {
            distance
        }
    });
    Some(DrivenAlone { at, moved })
}

/// How much farther than the other motor the one that was driven has carried the hand the way of the force, m, and the
/// other one than that either way: by how the hand moves with them in the middle of their travel.
fn leads_m(kinematics: &Kinematics, motor: usize, alone: DrivenAlone, force_n: f64) -> Option<(f64, f64)> {
    let DrivenAlone { at, moved } = alone;
    let middle = [0, 1].map(|motor| at[motor] + 0.5 * moved[motor]);
    let jacobian = kinematics.reading(middle).pose()?.jacobian;
    let own = jacobian.lead_m(motor, moved.map(|distance| distance * force_n.signum()));
    Some((own, jacobian.lead_m(1 - motor, moved.map(f64::abs))))
}

fn report(rig: &RigHandle, work: &mut Work, was_interrupted: bool) -> Option<&'static str> {
    let Work::Commissioning(found) = work else { return None };
    found.pulses += 1;
    let mut feed = rig.feed();
    let motion = feed.motion.as_mut()?;
    let hand = motion.pushed_hand();
    let delay_s = rig.facts.steady_delay_s();
    let delay = Duration::from_secs_f64(delay_s.clamp(0.0, MAX_DELAY_S));
    let (mut report, mut confirmed) = motion.end_pulse(was_interrupted, delay)?;
    if delay_s > MAX_DELAY_S {
        (report.mass_kg, report.mass_within_kg) = (None, None);
    }
    let is_wrong = report.end == PulseEnd::WrongWay;
    let mut is_swapped = false;
    if let (Some(motor), Some(kinematics)) = (found.motor, &rig.facts.kinematics) {
        let alone = hand.and_then(|hand| driven_alone(kinematics, hand));
        report.motors_moved = alone.map(|alone| alone.moved);
        let leads_m = alone.and_then(|alone| leads_m(kinematics, motor, alone, report.force_n));
        let least_m = motion.least_travel_m();
        // In between, a longer pulse tells. A motor that is merely reversed still leads, the wrong way.
        is_swapped = leads_m.is_some_and(|(own, other)| own <= -least_m && (other > 0.0 || !is_wrong));
        confirmed &= leads_m.is_some_and(|(own, _)| own >= least_m);
        found.alone = alone.filter(|_| confirmed).or(found.alone);
    }
    found.confirmed[usize::from(report.force_n < 0.0)] += u32::from(confirmed);
    found.last = Some(report);
    if is_swapped {
        return Some(
            "by its own encoder the motor that was driven did not carry the hand the way of the force, and farther than the \
             other motor did: the plugs of the motors or of the encoders are swapped, or the kinematics are not those of \
             this rig; nothing is stored, and an earlier commissioning no longer counts",
        );
    }
    is_wrong.then_some(
        "the handle moved against the force: the motor or the encoder is wired the other way, or its firmware \
         has it so (or somebody held the handle); nothing is stored, and an earlier commissioning no longer counts",
    )
}
