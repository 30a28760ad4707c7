//! What a servo knows of the space that the hand moves in: on a line a place, a velocity or a force is an `f64`, in the
//! plane it is a [`Plane`](crate::planar::Plane).
//!
//! Limits of force, speed and distance are limits of a length, never of a part: a limit that is cut part by part turns
//! the force.

use crate::math::{copysign, flush};
use crate::planar::Workspace;
use crate::renderer::{Renderer, Rendering};
use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Neg, Sub};

/// A place, a velocity or a force, in SI units.
pub trait Vector:
    Copy
    + Debug
    + Default
    + PartialEq
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + 'static
{
    /// What renders a scene here.
    type Renderer: Rendering<Self>;

    /// Number of its parts.
    const AXES: usize;
    /// Nowhere, at rest, without force.
    const ZERO: Self;

    /// From its parts along the first axis and the second; a line has the first alone.
    fn of_axes(first: f64, second: f64) -> Self;

    /// Its part along the first axis.
    fn first(self) -> f64;

    /// Its part along the second axis; 0 on a line.
    fn second(self) -> f64;

    /// Its parts, one for each axis.
    fn parts(&mut self) -> impl Iterator<Item = &mut f64>;

    /// Its length, >= 0.
    fn length(self) -> f64;

    /// The scalar product.
    fn dot(self, other: Self) -> f64;

    /// Whether each part is a finite number.
    fn is_finite(self) -> bool;

    /// Whether it lies within a workspace of the plane; a line has none.
    fn is_in(self, workspace: Option<&Workspace>) -> bool;

    /// The same without parts that are next to nothing.
    fn flushed(self) -> Self;

    /// A vector of a length (>= 0) that points as this one does, which is not zero.
    fn pointing(self, length: f64) -> Self;

    /// The same, cut to a length (>= 0).
    fn within(self, most: f64) -> Self;

    /// How far towards this one a force that was `last` may come at once, where it may grow and turn by `step` (>= 0)
    /// and fall to zero at any rate. NaN as a step is no limit.
    fn reached_from(self, last: Self, step: f64) -> Self;
}

impl Vector for f64 {
    type Renderer = Renderer;

    const AXES: usize = 1;
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn of_axes(first: f64, _: f64) -> Self {
        first
    }

    #[inline(always)]
    fn first(self) -> f64 {
        self
    }

    #[inline(always)]
    fn second(self) -> f64 {
        0.0
    }

    fn parts(&mut self) -> impl Iterator<Item = &mut f64> {
        core::iter::once(self)
    }

    #[inline(always)]
    fn length(self) -> f64 {
        self.abs()
    }

    #[inline(always)]
    fn dot(self, other: Self) -> f64 {
        self * other
    }

    #[inline(always)]
    fn is_finite(self) -> bool {
        self.is_finite()
    }

    #[inline(always)]
    fn is_in(self, _: Option<&Workspace>) -> bool {
        true
    }

    #[inline(always)]
    fn flushed(self) -> Self {
        flush(self)
    }

    #[inline(always)]
    fn pointing(self, length: f64) -> Self {
        copysign(length, self)
    }

    /// Not by `clamp`, which asks first whether its limits are in order.
    #[inline(always)]
    fn within(self, most: f64) -> Self {
        let cut = if self < -most { -most } else { self };
        if cut > most { most } else { cut }
    }

    /// A change of sign is one change: were each side of zero allowed a step of its own, 20 N could become -5 N at
    /// once. By comparisons and not by `clamp`, which panics on a step that is not a number.
    #[inline(always)]
    fn reached_from(self, last: Self, step: f64) -> Self {
        let (least, most) = (last - step, last + step);
        let mut reached = self;
        if reached < least && reached < 0.0 {
            reached = least.min(0.0);
        }
        if reached > most && reached > 0.0 {
            reached = most.max(0.0);
        }
        reached
    }
}
