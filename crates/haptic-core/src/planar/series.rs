//! A slide in the plane as a power series of time.
//!
//! The block obeys `M w' = R(t) - C w - Fd w / |w|`, where `R(t) = f0 + g1 t - K X` is the force on the block if it
//! stood still, `X` is its displacement since the start of the piece and `C = B + b`. Time is scaled so that the piece
//! covers 0 to 1. Each order of the velocity follows from the orders before it (Moore 1966), and the direction
//! `e = w / |w|` and the speed `s = |w|` from `w = s e` and `e . e = 1`.
//!
//! From rest `w / |w|` has no value; but `w / t` has one where the pull exceeds the friction, and `w / t^2` where it
//! only begins to.

use super::vector::Plane;
use crate::math::{powf, sqrt};
use crate::series::{RECIPROCAL, ROOM, first_root, halve, value};
use core::mem::replace;
use core::ops::{Add, Mul};

/// Up to this error, N, a series is carried on.
pub(super) const TOLERANCE_N: f64 = 1e-12;

/// Highest order of a series.
const ORDER: usize = 16;

/// The share of its speed that a slide may lose or gain in one piece: it neither stops nor turns round in it.
const MAX_SHARE_OF_SPEED: f64 = 0.9;

/// The block, its grip and its friction, in SI units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sliding {
    pub(super) mass: f64,
    pub(super) stiffness: f64,
    /// Of coupling and surface: `C = B + b`.
    pub(super) damping: f64,
    pub(super) dynamic_force: f64,
    /// What a change of velocity is worth in force, N s/m.
    pub(super) impedance: f64,
}

/// What multiplies the terms of the equation of motion, in velocity, m/s, over a piece.
pub(super) struct Scales {
    /// A force, N.
    pub(super) share: f64,
    /// The slope of a force, N/s.
    pub(super) slope: f64,
    /// The velocity.
    pub(super) damped: f64,
    /// The direction of the slide.
    pub(super) rubbed: f64,
    /// The velocity that has moved the block on.
    pub(super) sprung: f64,
}

/// The force on a block that stands still.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pull {
    /// N.
    pub(super) force: Plane,
    /// N/s.
    pub(super) slope: Plane,
}

/// The motion of one piece.
pub(super) struct PieceMotion {
    /// Duration that the series' time 1 stands for, s.
    pub(super) step_s: f64,
    /// Share of it that the piece takes.
    pub(super) until: f64,
    /// Order beyond which the coefficients are zero.
    pub(super) degree: usize,
    /// Coefficients of the speed, m/s.
    pub(super) speed: [f64; ROOM],
    /// Coefficients of the velocity, m/s.
    pub(super) velocity: Vectors,
}

/// A series of vectors.
pub(super) type Vectors = [Plane; ROOM];

impl PieceMotion {
    pub(super) fn velocity(&self, time: f64) -> Plane {
        value_up_to(self.degree, |k| self.velocity[k], time)
    }

    /// Displacement since the piece began, m.
    pub(super) fn displacement(&self, time: f64) -> Plane {
        value_up_to(self.degree, |k| self.velocity[k] * RECIPROCAL[k + 1], time) * time * self.step_s
    }

    /// Length of the path since then, m.
    pub(super) fn path(&self, time: f64) -> f64 {
        value_up_to(self.degree, |k| self.speed[k] * RECIPROCAL[k + 1], time) * time * self.step_s
    }

    /// The first time in the piece at which a slide that is faster than a speed, m/s, has fallen to it.
    pub(super) fn falls_to(&self, speed: f64) -> Option<f64> {
        let mut excess = self.speed;
        excess[0] -= speed;
        first_root(&excess, ORDER + 2, self.until)
    }

