//! Velocity from encoder positions.
//!
//! An encoder reports where the handle is to one count, so the difference of two samples is mostly
//! the noise of counting. Each estimator trades that noise against lag; the damper of the coupling
//! feels both. All of them take the time that really passed between two samples, by the device's
//! own clock.

mod alpha_beta_gamma;
mod finite_difference;
mod foaw;

pub use alpha_beta_gamma::{AlphaBetaGamma, DEFAULT_MEMORY};

use finite_difference::{DEFAULT_CUTOFF_HZ, FiniteDifference, LowPass};
use foaw::{Fit, Foaw};

use crate::nearest::meant_or_semicolon;
use crate::snapshot::Archive;
use alloc::string::{String, ToString};
use core::fmt;
use core::str::FromStr;
use thiserror::Error;

/// Which estimator to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(into = "String", try_from = "String"))]
pub enum Method {
    /// The difference to the sample before.
    FiniteDifference,
    /// That difference behind a first-order low-pass of 100 Hz.
    LowPass,
    /// A tracker of position, velocity and acceleration.
    #[default]
    AlphaBetaGamma,
    /// The longest window that a straight line from end to end explains.
    FoawEndFit,
    /// The longest window that a straight line fits, by least squares.
    FoawBestFit,
}

/// Every method, in the order of the comparison.
pub const METHODS: [Method; 5] = [
    Method::FiniteDifference,
    Method::LowPass,
    Method::AlphaBetaGamma,
    Method::FoawEndFit,
    Method::FoawBestFit,
];

impl Method {
    /// Its name, as it is written and read.
    const fn name(self) -> &'static str {
        match self {
            Self::FiniteDifference => "finite-difference",
            Self::LowPass => "low-pass",
            Self::AlphaBetaGamma => "alpha-beta-gamma",
            Self::FoawEndFit => "foaw-end-fit",
            Self::FoawBestFit => "foaw-best-fit",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A text that names no estimator.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "unknown velocity estimator `{0}`{meant} the estimators are {known}",
    meant = meant_or_semicolon(.0, &METHODS.map(Method::name)),
    known = METHODS.map(Method::name).join(", ")
)]
pub struct UnknownMethod(String);

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(text: &str) -> Result<Self, UnknownMethod> {
        METHODS
            .into_iter()
            .find(|method| method.name() == text)
            .ok_or_else(|| UnknownMethod(text.to_string()))
    }
}

#[cfg(feature = "serde")]
impl From<Method> for String {
    fn from(method: Method) -> Self {
        method.to_string()
    }
}

#[cfg(feature = "serde")]
impl TryFrom<String> for Method {
    type Error = UnknownMethod;

    fn try_from(text: String) -> Result<Self, UnknownMethod> {
        text.parse()
    }
}

/// An estimator, ready to use.
#[derive(Clone, Copy, Debug)]
pub struct Estimator(EstimatorKind);

#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is one for a device; a box would be an allocation"
)]
enum EstimatorKind {
    FiniteDifference(FiniteDifference),
    LowPass(LowPass),
    AlphaBetaGamma(AlphaBetaGamma),
    Foaw(Foaw),
}

impl Estimator {
    /// An estimator for samples every `period_s` seconds (> 0), from an encoder with counts of
    /// `resolution_m` (m, >= 0).
    #[must_use]
    pub fn new(method: Method, period_s: f64, resolution_m: f64) -> Self {
        Self(match method {
            Method::FiniteDifference => EstimatorKind::FiniteDifference(FiniteDifference::default()),
            Method::LowPass => EstimatorKind::LowPass(LowPass::new(DEFAULT_CUTOFF_HZ)),
            Method::AlphaBetaGamma => EstimatorKind::AlphaBetaGamma(AlphaBetaGamma::new(period_s)),
            Method::FoawEndFit => EstimatorKind::Foaw(Foaw::new(Fit::End, resolution_m)),
            Method::FoawBestFit => EstimatorKind::Foaw(Foaw::new(Fit::Best, resolution_m)),
        })
    }

    /// Saves or loads its past.
    pub(crate) fn archive(&mut self, archive: &mut Archive<'_>) {
        match &mut self.0 {
            EstimatorKind::FiniteDifference(estimator) => estimator.archive(archive),
            EstimatorKind::LowPass(estimator) => estimator.archive(archive),
            EstimatorKind::AlphaBetaGamma(estimator) => estimator.archive(archive),
            EstimatorKind::Foaw(estimator) => estimator.archive(archive),
        }
    }

    /// Forgets the past: the next sample is at rest.
    pub fn reset(&mut self) {
        match &mut self.0 {
            EstimatorKind::FiniteDifference(estimator) => estimator.reset(),
            EstimatorKind::LowPass(estimator) => estimator.reset(),
            EstimatorKind::AlphaBetaGamma(estimator) => estimator.reset(),
            EstimatorKind::Foaw(estimator) => estimator.reset(),
        }
    }

