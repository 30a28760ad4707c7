//! One pulse, and what is made of its report.

use super::motion::{self, ClientMotion};
use crate::control::RigHandle;
use crate::control::admission::Purpose;
use crate::control::peer::Requester;
use crate::control::rig::exclusive_use::state::Work;
use crate::rt::space::FIRST_AXIS;
use crate::telemetry::feed::Feed;
use crate::telemetry::motion::Motion;
use device_io::kinematics::{Kinematics, Reading};
use haptic_core::own_motion::{FARTHEST_PULSE_M, FASTEST_PULSE_MPS};
use haptic_core::planar::Plane;
use haptic_core::{OwnMotion, PulseShape};
use haptic_ipc::{ErrorCode, PulseEnd, WireError};
use std::f64::consts::TAU;
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
    let along = begin_along(rig)?;
    let asked = ClientMotion {
        along,
        motion: OwnMotion::pulse(shape, rig.facts.period_s())?,
        purpose: Purpose::Commissioning,
        longest: LONGEST,
        observe: move |feed: &mut Feed| {
            if let Some(motion) = feed.motion.as_mut() {
                motion.begin_pulse(shape, along);
            }
        },
        is_over: |feed| feed.motion.as_ref().is_some_and(Motion::pulse_is_over),
        report,
    };
    motion::begin(rig, by, asked).await
}

/// The direction in which one motor alone pushes the hand, from where it is; on a line there is only one. Notes where the
/// motors are.
fn begin_along(rig: &RigHandle) -> Result<Plane, WireError> {
    let mut exclusive_use = rig.exclusive_use().borrow_mut();
    let (Some(current), Some(kinematics)) = (exclusive_use.as_mut(), &rig.facts.kinematics) else {
        return Ok(FIRST_AXIS);
    };
    let Work::Commissioning(found) = &mut current.work else {
        return Ok(FIRST_AXIS);
    };
    let Some(motor) = found.motor else {
        return Ok(FIRST_AXIS);
    };
    let hand = hand_now(rig).filter(|hand| kinematics.inside(*hand));
    found.from = hand.and_then(|hand| kinematics.motors(hand));
    let Some(Reading::Position(pose)) = found.from.map(|motors| kinematics.reading(motors)) else {
        let message = "by its encoders the hand is outside the workspace: bring it there; if it is there, the plugs of the \
                       encoders are swapped, one counts the other way, or the home pose is another";
        return Err(WireError::new(ErrorCode::WrongState, message).about("state"));
    };
    let mut alone = [0.0; 2];
    alone[motor] = 1.0;
    let force = pose.jacobian.force(alone);
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

/// The way of each motor, m or rad: of an angle the shorter one.
fn moved(from: [f64; 2], to: [f64; 2], are_rotary: bool) -> [f64; 2] {
    [0, 1].map(|motor| {
        let way = to[motor] - from[motor];
        if are_rotary {
            way - TAU * (way / TAU).round()
        } else {
            way
        }
    })
}

/// Whether the hand has moved far enough to tell which motor did it.
fn has_moved(kinematics: &Kinematics, from: [f64; 2], to: [f64; 2], motion: &Motion) -> bool {
    let hand = |motors| match kinematics.reading(motors) {
        Reading::Position(pose) | Reading::Singular(pose) => Some(pose.position),
        Reading::CannotClose => None,
    };
    let way = hand(from).zip(hand(to)).map(|(from, to)| (to - from).length());
    way.is_some_and(|way| way >= motion.least_way_m())
}

/// Whether the encoder of the motor that was driven has moved the way of the force, and at least twice as far as the other.
fn is_the_motor(motor: usize, moved: [f64; 2], force_n: f64) -> bool {
    moved[motor] * force_n.signum() >= 2.0 * moved[1 - motor].abs()
}

fn report(rig: &RigHandle, work: &mut Work, was_interrupted: bool) -> Option<&'static str> {
    let Work::Commissioning(found) = work else { return None };
    found.pulses += 1;
    let to = hand_now(rig)
        .zip(rig.facts.kinematics)
        .and_then(|(hand, kinematics)| kinematics.motors(hand));
    let mut feed = rig.feed();
    let motion = feed.motion.as_mut()?;
    let mut report = motion.end_pulse(was_interrupted)?;
    if rig.facts.steady_delay_s() > MAX_DELAY_S {
        report.mass_kg = None;
    }
    let mut confirmed = motion.is_confirmed_by(&report);
    let mut is_swapped = false;
    if let (Some(motor), Some(kinematics), Some(from), Some(to)) = (found.motor, &rig.facts.kinematics, found.from, to)
    {
        let ways = moved(from, to, kinematics.are_rotary());
        report.motors_moved = Some(ways);
        is_swapped = has_moved(kinematics, from, to, motion) && !is_the_motor(motor, ways, report.force_n);
        confirmed &= !is_swapped;
    }
    found.positive_confirmed |= confirmed && report.force_n > 0.0;
    found.negative_confirmed |= confirmed && report.force_n < 0.0;
    let is_wrong = report.end == PulseEnd::WrongWay;
    found.last = Some(report);
    if is_swapped && !is_wrong {
        return Some(
            "the encoder of the motor that was driven did not move the way of the force, at least twice as far as the \
             other: the plugs of the motors or of the encoders are swapped, or the kinematics are not those of this rig; \
             nothing is stored",
        );
    }
    is_wrong.then_some(
        "the handle moved against the force: the motor or the encoder is wired the other way (or somebody held the \
         handle); nothing is stored",
    )
}
