//! Dual numbers: a value with its exact derivatives, carried through every operation (forward-mode automatic
//! differentiation, Wengert, Comm. ACM 7(8), 1964). One expression then gives both a position and its Jacobian.

use std::ops::{Add, Div, Mul, Sub};

/// A number that depends on the positions of both motors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dual {
    pub(super) value: f64,
    /// Its derivatives by the position of each motor.
    pub(super) slopes: [f64; 2],
}

impl Dual {
    pub(super) fn constant(value: f64) -> Self {
        Self {
            value,
            slopes: [0.0; 2],
        }
    }

    /// The positions of both motors, each by itself.
    pub(super) fn of_motors([first, second]: [f64; 2]) -> [Self; 2] {
        [(first, [1.0, 0.0]), (second, [0.0, 1.0])].map(|(value, slopes)| Self { value, slopes })
    }

    /// A function of this number, by the function's value and slope here.
    fn through(self, value: f64, slope: f64) -> Self {
        Self {
            value,
            slopes: self.slopes.map(|own| slope * own),
        }
    }

    pub(super) fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.through(root, 0.5 / root)
    }

    pub(super) fn sin_cos(self) -> (Self, Self) {
        // Of `libm`, the same on every machine.
        let (sin, cos) = libm::sincos(self.value);
        (self.through(sin, cos), self.through(cos, -sin))
    }

    /// A function of two numbers, by its value and its slope by each of them.
    fn with(self, other: Self, value: f64, by_self: f64, by_other: f64) -> Self {
        let [a, b] = [0, 1].map(|motor| by_self * self.slopes[motor] + by_other * other.slopes[motor]);
        Self { value, slopes: [a, b] }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.with(other, self.value + other.value, 1.0, 1.0)
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.with(other, self.value - other.value, 1.0, -1.0)
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.with(other, self.value * other.value, other.value, self.value)
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        self.with(other, quotient, 1.0 / other.value, -quotient / other.value)
    }
}

impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self.through(factor * self.value, factor)
    }
}