    /// The same of a slide that is slower where the piece begins and where it ends, and faster between.
    pub(super) fn rises_above_and_falls_to(&self, speed: f64) -> Option<f64> {
        let mut lack = self.speed.map(|coefficient| -coefficient);
        lack[0] += speed;
        let rises = first_root(&lack, ORDER + 2, self.until)?;
        // The speed as a polynomial of the time since then, and that over the time, which is not zero there.
        let mut since = lack.map(|coefficient| -coefficient);
        for from in 0..ROOM {
            for k in (from..ROOM - 1).rev() {
                since[k] += since[k + 1] * rises;
            }
        }
        let mut excess = [0.0; ROOM];
        excess[..ROOM - 1].copy_from_slice(&since[1..]);
        (excess[0] > 0.0)
            .then(|| first_root(&excess, ORDER + 1, self.until - rises))?
            .map(|after| rises + after)
    }
}

/// Most slides need no higher order.
const LOW_ORDER: usize = 11;

/// A polynomial's value by its coefficients, which are zero beyond its degree; the bits are those of [`value`].
#[inline(always)]
fn value_up_to<T: Copy + Add<Output = T> + Mul<f64, Output = T>>(
    degree: usize,
    coefficient: impl Fn(usize) -> T,
    time: f64,
) -> T {
    if degree > LOW_ORDER {
        return value(&core::array::from_fn(coefficient), time);
    }
    let second = time * time;
    let fourth = second * second;
    let pair = |k: usize| coefficient(k) + coefficient(k + 1) * time;
    let four = |k: usize| pair(k) + pair(k + 2) * second;
    (four(0) + four(4) * fourth) + four(8) * (fourth * fourth)
}

/// The products of the parts, which a processor forms both at once.
#[inline(always)]
fn by_part(a: Plane, b: Plane) -> Plane {
    Plane::new(a.x * b.x, a.y * b.y)
}

/// Sum of `a[i] . b[k - i]` for `i` from 1 to `k - 1`.
#[inline(always)]
fn inner(a: &Vectors, b: &Vectors, k: usize) -> f64 {
    let mut sum = Plane::ZERO;
    for i in 1..k {
        sum += by_part(a[i], b[k - i]);
    }
    sum.x + sum.y
}

/// Half of [`inner`] of a series with itself, whose terms come in pairs.
#[inline(always)]
fn half_square(e: &Vectors, k: usize) -> f64 {
    let mut sum = Plane::ZERO;
    for i in 1..k.div_ceil(2) {
        sum += by_part(e[i], e[k - i]);
    }
    if k.is_multiple_of(2) {
        sum += by_part(e[k / 2], e[k / 2]) * 0.5;
    }
    sum.x + sum.y
}

/// Sum of `s[i] e[k - i]` for `i` from 1 to `k - 1`.
#[inline(always)]
fn scaled(s: &[f64; ROOM], e: &Vectors, k: usize) -> Plane {
    let mut sum = Plane::ZERO;
    for i in 1..k {
        sum += e[k - i] * s[i];
    }
    sum
}

/// What the orders of a series are added by.
struct Growing<'a> {
    pull: &'a Pull,
    scales: Scales,
    direction: Vectors,
    /// `1 / speed`, s/m.
    inverse: f64,
    /// The last term, N.
    last: f64,
}

impl Sliding {
    pub(super) fn new(mass: f64, stiffness: f64, damping: f64, dynamic_force: f64) -> Self {
        Self {
            mass,
            stiffness,
            damping,
            dynamic_force,
            impedance: damping.max(sqrt(stiffness * mass)),
        }
    }

    /// The equation of motion in the time of a piece.
    pub(super) fn scales(&self, step_s: f64) -> Scales {
        let share = step_s / self.mass;
        Scales {
            share,
            slope: share * step_s,
            damped: share * self.damping,
            rubbed: share * self.dynamic_force,
            sprung: share * self.stiffness * step_s,
        }
    }

    /// Takes the newest velocity of a series into its `last` term, N. Returns up to which share of the piece it
    /// converges where it ends there: with small terms, of which there are `enough`, or with its highest order.
    fn ends(&self, newest: Plane, last: &mut f64, enough: bool, is_highest: bool) -> Option<f64> {
        let before = replace(last, self.impedance * newest.sum());
        if enough && *last < TOLERANCE_N && before < 4.0 * TOLERANCE_N {
            Some(1.0)
        } else {
            is_highest.then(|| converges_until(before, *last))
        }
    }

