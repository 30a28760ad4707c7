//! Elementary functions, from `libm` alone.
//!
//! The platform's own differ from one C library and one processor to the next in their last digit,
//! and a friction law carries that digit on. These give the same result in every build on every
//! machine; so a recorded run can be computed again, to the last bit. The crate is `no_std`, where
//! the platform's are out of reach. Nothing here may fuse a multiplication with an addition.

pub(crate) use libm::{
    atan2, ceil, copysign, cos, exp, expm1 as exp_m1, floor, log as ln, log1p as ln_1p, pow as powf, sincos as sin_cos,
    sqrt,
};

/// Smaller than anything that is felt, in SI units of any kind: a state below it is zero. A product
/// of two states above it is still a normal number.
pub(crate) const NOTHING: f64 = 1e-100;

/// `value`, or zero where it is next to nothing.
pub(crate) fn flush(value: f64) -> f64 {
    if value.abs() < NOTHING { 0.0 } else { value }
}
