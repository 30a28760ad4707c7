//! Takes the rig's own friction away below the rendered surface: a feed-forward along the motion,
//! which can never push by itself.
//!
//! The force is a share of what was identified, along the velocity, and zero near zero velocity. The
//! rig's real friction may be far lower than on the day when it was identified, and a share of a
//! friction that is not there would drive the handle. No estimate can distinguish that from a hand that
//! pulls, so energy bounds it: an account, in the way of the passivity controller of Hannaford and
//! Ryu 2002, holds what has been taken out of the motion since the last rest:
//!
//! ```text
//! account += assured share x identified friction x distance  -  motor force x distance
//! ```
//!
//! The motor's force is all of it: surface, compensation and what the limits made of them. A surface
//! that slides takes out more than any compensation puts in, and keeps the account full. Without one
//! only the assured share of the friction fills it, and the compensation fades until it gives no
//! more than that. What a spring of the surface took it takes from the account when it gives it back.
//! The account holds little, and at rest nothing.
//!
//! So whenever it acts, the motor has given at most a full account beyond the assured share of the
//! friction, since whichever moment after the last rest: a handle that is left alone comes to rest on
//! every rig whose friction is more than the assured share of the identified one.

use crate::directional::Direction;
use crate::math::copysign;
use crate::passivity::RigLosses;
use crate::rig_friction::RigFriction;
use crate::snapshot::Archive;

/// Largest share of the rig's friction that may be compensated. The rest is more than identified
/// friction differs between two directions, two places and two days.
pub const MAX_SHARE: f64 = 0.8;

/// Share of the identified friction that counts as taken up by the rig. A guide that has become warm
/// or was lubricated may have half of its friction left; a handle that is left alone must come to
/// rest on that one too.
pub const ASSURED_SHARE: f64 = 0.4;

/// Distance over which the identified friction fills the account, m: far less than a stroke.
const RESERVE_M: f64 = 1e-3;

/// Speed for which the account has room where friction is viscous alone, m/s: a hand that explores.
const RESERVE_SPEED_MPS: f64 = 0.1;

/// Counts of the encoder by which a position may change without a movement.
const SLACK_COUNTS: f64 = 2.0;

/// The same, m: the noise of an encoder that counts more finely than it measures.
const MIN_SLACK_M: f64 = 10e-6;

/// Time without movement after which the handle counts as at rest, s.
const REST_S: f64 = 0.1;

/// Speed up to which nothing is compensated, in counts a sample: the noise of an estimated velocity.
const DEAD_COUNTS: f64 = 0.25;

/// Speed from which on all of it is compensated, in counts a sample.
const FULL_COUNTS: f64 = 1.0;

/// The least of the former, m/s: friction below it is rather presliding than dynamic.
const MIN_DEAD_MPS: f64 = 1e-3;

/// What is compensated.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Compensation {
    /// Share of the friction, at most 0.8 ([`MAX_SHARE`]).
    pub share: f64,
    /// The friction.
    pub friction: RigFriction,
}

impl Compensation {
    /// What is left of losses of the rig, whichever way it moves.
    #[must_use]
    pub fn left_of(&self, losses: RigLosses) -> RigLosses {
        let share = self.bounded_share();
        RigLosses {
            damping: (losses.damping - share * self.friction.viscous.greatest()).max(0.0),
            friction: (losses.friction - share * self.friction.dynamic_force.greatest()).max(0.0),
        }
    }

    fn bounded_share(&self) -> f64 {
        self.share.clamp(0.0, MAX_SHARE)
    }
}

/// The motion at a sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampledMotion {
    /// Since the sample before, s; 0 without a new one.
    pub(crate) elapsed_s: f64,
    /// m
    pub(crate) position: f64,
    /// m/s
    pub(crate) velocity: f64,
    /// Distance between two positions that the device can distinguish, m.
    pub(crate) resolution: f64,
    /// Nominal time between two samples, s (> 0).
    pub(crate) period_s: f64,
}

/// Compensates one rig's friction.
#[derive(Clone, Debug)]
pub(crate) struct Compensator {
    share: f64,
    friction: RigFriction,
    assured: RigLosses,
    /// What a full account holds, J.
    reserve_j: f64,
    account_j: f64,
    before: Option<Before>,
    /// Time without movement, s.
    still_s: f64,
    /// Time between the last two samples, s: a slow device's force stays for as long.
    sample_s: f64,
}

