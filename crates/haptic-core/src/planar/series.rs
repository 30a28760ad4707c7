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
use crate::series::{RECIPROCAL, ROOM, first_root, value};
use core::mem::replace;

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
pub(super) struct Motion {
    /// Duration that the series' time 1 stands for, s.
    pub(super) step_s: f64,
    /// Share of it that the piece takes.
    pub(super) until: f64,
    /// Coefficients of the speed, m/s.
    pub(super) speed: [f64; ROOM],
    /// Coefficients of the velocity, m/s.
    pub(super) velocity_x: [f64; ROOM],
    pub(super) velocity_y: [f64; ROOM],
}

impl Motion {
    pub(super) fn velocity(&self, time: f64) -> Plane {
        Plane::new(value(&self.velocity_x, time), value(&self.velocity_y, time))
    }

    /// Way made since the piece began, m.
    pub(super) fn displacement(&self, time: f64) -> Plane {
        Plane::new(integral(&self.velocity_x, time), integral(&self.velocity_y, time)) * self.step_s
    }

    /// Length of that way, m.
    pub(super) fn path(&self, time: f64) -> f64 {
        integral(&self.speed, time) * self.step_s
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

/// The integral of a polynomial from zero.
fn integral(polynomial: &[f64; ROOM], time: f64) -> f64 {
    let mut terms = [0.0; ROOM];
    for k in 0..ROOM {
        terms[k] = polynomial[k] * RECIPROCAL[k + 1];
    }
    value(&terms, time) * time
}

/// A series of vectors, by its parts.
struct Vectors {
    x: [f64; ROOM],
    y: [f64; ROOM],
}

impl Vectors {
    const ZERO: Self = Self {
        x: [0.0; ROOM],
        y: [0.0; ROOM],
    };

    fn get(&self, k: usize) -> Plane {
        Plane::new(self.x[k], self.y[k])
    }

    fn set(&mut self, k: usize, to: Plane) {
        self.x[k] = to.x;
        self.y[k] = to.y;
    }
}

/// Sum of `a[i] . b[k - i]` for `i` from 1 to `k - 1`.
fn inner(a: &Vectors, b: &Vectors, k: usize) -> f64 {
    let mut sum = 0.0;
    for i in 1..k {
        sum += a.x[i] * b.x[k - i] + a.y[i] * b.y[k - i];
    }
    sum
}

/// Sum of `s[i] e[k - i]` for `i` from 1 to `k - 1`.
fn scaled(s: &[f64; ROOM], e: &Vectors, k: usize) -> Plane {
    let mut sum = Plane::ZERO;
    for (i, speed) in s.iter().enumerate().take(k).skip(1) {
        sum += e.get(k - i) * *speed;
    }
    sum
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

    /// The slide that goes on with `velocity`, which is not zero, for at most `step_s`.
    pub(super) fn goes_on(&self, velocity: Plane, pull: &Pull, step_s: f64) -> Motion {
        let speed = velocity.length();
        let mut w = Vectors::ZERO;
        let mut s = [0.0; ROOM];
        let mut e = Vectors::ZERO;
        w.set(0, velocity);
        s[0] = speed;
        e.set(0, velocity * (1.0 / speed));
        let Scales {
            share,
            slope,
            damped,
            rubbed,
            sprung,
        } = self.scales(step_s);
        let inverse = 1.0 / speed;
        let (mut last, mut until) = (f64::INFINITY, 1.0);
        for k in 0..ORDER {
            let pulled = match k {
                0 => pull.force * share,
                1 => pull.slope * slope - velocity * sprung,
                _ => w.get(k - 1) * (-sprung * RECIPROCAL[k]),
            };
            let newest = (pulled - w.get(k) * damped - e.get(k) * rubbed) * RECIPROCAL[k + 1];
            w.set(k + 1, newest);
            // e . e = 1 and w = s e, both of order k + 1.
            let n = k + 1;
            let turned = -0.5 * inner(&e, &e, n);
            s[n] = e.get(0).dot(newest) + speed * turned + inner(&w, &e, n);
            e.set(n, (newest - scaled(&s, &e, n) - e.get(0) * s[n]) * inverse);
            if let Some(share) = self.ends(newest, &mut last, k >= 2, n == ORDER) {
                until = share;
                break;
            }
        }
        Motion {
            step_s,
            until: keeps_speed(&s, until),
            speed: s,
            velocity_x: w.x,
            velocity_y: w.y,
        }
    }

    /// The slide that sets off from rest along `pull`, which exceeds the dynamic friction, for at most `step_s`: its
    /// velocity is `theta W`.
    pub(super) fn sets_off(&self, pull: &Pull, step_s: f64) -> Motion {
        let force = pull.force.length();
        let along = pull.force * (1.0 / force);
        let Scales {
            share,
            slope,
            damped,
            rubbed,
            sprung,
        } = self.scales(step_s);
        let first = share * (force - self.dynamic_force);
        let mut w = Vectors::ZERO;
        let mut s = [0.0; ROOM];
        let mut e = Vectors::ZERO;
        w.set(0, along * first);
        s[0] = first;
        e.set(0, along);
        let turns = rubbed / first;
        let inverse = 1.0 / first;
        let (mut last, mut until) = (self.impedance * first, 1.0);
        for k in 1..ORDER {
            // What is known of e[k]: its part along, and across what the older orders give.
            let lengthwise = -0.5 * inner(&e, &e, k);
            let older = scaled(&s, &e, k);
            let older_across = older - along * along.dot(older);
            let known = along * lengthwise - older_across * inverse;
            let pulled = match k {
                1 => pull.slope * slope,
                // x[k] = h v[k - 1] / k, and the velocity's order k - 1 is W[k - 2].
                _ => w.get(k - 2) * (-sprung * RECIPROCAL[k]),
            };
            let q = pulled - w.get(k - 1) * damped - known * rubbed;
            let q_along = along.dot(q);
            let q_across = q - along * q_along;
            let across = q_across * (1.0 / ((k + 1) as f64 + turns));
            let newest = along * (q_along * RECIPROCAL[k + 1]) + across;
            w.set(k, newest);
            e.set(k, known + across * inverse);
            s[k] = along.dot(newest) + first * lengthwise + inner(&w, &e, k);
            if let Some(share) = self.ends(newest, &mut last, k >= 3, k + 1 == ORDER) {
                until = share;
                break;
            }
        }
        Motion::shifted(&w, &s, 1, until, step_s)
    }

    /// The slide that begins where the pull has just come to the friction: its velocity is `theta^2 V`. The pull grows.
    pub(super) fn begins_to_slide(&self, pull: &Pull, step_s: f64) -> Motion {
        let along = pull.force * (1.0 / pull.force.length());
        let Scales {
            slope,
            damped,
            rubbed,
            sprung,
            ..
        } = self.scales(step_s);
        let across_of = |vector: Plane| vector - along * along.dot(vector);
        let mut v = Vectors::ZERO;
        let mut s = [0.0; ROOM];
        let mut e = Vectors::ZERO;
        e.set(0, along);
        let mut across = Plane::ZERO; // of V[k - 1]
        let (mut last, mut until) = (f64::INFINITY, 1.0);
        // Order k of the equation gives V[k - 1] along and e[k] across.
        for k in 1..=ORDER {
            let lengthwise = -0.5 * inner(&e, &e, k);
            let pulled = match k {
                1 => pull.slope * slope,
                2 => Plane::ZERO,
                // x[k] = h v[k - 1] / k, and the velocity's order k - 1 is V[k - 3].
                _ => v.get(k - 3) * (-sprung * RECIPROCAL[k]),
            };
            let known = if k >= 2 { pulled - v.get(k - 2) * damped } else { pulled };
            let newest_along = (along.dot(known) - rubbed * lengthwise) * RECIPROCAL[k + 1];
            let newest = along * newest_along + across;
            v.set(k - 1, newest);
            if k == 1 {
                s[0] = newest_along;
            } else {
                s[k - 1] = newest_along + s[0] * along.dot(e.get(k - 1)) + inner(&v, &e, k - 1);
            }
            let e_across = (across_of(known) - across * (k + 1) as f64) * (1.0 / rubbed);
            e.set(k, along * lengthwise + e_across);
            across = e_across * s[0] + across_of(scaled(&s, &e, k));
            if let Some(share) = self.ends(newest, &mut last, k >= 4, k == ORDER) {
                until = share;
                break;
            }
        }
        Motion::shifted(&v, &s, 2, until, step_s)
    }
}

impl Motion {
    /// From series of the velocity and the speed without their first `zeros` orders.
    fn shifted(velocity: &Vectors, speed: &[f64; ROOM], zeros: usize, until: f64, step_s: f64) -> Self {
        let shift = |series: &[f64; ROOM]| {
            let mut shifted = [0.0; ROOM];
            shifted[zeros..].copy_from_slice(&series[..ROOM - zeros]);
            shifted
        };
        Self {
            step_s,
            until: keeps_speed(speed, until),
            speed: shift(speed),
            velocity_x: shift(&velocity.x),
            velocity_y: shift(&velocity.y),
        }
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
fn keeps_speed(speed: &[f64; ROOM], until: f64) -> f64 {
    let mut changes = [0.0; ROOM];
    for k in 1..ROOM {
        changes[k] = speed[k].abs();
    }
    let bound = MAX_SHARE_OF_SPEED * speed[0];
    if value(&changes, until) <= bound {
        return until;
    }
    // The change is a convex function of time.
    let (mut low, mut high) = (0.0, until);
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        if value(&changes, middle) <= bound {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}