    /// The slide that goes on with `velocity`, which is not zero, for at most the time of a [`PieceMotion::at_rest`], which
    /// it is written into: to return it costs a copy.
    pub(super) fn goes_on(&self, velocity: Plane, pull: &Pull, motion: &mut PieceMotion) {
        let speed = velocity.length();
        let mut growing = Growing {
            pull,
            scales: self.scales(motion.step_s),
            direction: [Plane::ZERO; ROOM],
            inverse: 1.0 / speed,
            last: f64::INFINITY,
        };
        growing.direction[0] = velocity * growing.inverse;
        motion.velocity[0] = velocity;
        motion.speed[0] = speed;
        // Orders are constants to the compiler: nothing is left of the loops.
        'orders: {
            macro_rules! add_orders {
                ($($k:literal)*) => {
                    $(
                        if let Some(until) = self.add_order($k, motion, &mut growing) {
                            motion.degree = $k + 1;
                            motion.until = keeps_speed(&motion.speed, motion.degree, until);
                            break 'orders;
                        }
                    )*
                };
            }
            add_orders!(0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15);
        }
    }

    /// Adds the order after `k`; returns as [`ends`](Self::ends).
    #[inline(always)]
    fn add_order(&self, k: usize, motion: &mut PieceMotion, growing: &mut Growing<'_>) -> Option<f64> {
        let (w, s, e) = (&mut motion.velocity, &mut motion.speed, &mut growing.direction);
        let scales = &growing.scales;
        let pulled = match k {
            0 => growing.pull.force * scales.share,
            1 => growing.pull.slope * scales.slope - w[0] * scales.sprung,
            _ => w[k - 1] * (-scales.sprung * RECIPROCAL[k]),
        };
        let newest = (pulled - w[k] * scales.damped - e[k] * scales.rubbed) * RECIPROCAL[k + 1];
        // e . e = 1 and w = s e, both of order k + 1.
        let n = k + 1;
        w[n] = newest;
        let turned = -half_square(e, n);
        s[n] = e[0].dot(newest) + s[0] * turned + inner(w, e, n);
        e[n] = (newest - scaled(s, e, n) - e[0] * s[n]) * growing.inverse;
        self.ends(newest, &mut growing.last, k >= 2, n == ORDER)
    }

    /// The slide that sets off from rest along `pull`, which exceeds the dynamic friction, for at most `step_s`: its
    /// velocity is `theta W`.
    pub(super) fn sets_off(&self, pull: &Pull, step_s: f64) -> PieceMotion {
        let force = pull.force.length();
        let along = pull.force * (1.0 / force);
        let scales = self.scales(step_s);
        let first = scales.share * (force - self.dynamic_force);
        let mut w = [Plane::ZERO; ROOM];
        let mut s = [0.0; ROOM];
        let mut e = [Plane::ZERO; ROOM];
        w[0] = along * first;
        s[0] = first;
        e[0] = along;
        let turns = scales.rubbed / first;
        let inverse = 1.0 / first;
        let (mut last, mut until) = (self.impedance * first, 1.0);
        for k in 1..ORDER {
            // What is known of e[k]: its part along, and across what the older orders give.
            let lengthwise = -half_square(&e, k);
            let older = scaled(&s, &e, k);
            let older_across = older - along * along.dot(older);
            let known = along * lengthwise - older_across * inverse;
            let pulled = match k {
                1 => pull.slope * scales.slope,
                // x[k] = h v[k - 1] / k, and the velocity's order k - 1 is W[k - 2].
                _ => w[k - 2] * (-scales.sprung * RECIPROCAL[k]),
            };
            let q = pulled - w[k - 1] * scales.damped - known * scales.rubbed;
            let q_along = along.dot(q);
            let q_across = q - along * q_along;
            let across = q_across * (1.0 / ((k + 1) as f64 + turns));
            let newest = along * (q_along * RECIPROCAL[k + 1]) + across;
            w[k] = newest;
            e[k] = known + across * inverse;
            s[k] = along.dot(newest) + first * lengthwise + inner(&w, &e, k);
            if let Some(share) = self.ends(newest, &mut last, k >= 3, k + 1 == ORDER) {
                until = share;
                break;
            }
        }
        PieceMotion::shifted(&w, &s, 1, until, step_s)
    }

    /// The slide that begins where the pull has just come to the friction: its velocity is `theta^2 V`. The pull grows.
    pub(super) fn begins_to_slide(&self, pull: &Pull, step_s: f64) -> PieceMotion {
        let along = pull.force * (1.0 / pull.force.length());
        let scales = self.scales(step_s);
        let across_of = |vector: Plane| vector - along * along.dot(vector);
        let mut v = [Plane::ZERO; ROOM];
        let mut s = [0.0; ROOM];
        let mut e = [Plane::ZERO; ROOM];
        e[0] = along;
        let mut across = Plane::ZERO; // of V[k - 1]
        let (mut last, mut until) = (f64::INFINITY, 1.0);
        // Order k of the equation gives V[k - 1] along and e[k] across.
        for k in 1..=ORDER {
            let lengthwise = -half_square(&e, k);
            let pulled = match k {
                1 => pull.slope * scales.slope,
                2 => Plane::ZERO,
                // x[k] = h v[k - 1] / k, and the velocity's order k - 1 is V[k - 3].
                _ => v[k - 3] * (-scales.sprung * RECIPROCAL[k]),
            };
            let known = if k >= 2 {
                pulled - v[k - 2] * scales.damped
            } else {
                pulled
            };
            let newest_along = (along.dot(known) - scales.rubbed * lengthwise) * RECIPROCAL[k + 1];
            let newest = along * newest_along + across;
            v[k - 1] = newest;
            if k == 1 {
                s[0] = newest_along;
            } else {
                s[k - 1] = newest_along + s[0] * along.dot(e[k - 1]) + inner(&v, &e, k - 1);
            }
            let e_across = (across_of(known) - across * (k + 1) as f64) * (1.0 / scales.rubbed);
            e[k] = along * lengthwise + e_across;
            across = e_across * s[0] + across_of(scaled(&s, &e, k));
            if let Some(share) = self.ends(newest, &mut last, k >= 4, k == ORDER) {
                until = share;
                break;
            }
        }
        PieceMotion::shifted(&v, &s, 2, until, step_s)
    }
}

