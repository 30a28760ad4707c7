//! Elementary functions, from `std` where it is there and from `libm` where it is not.

#[cfg(feature = "std")]
mod imp {
    pub(crate) fn sqrt(x: f64) -> f64 {
        x.sqrt()
    }
    pub(crate) fn exp(x: f64) -> f64 {
        x.exp()
    }
    pub(crate) fn exp_m1(x: f64) -> f64 {
        x.exp_m1()
    }
    pub(crate) fn ln_1p(x: f64) -> f64 {
        x.ln_1p()
    }
    pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
        x.sin_cos()
    }
    pub(crate) fn atan2(y: f64, x: f64) -> f64 {
        y.atan2(x)
    }
    pub(crate) fn powf(x: f64, y: f64) -> f64 {
        x.powf(y)
    }
    pub(crate) fn copysign(x: f64, y: f64) -> f64 {
        x.copysign(y)
    }
}

#[cfg(not(feature = "std"))]
mod imp {
    pub(crate) fn sqrt(x: f64) -> f64 {
        libm::sqrt(x)
    }
    pub(crate) fn exp(x: f64) -> f64 {
        libm::exp(x)
    }
    pub(crate) fn exp_m1(x: f64) -> f64 {
        libm::expm1(x)
    }
    pub(crate) fn ln_1p(x: f64) -> f64 {
        libm::log1p(x)
    }
    pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
        libm::sincos(x)
    }
    pub(crate) fn atan2(y: f64, x: f64) -> f64 {
        libm::atan2(y, x)
    }
    pub(crate) fn powf(x: f64, y: f64) -> f64 {
        libm::pow(x, y)
    }
    pub(crate) fn copysign(x: f64, y: f64) -> f64 {
        libm::copysign(x, y)
    }
}

pub(crate) use imp::{atan2, copysign, exp, exp_m1, ln_1p, powf, sin_cos, sqrt};
