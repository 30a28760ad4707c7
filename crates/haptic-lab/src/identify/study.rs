//! Records of known friction, to judge an identification by.
//!
//! A hand drives a mass on a surface of `haptic_core` through a grip, and sensors watch both:
//!
//! ```text
//! hand p(t) --- grip K, B --- F --- mass x(t)       recorded: F + offset + noise, x in steps of the encoder
//!                                   surface
//! ```
//!
//! The mass is moved by the exact scheme, so that the motion has the law's own stops and breakaways.

pub mod cases;
pub mod coverage;
mod judgement;
pub mod kinds;

#[cfg(test)]
pub(super) use judgement::value_in;
pub use judgement::{Judgement, ParameterJudgement};

use super::options::Record;
use super::sensor::{counted, noise, samples_in};
use crate::motion::DeviceSample;
use fastrand::Rng;
use haptic_core::friction::Friction;
use haptic_core::scene::{Block, Coupling};
use haptic_core::{Renderer, Scene, SceneError, Scheme};
use std::f64::consts::TAU;

/// Ticks that the mass is moved by from one sample to the next: the hand goes straight within a tick, and a stiff grip
/// makes a force of what is left of its curve, which seems a mass of `K T^2/12`.
const TICKS_A_SAMPLE: u32 = 8;

/// A part of the hand's motion. It begins where the one before it ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Movement {
    /// To and fro along a sine whose frequency changes steadily.
    Chirp {
        /// Frequency at the beginning, Hz.
        from_hz: f64,
        /// Frequency at the end, Hz.
        to_hz: f64,
        /// Distance between the turns, m.
        stroke_m: f64,
        /// Duration, s.
        duration_s: f64,
    },
    /// To and fro at a constant speed.
    Ramp {
        /// Speed, m/s.
        speed_mps: f64,
        /// Distance between the turns, m.
        stroke_m: f64,
        /// Duration, s.
        duration_s: f64,
    },
    /// At rest.
    Rest {
        /// Duration, s.
        duration_s: f64,
    },
}

impl Movement {
    /// Duration, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match *self {
            Self::Chirp { duration_s, .. } | Self::Ramp { duration_s, .. } | Self::Rest { duration_s } => duration_s,
        }
    }

    /// Displacement (m) and velocity (m/s) after a time, s.
    pub(crate) fn at(&self, t_s: f64) -> (f64, f64) {
        match *self {
            Self::Chirp {
                from_hz,
                to_hz,
                stroke_m,
                duration_s,
            } => {
                let growth = (to_hz - from_hz) / duration_s;
                let phase = TAU * (from_hz + 0.5 * growth * t_s) * t_s;
                let rate = TAU * (from_hz + growth * t_s);
                (
                    0.5 * stroke_m * (1.0 - phase.cos()),
                    0.5 * stroke_m * rate * phase.sin(),
                )
            }
            Self::Ramp {
                speed_mps, stroke_m, ..
            } => {
                let travelled_m = (speed_mps * t_s).rem_euclid(2.0 * stroke_m);
                if travelled_m < stroke_m {
                    (travelled_m, speed_mps)
                } else {
                    (2.0 * stroke_m - travelled_m, -speed_mps)
                }
            }
            Self::Rest { .. } => (0.0, 0.0),
        }
    }
}

/// What the mass is and slides on.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Friction between the mass and the surface.
    pub friction: Friction,
    /// Constant force that the sensor adds, N.
    pub offset_n: f64,
}

/// What watches the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors {
    /// Samples a second, Hz.
    pub rate_hz: f64,
    /// Root mean square of the force sensor's noise, N.
    pub force_noise_n: f64,
    /// For how long that noise remembers itself, s; 0 for white noise.
    pub noise_memory_s: f64,
    /// Step of the encoder, m; 0 counts exactly.
    pub resolution_m: f64,
}

impl Sensors {
    /// 0.1 N of white noise and an encoder of 10 um, at 1 kHz.
    pub const USUAL: Self = Self {
        rate_hz: 1000.0,
        force_noise_n: 0.1,
        noise_memory_s: 0.0,
        resolution_m: 1e-5,
    };
}

/// A mass, the hand that drives it, and what watches them.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// The mass and its friction.
    pub truth: Truth,
    /// What the hand holds it by.
    pub grip: Coupling,
    /// What the hand does.
    pub movements: Vec<Movement>,
    /// What watches it.
    pub sensors: Sensors,
}

impl Experiment {
    /// 30 s of all that an identification asks for: strokes of 30 mm at 0.5 to 3 Hz, ramps of 1 mm/s, and strokes about
    /// as short as presliding.
    #[must_use]
    pub fn thorough(truth: Truth) -> Self {
        Self {
            truth,
            grip: Coupling {
                stiffness: 20_000.0,
                damping: 60.0,
            },
            movements: vec![
                Movement::Rest { duration_s: 0.25 },
                Movement::Chirp {
                    from_hz: 0.5,
                    to_hz: 3.0,
                    stroke_m: 0.03,
                    duration_s: 16.0,
                },
                Movement::Ramp {
                    speed_mps: 0.001,
                    stroke_m: 0.0015,
                    duration_s: 9.0,
                },
                Movement::Chirp {
                    from_hz: 1.0,
                    to_hz: 3.0,
                    stroke_m: 0.001,
                    duration_s: 4.75,
                },
            ],
            sensors: Sensors::USUAL,
        }
    }

    /// The same experiment with other movements.
    #[must_use]
    pub fn with_movements(mut self, movements: &[Movement]) -> Self {
        self.movements = movements.to_vec();
        self
    }

