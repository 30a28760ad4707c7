//! A point, a velocity or a force in the plane, and where force may flow.

use super::renderer::PlanarRenderer;
use crate::math::{flush, sqrt};
use crate::vector::Vector;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

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
}

/// What a cut to a length leaves of it: a part that was scaled to the length itself may round to beyond it.
const CUT: f64 = 1.0 - f64::EPSILON;

impl Vector for Plane {
    type Renderer = PlanarRenderer;

    const AXES: usize = 2;
    const ZERO: Self = Self::ZERO;

    fn of_axes(first: f64, second: f64) -> Self {
        Self::new(first, second)
    }

    fn first(self) -> f64 {
        self.x
    }

    fn second(self) -> f64 {
        self.y
    }

    fn parts(&mut self) -> impl Iterator<Item = &mut f64> {
        [&mut self.x, &mut self.y].into_iter()
    }

    fn length(self) -> f64 {
        self.length()
    }

    fn dot(self, other: Self) -> f64 {
        self.dot(other)
    }

    fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }

    fn is_in(self, workspace: Option<&Workspace>) -> bool {
        workspace.is_none_or(|workspace| workspace.contains(self))
    }

    fn flushed(self) -> Self {
        Self::new(flush(self.x), flush(self.y))
    }

    fn pointing(self, length: f64) -> Self {
        self * (length / self.length())
    }

    fn within(self, most: f64) -> Self {
        let length = self.length();
        if length > most {
            self * (most * CUT / length)
        } else {
            self
        }
    }

    /// What may be reached is within a step of `last`, or between such a place and zero: the convex hull of a disk and
    /// zero, on a line `last - step .. last + step` with zero. What is wanted beyond is reached as nearly as possible,
    /// so that two wanted forces that are near each other lead to two that are.
    fn reached_from(self, last: Self, step: f64) -> Self {
        let from_last = self - last;
        let (far, size) = (from_last.length(), last.length());
        if far <= step || step.is_nan() {
            return self;
        }
        if size > step {
            // Between the two lines from zero that touch the disk. `along` is towards `last`, `aside` away from that
            // line.
            let (along, across) = (last.dot(self) / size, last.cross(self) / size);
            let aside = across.abs();
            let sine = step / size;
            let cosine = sqrt(1.0 - sine * sine);
            let (up, out) = (along * cosine + aside * sine, aside * cosine - along * sine);
            if up < size * cosine {
                return if out <= 0.0 {
                    self
                } else if up <= 0.0 {
                    Self::ZERO
                } else {
                    let side = if across < 0.0 { -sine } else { sine };
                    (last * cosine + last.turned_left() * side) * (up / size)
                };
            }
        }
        last + from_last * (step / far)
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

impl Div<f64> for Plane {
    type Output = Self;
    fn div(self, divisor: f64) -> Self {
        Self::new(self.x / divisor, self.y / divisor)
    }
}

/// Where force may flow in the plane: a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Workspace {
    /// Its ends along x, m.
    pub x_m: [f64; 2],
    /// Its ends along y, m.
    pub y_m: [f64; 2],
}

impl Workspace {
    /// Whether a position, m, lies inside.
    #[must_use]
    pub fn contains(&self, position: Plane) -> bool {
        let within = |[low, high]: [f64; 2], value: f64| (low..=high).contains(&value);
        within(self.x_m, position.x) && within(self.y_m, position.y)
    }

    /// Its middle, m.
    #[must_use]
    pub fn middle(&self) -> Plane {
        let middle = |[low, high]: [f64; 2]| 0.5 * (low + high);
        Plane::new(middle(self.x_m), middle(self.y_m))
    }
}