    /// Takes the position (m) measured `elapsed_s` seconds after the one before; returns the
    /// velocity, m/s. No time, no news.
    #[inline]
    pub fn update(&mut self, elapsed_s: f64, position: f64) -> f64 {
        // The usual one first, without a table of jumps.
        if let EstimatorKind::AlphaBetaGamma(estimator) = &mut self.0 {
            return estimator.update(elapsed_s, position);
        }
        self.update_another(elapsed_s, position)
    }

    #[inline(never)]
    fn update_another(&mut self, elapsed_s: f64, position: f64) -> f64 {
        match &mut self.0 {
            EstimatorKind::FiniteDifference(estimator) => estimator.update(elapsed_s, position),
            EstimatorKind::LowPass(estimator) => estimator.update(elapsed_s, position),
            EstimatorKind::AlphaBetaGamma(estimator) => estimator.update(elapsed_s, position),
            EstimatorKind::Foaw(estimator) => estimator.update(elapsed_s, position),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use proptest::prelude::*;

    const COUNT_M: f64 = 1e-5;

    /// Root mean square error, mm/s, of 30 mm at a frequency, counted to 10 um at 1 kHz.
    fn rms_error(method: Method, frequency_hz: f64) -> f64 {
        let mut estimator = Estimator::new(method, 1e-3, COUNT_M);
        let omega = TAU * frequency_hz;
        let (mut sum, mut count) = (0.0, 0.0);
        for k in 0..20_000 {
            let t = f64::from(k) * 1e-3;
            let counted = (0.03 * (omega * t).sin() / COUNT_M).round() * COUNT_M;
            let error = estimator.update(1e-3, counted) - 0.03 * omega * (omega * t).cos();
            if k > 1000 {
                sum += error * error;
                count += 1.0;
            }
        }
        (sum / count).sqrt() * 1e3
    }

    #[test]
    fn errors_on_a_coarse_encoder_are_those_of_the_comparison() {
        // Total rms error, mm/s, at 0.5, 2 and 3 Hz; measured beforehand with a prototype, so to a
        // quarter.
        for (method, known) in [
            (Method::FiniteDifference, [4.1, 4.3, 5.6]),
            (Method::LowPass, [1.6, 5.7, 12.5]),
            (Method::AlphaBetaGamma, [1.24, 1.26, 1.77]),
            (Method::FoawEndFit, [1.3, 6.3, 9.2]),
        ] {
            for (frequency, known) in [0.5, 2.0, 3.0].into_iter().zip(known) {
                let error = rms_error(method, frequency);
                std::println!("{method:18} {frequency:3} Hz: {error:.2} mm/s");
                assert!(
                    (error / known - 1.0).abs() < 0.25,
                    "{method} at {frequency} Hz: {error:.2} for {known} mm/s"
                );
            }
        }
        let (best, end) = (rms_error(Method::FoawBestFit, 0.5), rms_error(Method::FoawEndFit, 0.5));
        assert!(best < 1.2 * end, "best fit {best:.2}, end fit {end:.2} mm/s");
    }

    #[test]
    fn every_name_is_read_back() {
        for method in METHODS {
            assert_eq!(method.to_string().parse(), Ok(method));
        }
        let error = "kalman".parse::<Method>().expect_err("no such estimator").to_string();
        assert!(error.contains("kalman") && error.contains("foaw-end-fit"), "{error}");
        let error = "lowpass".parse::<Method>().expect_err("no such estimator").to_string();
        assert!(error.contains("did you mean `low-pass`?"), "{error}");
    }

    proptest! {
        #[test]
        fn a_steady_motion_is_found_whatever_the_clock_does(
            method in prop::sample::select(METHODS.to_vec()),
            speed in -1.0..1.0f64,
            periods in prop::collection::vec(0.7..1.3f64, 400),
        ) {
            // A perfect encoder, jitter of 30 %.
            let mut estimator = Estimator::new(method, 1e-3, 1e-9);
            let (mut t, mut estimate) = (0.0, 0.0);
            for period in periods {
                t += 1e-3 * period;
                estimate = estimator.update(1e-3 * period, speed * t);
            }
            prop_assert!((estimate - speed).abs() < 1e-6, "{method}: {estimate} for {speed}");
            estimator.reset();
            prop_assert_eq!(estimator.update(1e-3, 5.0), 0.0, "the first sample after a reset is at rest");
        }

        #[test]
        fn nothing_but_numbers_comes_out(
            method in prop::sample::select(METHODS.to_vec()),
            samples in prop::collection::vec((prop_oneof![Just(0.0), 1e-9..1.0f64], -10.0..10.0f64), 1..200),
        ) {
            let mut estimator = Estimator::new(method, 1e-3, COUNT_M);
            for (elapsed, position) in samples {
                prop_assert!(estimator.update(elapsed, position).is_finite());
            }
        }
    }
}