/// What there was at the sample before.
#[derive(Clone, Copy, Debug, Default)]
struct Before {
    position: f64,
    /// The position without noise: it is dragged along by the measured one with slack.
    dragged: f64,
    /// All force of the motor since then, N.
    motor_n: f64,
}

impl Compensator {
    /// Saves or loads the account.
    pub(crate) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("account_J", &mut self.account_j);
        archive.option("has_sample", &mut self.before, Before::default(), |archive, before| {
            archive.number("sample_m", &mut before.position);
            archive.number("dragged_m", &mut before.dragged);
            archive.number("motor_N", &mut before.motor_n);
        });
        archive.number("still_s", &mut self.still_s);
        archive.number("sample_s", &mut self.sample_s);
    }

    /// With an empty account.
    pub(crate) fn new(compensation: Compensation) -> Self {
        let friction = compensation.friction;
        let losses = friction.losses();
        let most_n = friction.dynamic_force.greatest() + RESERVE_SPEED_MPS * friction.viscous.greatest();
        Self {
            share: compensation.bounded_share(),
            friction,
            assured: RigLosses {
                damping: ASSURED_SHARE * losses.damping,
                friction: ASSURED_SHARE * losses.friction,
            },
            reserve_j: RESERVE_M * most_n,
            account_j: 0.0,
            before: None,
            still_s: 0.0,
            sample_s: 0.0,
        }
    }

    /// No force flows: the account is empty.
    pub(crate) fn rest(&mut self) {
        (self.account_j, self.before) = (0.0, None);
        (self.still_s, self.sample_s) = (0.0, 0.0);
    }

    /// All force of the motor until the next sample, N.
    pub(crate) fn applied(&mut self, motor_n: f64) {
        if let Some(before) = &mut self.before {
            before.motor_n = motor_n;
        }
    }

    /// The force that compensates the rig's friction at a sample, N.
    pub(crate) fn force(&mut self, motion: SampledMotion) -> f64 {
        self.keep_account(motion);
        // A NaN account also gives zero.
        if self.account_j > 0.0 { self.wanted(motion) } else { 0.0 }
    }

    fn keep_account(&mut self, motion: SampledMotion) {
        if motion.elapsed_s > 0.0 {
            self.sample_s = motion.elapsed_s;
        }
        let Some(before) = &mut self.before else {
            self.before = Some(Before {
                position: motion.position,
                dragged: motion.position,
                motor_n: 0.0,
            });
            return;
        };
        let slack = (SLACK_COUNTS * motion.resolution).max(MIN_SLACK_M);
        let dragged = before.dragged.max(motion.position - slack).min(motion.position + slack);
        let distance = (dragged - before.dragged).abs();
        let given_j = before.motor_n * (motion.position - before.position);
        before.dragged = dragged;
        before.position = motion.position;
        self.still_s = if distance > 0.0 {
            0.0
        } else {
            self.still_s + motion.elapsed_s
        };
        if self.still_s > REST_S {
            self.account_j = 0.0;
            return;
        }
        let speed = if motion.elapsed_s > 0.0 {
            distance / motion.elapsed_s
        } else {
            0.0
        };
        let taken_j = (self.assured.friction + self.assured.damping * speed) * distance;
        self.account_j = (self.account_j + taken_j - given_j).min(self.reserve_j);
    }

    fn wanted(&self, motion: SampledMotion) -> f64 {
        let speed = motion.velocity.abs();
        let count_mps = motion.resolution / motion.period_s;
        let dead = (DEAD_COUNTS * count_mps).max(MIN_DEAD_MPS);
        let full = (FULL_COUNTS * count_mps).max(4.0 * MIN_DEAD_MPS);
        let moving = ((speed - dead) / (full - dead)).clamp(0.0, 1.0);
        let direction = if motion.velocity > 0.0 {
            Direction::Positive
        } else {
            Direction::Negative
        };
        let friction = &self.friction;
        let along_n = friction.dynamic_force.get(direction) + friction.viscous.get(direction) * speed;
        let cogging_n = friction
            .cogging
            .filter(|cogging| cogging.absolute_position)
            .map_or(0.0, |cogging| cogging.force(motion.position));
        let whole_n = self.share * (copysign(along_n, motion.velocity) + cogging_n);
        // Until the next sample no more than there is may be given.
        let coming_j = whole_n.abs() * speed * self.sample_s.max(motion.period_s);
        let funded = (self.account_j / self.reserve_j.max(coming_j)).min(1.0);
        whole_n * moving * funded
    }
}

#[cfg(test)]
mod tests;