impl PieceMotion {
    /// Without any motion, for all of the piece.
    pub(super) fn at_rest(step_s: f64) -> Self {
        Self {
            step_s,
            until: 1.0,
            degree: ROOM - 1,
            speed: [0.0; ROOM],
            velocity: [Plane::ZERO; ROOM],
        }
    }

    /// From series of the velocity and the speed without their first `zeros` orders.
    fn shifted(velocity: &Vectors, speed: &[f64; ROOM], zeros: usize, until: f64, step_s: f64) -> Self {
        let mut shifted = Self::at_rest(step_s);
        shifted.until = keeps_speed(speed, shifted.degree, until);
        shifted.speed[zeros..].copy_from_slice(&speed[..ROOM - zeros]);
        shifted.velocity[zeros..].copy_from_slice(&velocity[..ROOM - zeros]);
        shifted
    }
}

/// Share of the piece up to which its last two terms, N, are within the tolerance.
fn converges_until(before_last: f64, last: f64) -> f64 {
    let order = ORDER as f64;
    let of_last = powf(TOLERANCE_N / last, 1.0 / order);
    let of_before = powf(TOLERANCE_N / before_last, 1.0 / (order - 1.0));
    (0.9 * of_last.min(of_before)).min(0.95)
}

/// Share of the piece, up to `until`, within which the speed keeps a part of its first value.
fn keeps_speed(speed: &[f64; ROOM], degree: usize, until: f64) -> f64 {
    let change = |time| value_up_to(degree, |k| if k == 0 { 0.0 } else { speed[k].abs() }, time);
    let bound = MAX_SHARE_OF_SPEED * speed[0];
    if change(until) <= bound {
        return until;
    }
    // The change is a convex function of time.
    let (low, high) = halve(0.0, until, 12, |time| change(time) <= bound);
    if low > 0.0 {
        return low;
    }
    // A slide that has hardly set off is there far sooner, and a piece of no time would be no progress. A convex change
    // that begins at zero is below its chord.
    high * (bound / change(high))
}