    /// The hand's motion, each movement from where the one before ended.
    pub(crate) fn hand(&self) -> Vec<DeviceSample> {
        let period_s = 1.0 / self.sensors.rate_hz;
        let mut samples = vec![DeviceSample::default()];
        for movement in &self.movements {
            let from_m = samples.last().map_or(0.0, |sample| sample.position_m);
            for index in 1..=samples_in(movement.duration_s(), period_s) {
                let (displacement_m, velocity_mps) = movement.at(index as f64 / self.sensors.rate_hz);
                samples.push(DeviceSample {
                    t_s: samples.len() as f64 / self.sensors.rate_hz,
                    position_m: from_m + displacement_m,
                    velocity_mps,
                });
            }
        }
        samples
    }

    /// The motion as it is, without the sensors' noise and steps.
    ///
    /// # Errors
    /// The truth cannot be rendered.
    pub fn motion(&self) -> Result<Record, SceneError> {
        let scene = Scene {
            name: String::new(),
            block: Some(Block {
                mass: self.truth.mass_kg,
            }),
            coupling: Some(self.grip),
            friction: self.truth.friction,
        };
        let period_s = 1.0 / self.sensors.rate_hz;
        let tick_s = period_s / f64::from(TICKS_A_SAMPLE);
        let mut renderer = Renderer::new(&scene, Scheme::Exact, tick_s)?;
        renderer.start_at(0.0, 0.0);
        let mut record = Record::default();
        let mut from_m = 0.0;
        for movement in &self.movements {
            let samples = samples_in(movement.duration_s(), period_s);
            let mut to_m = from_m;
            for sample in 1..=samples {
                let mut force_n = 0.0;
                for tick in (0..TICKS_A_SAMPLE).rev() {
                    let t_s = sample as f64 * period_s - f64::from(tick) * tick_s;
                    let (displacement, velocity) = movement.at(t_s);
                    to_m = from_m + displacement;
                    force_n = renderer.tick(tick_s, to_m, velocity).coupling_force;
                }
                record.t_s.push(record.t_s.len() as f64 * period_s);
                record.position_m.push(renderer.state().position);
                record.force_n.push(force_n + self.truth.offset_n);
            }
            from_m = to_m;
        }
        Ok(record)
    }

    /// What the sensors make of the motion. Each seed has its own noise, and its own place of the encoder's steps.
    ///
    /// # Errors
    /// The truth cannot be rendered.
    pub fn record(&self, seed: u64) -> Result<Record, SceneError> {
        self.motion().map(|motion| self.sensors.watch(&motion, seed))
    }
}

impl Sensors {
    /// The record of a motion.
    #[must_use]
    pub fn watch(&self, motion: &Record, seed: u64) -> Record {
        let mut random = Rng::with_seed(seed);
        let memory = if self.noise_memory_s > 0.0 {
            (-1.0 / (self.rate_hz * self.noise_memory_s)).exp()
        } else {
            0.0
        };
        let noise = noise(&mut random, self.force_noise_n, memory, motion.t_s.len());
        Record {
            t_s: motion.t_s.clone(),
            position_m: counted(&mut random, &motion.position_m, self.resolution_m),
            velocity_mps: None,
            force_n: motion
                .force_n
                .iter()
                .zip(noise)
                .map(|(force, noise)| force + noise)
                .collect(),
            resolution_m: Some(self.resolution_m).filter(|step| *step > 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::Directional;
    use haptic_core::friction::Karnopp;

    #[test]
    fn a_record_obeys_the_law_that_it_was_made_with() {
        let experiment = Experiment::thorough(Truth {
            mass_kg: 0.5,
            friction: Friction::Karnopp(Karnopp {
                viscous: Directional::both(2.0),
                ..Karnopp::new(4.0, 3.5)
            }),
            offset_n: 0.2,
        });
        let motion = experiment.motion().expect("the scene is sound");
        assert_eq!(motion.t_s.len(), 30_000);
        let x = &motion.position_m;
        let mut slides = 0;
        for k in 1..x.len() - 1 {
            let (acceleration, velocity) = ((x[k + 1] - 2.0 * x[k] + x[k - 1]) / 1e-6, (x[k + 1] - x[k - 1]) / 2e-3);
            if velocity.abs() > 0.05 {
                let force = (motion.force_n[k - 1] + 4.0 * motion.force_n[k] + motion.force_n[k + 1]) / 6.0;
                let friction = 3.5 * velocity.signum() + 2.0 * velocity;
                let left = force - 0.5 * acceleration - friction - 0.2;
                assert!(left.abs() < 0.02, "{left} N at {}", motion.t_s[k]);
                slides += 1;
            }
        }
        assert!(slides > 10_000, "{slides}");
        let record = experiment.record(1).expect("the scene is sound");
        assert_ne!(record, experiment.record(2).expect("the scene is sound"));
        assert_eq!(record, experiment.record(1).expect("the scene is sound"));
        let rms = |of: &dyn Fn(usize) -> f64| {
            ((0..record.t_s.len()).map(|k| of(k).powi(2)).sum::<f64>() / record.t_s.len() as f64).sqrt()
        };
        assert!((rms(&|k| record.force_n[k] - motion.force_n[k]) - 0.1).abs() < 2e-3);
        // A chirp never moves faster than pi times its stroke and frequency.
        let fastest = (1..x.len()).map(|k| (x[k] - x[k - 1]).abs() / 1e-3).fold(0.0, f64::max);
        assert!(fastest < 1.3 * std::f64::consts::PI * 0.03 * 3.0, "{fastest}");
    }
}
