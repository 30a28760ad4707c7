//! Which value of a parameter gives a frequency of stick-slip.
//!
//! The frequency need not rise or fall with the value throughout: values over the whole range are
//! tried, and of those between which the frequency lies the nearest to the scene's are narrowed.

use super::{StickSlipError, stick_slip};
use crate::bound_error::BoundError;
use crate::directional::{Direction, Directional};
use crate::math::{exp, ln};
use crate::parameters::{Parameter, ParameterKey};
use crate::scene::Scene;
use crate::series::halve;
use alloc::vec::Vec;

/// Frequencies that are asked for, Hz.
const FREQUENCIES_HZ: [f64; 2] = [1e-6, 1e5];

/// Values that are tried for a frequency, and halvings of the interval around one.
const TRIED: u32 = 60;
const HALVINGS: u32 = 60;
/// Share of a frequency within which a value gives it.
const ROUGHLY: f64 = 1e-6;

/// The stiffness `K`, N/m, that gives a frequency (Hz) at a velocity (m/s); of several the one that
/// is nearest to the scene's.
///
/// # Errors
/// As of [`stick_slip()`], or no stiffness gives that frequency.
pub fn stiffness_for(scene: &Scene, velocity: f64, frequency_hz: f64) -> Result<f64, StickSlipError> {
    Tuning::new(scene, velocity, Parameter::Stiffness).solve(frequency_hz)
}

/// The static force `Fs`, N, that gives it, with `Fd` as it is.
///
/// # Errors
/// As of [`stick_slip()`], or no static force gives that frequency.
pub fn static_force_for(scene: &Scene, velocity: f64, frequency_hz: f64) -> Result<f64, StickSlipError> {
    Tuning::new(scene, velocity, Parameter::StaticForce).solve(frequency_hz)
}

/// A parameter that is to give a frequency.
struct Tuning<'a> {
    scene: &'a Scene,
    velocity: f64,
    parameter: Parameter,
    key: ParameterKey,
    /// What is added to the values that are tried: `Fd` to differences of force.
    above: f64,
    /// The least and the greatest value tried.
    range: [f64; 2],
    /// The scene's own.
    now: f64,
}

impl<'a> Tuning<'a> {
    fn new(scene: &'a Scene, velocity: f64, parameter: Parameter) -> Self {
        let direction = Direction::of(velocity);
        let value = |parameter| scene.value(parameter).unwrap_or_default();
        let own: Directional = value(parameter);
        let above = match parameter {
            Parameter::StaticForce => value(Parameter::DynamicForce).get(direction),
            _ => 0.0,
        };
        let range = match parameter {
            Parameter::StaticForce => [1e-3, 1000.0 - above],
            _ => [1.0, parameter.info().max],
        };
        Self {
            scene,
            velocity,
            parameter,
            key: if own.is_symmetric() {
                parameter.into()
            } else {
                parameter.in_direction(direction)
            },
            above,
            range,
            now: own.get(direction) - above,
        }
    }

    /// The frequency, Hz, by the logarithm of a value.
    fn frequency(&self, ln_value: f64) -> Option<f64> {
        let changed = self.scene.with(&[(self.key, self.above + exp(ln_value))]).ok()?;
        Some(stick_slip(&changed, self.velocity).ok()??.frequency_hz)
    }

    fn solve(&self, frequency_hz: f64) -> Result<f64, StickSlipError> {
        let [slowest, fastest] = FREQUENCIES_HZ;
        BoundError::check("frequency", frequency_hz, slowest, fastest, "Hz")?;
        // What is wrong with the scene is wrong whatever the value.
        stick_slip(self.scene, self.velocity)?;
        let [least, most] = self.range.map(ln);
        let step = (most - least) / f64::from(TRIED);
        let at = |k: u32| least + step * f64::from(k);
        let mut known: Vec<(f64, f64)> = Vec::new();
        let mut before: Option<Option<f64>> = None;
        for k in 0..=TRIED {
            let here = self.frequency(at(k));
            // Stick-slip begins or ends between two values.
            let edge = match (before, here) {
                (Some(None), Some(_)) => Some(self.edge(at(k), at(k - 1))),
                (Some(Some(_)), None) => Some(self.edge(at(k - 1), at(k))),
                _ => None,
            };
            known.extend(edge.flatten());
            known.extend(here.map(|frequency| (at(k), frequency)));
            before = Some(here);
        }
        let now = if self.now > 0.0 { ln(self.now) } else { least };
        let brackets = known.windows(2).filter_map(|pair| match pair {
            [low, high] => Some((*low, *high)).filter(|(low, high)| {
                (low.1 - frequency_hz) * (high.1 - frequency_hz) <= 0.0 && high.0 - low.0 <= 1.001 * step
            }),
            _ => None,
        });
        let away = |bracket: &((f64, f64), (f64, f64))| (0.5 * (bracket.0.0 + bracket.1.0) - now).abs();
        let nearest = brackets.min_by(|a, b| away(a).total_cmp(&away(b)));
        let found = nearest.map(|(low, high)| self.between(low, high, frequency_hz));
        // Between two values that have stick-slip there may be some that have none.
        let gives = |ln_value: &f64| {
            let frequency = self.frequency(*ln_value);
            frequency.is_some_and(|frequency| (frequency / frequency_hz - 1.0).abs() < ROUGHLY)
        };
        found
            .filter(gives)
            .map(|ln_value| self.above + exp(ln_value))
            .ok_or_else(|| {
                let frequencies = || known.iter().map(|(_, frequency)| *frequency);
                let reach = (
                    frequencies().fold(f64::INFINITY, f64::min),
                    frequencies().fold(0.0, f64::max),
                );
                StickSlipError::OutOfReach {
                    parameter: self.parameter,
                    frequency_hz,
                    reach: (!known.is_empty()).then_some(reach),
                }
            })
    }

    /// The value between two others that gives a frequency.
    fn between(&self, low: (f64, f64), high: (f64, f64), frequency_hz: f64) -> f64 {
        let beyond = |found: f64| (found - frequency_hz) * (low.1 - frequency_hz) <= 0.0;
        let (left, right) = halve(low.0, high.0, HALVINGS, |middle| {
            !self.frequency(middle).is_some_and(beyond)
        });
        0.5 * (left + right)
    }

    /// The last value with stick-slip, between one that has it and one that has not, and its
    /// frequency.
    fn edge(&self, with: f64, without: f64) -> Option<(f64, f64)> {
        let (with, _) = halve(with, without, HALVINGS / 2, |middle| self.frequency(middle).is_some());
        Some((with, self.frequency(with)?))
    }
}
