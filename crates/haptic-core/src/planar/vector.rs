//! A point, a velocity or a force in the plane.

use crate::math::{flush, sqrt};
use core::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A vector of the plane, in SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Plane {
    /// Along the first axis.
    pub x: f64,
    /// Along the second axis.
    pub y: f64,
}

impl Plane {
    /// Nowhere, at rest, without force.
    pub const ZERO: Self = Self { x: 0.0, y: 0.0 };

    /// From its two parts.
    #[must_use]
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Its length. Lengths are between 1e-12 and 1e3 here: their squares neither vanish nor overflow.
    #[must_use]
    pub fn length(self) -> f64 {
        sqrt(self.dot(self))
    }

    /// The scalar product.
    #[must_use]
    pub fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    /// The area of the parallelogram from this vector to the other, positive to the left.
    #[must_use]
    pub fn cross(self, other: Self) -> f64 {
        self.x * other.y - self.y * other.x
    }

    /// A quarter turn to the left.
    #[must_use]
    pub fn turned_left(self) -> Self {
        Self::new(-self.y, self.x)
    }

    /// A bound on the length: the sum of its parts.
    pub(super) fn sum(self) -> f64 {
        self.x.abs() + self.y.abs()
    }

    /// The same without parts that are next to nothing.
    pub(super) fn flushed(self) -> Self {
        Self::new(flush(self.x), flush(self.y))
    }

    pub(super) fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }
}

impl Add for Plane {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }
}

impl AddAssign for Plane {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Plane {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }
}

impl Neg for Plane {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y)
    }
}

impl Mul<f64> for Plane {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self::new(self.x * factor, self.y * factor)
    }
}
