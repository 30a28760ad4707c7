//! The last moments before a stop, in closed form.
//!
//! Under a pull `R` below the dynamic friction a slide stops in finite time, and turns towards `R` as it does: like
//! `(t* - t)^(R / (Fd - R))`, so that no series passes through the stop. With `R` constant the equation has a solution:
//! `Q = Fd s + R . w` falls linearly, and the angle between `R` and `w` gives the path. What `R` changes meanwhile is a
//! correction of the time, and bounds when this will do.

use super::series::{Pull, Sliding, TOLERANCE_N};
use super::vector::Plane;
use crate::math::sqrt;

/// Error of a stop's time, s.
const TIME_TOLERANCE_S: f64 = 1e-12;

/// Share of the dynamic friction below which a pull has no direction worth reporting.
const NO_PULL: f64 = 1e-9;

/// A stop.
pub(super) struct Landing {
    /// Time until then.
    pub(super) after_s: f64,
    /// Way made until then, m.
    pub(super) displacement: Plane,
}

impl Sliding {
    /// The stop of a slide with `velocity`, where it is near enough.
    pub(super) fn lands(&self, velocity: Plane, pull: &Pull) -> Option<Landing> {
        let (mass, fd) = (self.mass, self.dynamic_force);
        let (speed, force) = (velocity.length(), pull.force.length());
        if force >= fd {
            return None;
        }
        let brakes = (fd - force) * (fd + force);
        let (helped, less) = (pull.force.dot(velocity), fd - force);
        let first = mass * (fd * speed + helped) / brakes;
        let changes = self.damping / mass + (pull.slope.length() + self.stiffness * speed) / less;
        let change = first * changes;
        if self.stiffness * speed * first * change >= TOLERANCE_N || 4.0 * first * change * change >= TIME_TOLERANCE_S {
            return None;
        }
        let along = if force > NO_PULL * fd {
            pull.force * (1.0 / force)
        } else {
            velocity * (1.0 / speed)
        };
        let across = along.turned_left();
        let cosine = along.dot(velocity) / speed;
        let sine = across.dot(velocity) / speed;
        let (near, far) = (0.5 * (1.0 + cosine), 0.5 * (1.0 - cosine));
        let scale = mass * speed * speed;
        let displacement = along * (0.5 * scale * (near * near / less - far * far / (fd + force)))
            + across * (scale * sine * (near / (2.0 * fd - force) + far / (2.0 * fd + force)));
        let corrected = first * (1.0 - 0.5 * self.damping * first / mass)
            + (mass * pull.slope.dot(displacement) + pull.force.dot(pull.slope) * first * first) / brakes;
        Some(Landing {
            after_s: corrected.max(0.0),
            displacement,
        })
    }
}

/// When a pull that grows linearly comes to a length, N; `None` where it never does. It is shorter now.
pub(super) fn reaches(pull: &Pull, length: f64) -> Option<f64> {
    let a = pull.slope.dot(pull.slope);
    let b = pull.force.dot(pull.slope);
    // As a product, which keeps its digits near the limit.
    let now = pull.force.length();
    let c = (now - length) * (now + length);
    if a == 0.0 {
        return None;
    }
    let root = sqrt((b * b - a * c).max(0.0));
    Some(if b >= 0.0 { -c / (b + root) } else { (root - b) / a })
}
