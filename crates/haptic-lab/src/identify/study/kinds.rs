//! Records of the kinds that people make, of a mass and friction drawn by chance, to judge intervals by.
//!
//! The mass is moved here and not by `haptic_core`, so that what judges the identification shares nothing with what it
//! is used with: steps of 50 us in which it sets off, slides and stops at its own instant. It obeys
//!
//! ```text
//! M a + s Fd + b v + spring x + cogging sin(2 pi x / 5 mm) + offset = F       |F - ...| <= Fs at rest
//! ```
//!
//! and is pulled by a hand through a stiff grip, by a relay that turns at the ends of its travel, or by pulses.

use crate::identify::options::Record;
use crate::identify::sensor::{counted, noise, samples_in};
use crate::smoothing::whole;
use fastrand::Rng;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// A step of the motion, s.
const STEP_S: f64 = 5e-5;
/// Period of the cogging, m.
const COGGING_M: f64 = 5e-3;
/// For how long slow noise remembers itself, s.
const SLOW_S: f64 = 1.0;
/// The first and the last moment are not recorded, s.
const MARGIN_S: f64 = 0.05;

/// What moves the mass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A hand along a sine of 0.5 to 3 Hz.
    Sine,
    /// A hand along the sum of two sines.
    TwoSines,
    /// A hand along a sine that grows from 0.5 to 3 Hz.
    Chirp,
    /// A hand along a sine that grows in its stroke.
    Growing,
    /// A force that changes its sign where the mass has reached the end of its travel.
    Relay,
    /// Pulses of a force, by turns in both directions, with rests between them.
    Pulses,
}

impl Kind {
    /// All of them, with their names for tables.
    pub const ALL: [(Self, &'static str); 6] = [
        (Self::Sine, "sine"),
        (Self::TwoSines, "two sines"),
        (Self::Chirp, "chirp"),
        (Self::Growing, "growing sine"),
        (Self::Relay, "relay"),
        (Self::Pulses, "pulses"),
    ];

    /// Whether a hand moves the mass, and not a force.
    #[must_use]
    pub const fn is_by_hand(self) -> bool {
        !matches!(self, Self::Relay | Self::Pulses)
    }
}

/// How a record is made, and what is there beside friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Name, for tables.
    pub name: &'static str,
    /// Samples a second, Hz.
    pub rate_hz: f64,
    /// Root mean square of the force's white noise, N.
    pub noise_n: f64,
    /// Root mean square of the force's slow noise, N.
    pub slow_noise_n: f64,
    /// Step of the encoder, m.
    pub resolution_m: f64,
    /// How much later the force's recorder stamps the same instant, s; two recorders where it is not zero.
    pub shift_s: f64,
    /// Stiffness of a spring along the travel, N/m.
    pub spring_n_per_m: f64,
    /// Amplitude of cogging, N.
    pub cogging_n: f64,
    /// Backlash between the encoder, on the side of the drive, and the mass, m.
    pub backlash_m: f64,
    /// Duration, s.
    pub duration_s: f64,
}

impl Conditions {
    /// 1 kHz, 0.1 N of noise, an encoder of 10 um, and friction alone.
    pub const FAIR: Self = Self {
        name: "fair",
        rate_hz: 1000.0,
        noise_n: 0.1,
        slow_noise_n: 0.0,
        resolution_m: 1e-5,
        shift_s: 0.0,
        spring_n_per_m: 0.0,
        cogging_n: 0.0,
        backlash_m: 0.0,
        duration_s: 20.0,
    };

    /// All that are judged.
    pub const ALL: [Self; 13] = [
        Self::FAIR,
        Self {
            name: "noise of 1 N",
            noise_n: 1.0,
            ..Self::FAIR
        },
        Self {
            name: "slow noise of 0.3 N",
            slow_noise_n: 0.3,
            ..Self::FAIR
        },
        Self {
            name: "encoder of 100 um",
            resolution_m: 1e-4,
            ..Self::FAIR
        },
        Self {
            name: "20 kHz",
            rate_hz: 20_000.0,
            ..Self::FAIR
        },
        Self {
            name: "250 Hz",
            rate_hz: 250.0,
            ..Self::FAIR
        },
        Self {
            name: "35 Hz",
            rate_hz: 35.0,
            ..Self::FAIR
        },
        Self {
            name: "6 s",
            duration_s: 6.0,
            ..Self::FAIR
        },
        Self {
            name: "spring of 20 N/m",
            spring_n_per_m: 20.0,
            ..Self::FAIR
        },
        Self {
            name: "cogging of 0.5 N",
            cogging_n: 0.5,
            ..Self::FAIR
        },
        Self {
            name: "backlash of 0.2 mm",
            backlash_m: 2e-4,
            ..Self::FAIR
        },
        Self {
            name: "two recorders, 4 ms",
            shift_s: 4e-3,
            ..Self::FAIR
        },
        Self {
            name: "two recorders, 250 Hz",
            shift_s: 4e-3,
            rate_hz: 250.0,
            ..Self::FAIR
        },
    ];
}

/// The values behind a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Values {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Dynamic friction, N.
    pub dynamic_force_n: f64,
    /// Viscous friction, N s/m.
    pub viscous_ns_per_m: f64,
    /// Constant force, N.
    pub offset_n: f64,
    /// Static friction, N.
    static_force_n: f64,
}

impl Values {
    fn draw(random: &mut Rng) -> Self {
        let dynamic_force_n = log_uniform(random, 0.3..=5.0);
        Self {
            mass_kg: log_uniform(random, 0.05..=5.0),
            dynamic_force_n,
            viscous_ns_per_m: 10.0 * random.f64(),
            offset_n: random.f64() - 0.5,
            static_force_n: dynamic_force_n * (1.0 + 0.3 * random.f64()),
        }
    }
}

fn log_uniform(random: &mut Rng, range: RangeInclusive<f64>) -> f64 {
    range.start() * (range.end() / range.start()).powf(random.f64())
}

/// The mass in motion.
struct Slider {
    values: Values,
    conditions: Conditions,
    x_m: f64,
    v_mps: f64,
    /// Direction of the slide, 0 at rest.
    sense: f64,
}

impl Slider {
    /// A step under a force.
    fn step(&mut self, force_n: f64) {
        let Values {
            mass_kg,
            dynamic_force_n,
            viscous_ns_per_m,
            offset_n,
            static_force_n,
        } = self.values;
        let place_n =
            self.conditions.spring_n_per_m * self.x_m + self.conditions.cogging_n * (TAU * self.x_m / COGGING_M).sin();
        let net = force_n - offset_n - place_n;
        let sets_off = |slider: &mut Self| {
            slider.sense = if net.abs() <= static_force_n { 0.0 } else { net.signum() };
            slider.sense != 0.0
        };
        if self.sense == 0.0 && !sets_off(self) {
            return;
        }
        let v = self.v_mps;
        let a = (net - self.sense * dynamic_force_n - viscous_ns_per_m * v) / mass_kg;
        let after = v + STEP_S * a * (1.0 - 0.5 * STEP_S * viscous_ns_per_m / mass_kg);
        let stops = after * self.sense <= 0.0 && v * self.sense >= 0.0 && a * self.sense < 0.0;
        if !stops {
            self.x_m += 0.5 * STEP_S * (v + after);
            self.v_mps = after;
            return;
        }
        let until_s = -v / a;
        self.x_m += 0.5 * v * until_s;
        self.v_mps = 0.0;
        if sets_off(self) {
            let a = (net - self.sense * dynamic_force_n) / mass_kg;
            let rest_s = STEP_S - until_s;
            self.v_mps = a * rest_s;
            self.x_m += 0.5 * a * rest_s * rest_s;
        }
    }
}

/// What pulls.
enum Drive {
    /// A hand at a place after a time, with a grip's stiffness and damping.
    Hand {
        place_m: Box<dyn Fn(f64) -> f64>,
        stiffness: f64,
        damping: f64,
    },
    /// The force about the offset, and how far it goes to either side, m.
    Relay {
        force_n: f64,
        usual_m: f64,
        ends_m: [f64; 2],
    },
    Pulses {
        force_n: f64,
        pulse_s: f64,
        rest_s: f64,
    },
}

impl Drive {
    fn draw(kind: Kind, values: &Values, duration_s: f64, random: &mut Rng) -> Self {
        let Values {
            mass_kg,
            dynamic_force_n,
            viscous_ns_per_m,
            ..
        } = *values;
        let hz = 0.5 + 2.5 * random.f64();
        let half_m = if random.bool() { 0.01 } else { 0.02 };
        let place_m: Box<dyn Fn(f64) -> f64> = match kind {
            Kind::Sine => Box::new(move |t| half_m * (TAU * hz * t).sin()),
            Kind::TwoSines => {
                Box::new(move |t| half_m * (0.6 * (TAU * 0.5 * hz * t).sin() + 0.5 * (TAU * 1.37 * hz * t + 1.0).sin()))
            }
            Kind::Chirp => Box::new(move |t| half_m * (TAU * (0.5 * t + 1.25 * t * t / duration_s)).sin()),
            Kind::Growing => Box::new(move |t| half_m * (0.1 + 0.9 * t / duration_s) * (TAU * hz * t).sin()),
            Kind::Relay => {
                return Self::Relay {
                    force_n: dynamic_force_n * (1.6 + 0.9 * random.f64()) + 0.15 * viscous_ns_per_m,
                    usual_m: half_m / 2.0,
                    ends_m: [half_m / 2.0; 2],
                };
            }
            Kind::Pulses => {
                let pulse_s = (2.0 * half_m * mass_kg / (3.0 * dynamic_force_n)).sqrt();
                return Self::Pulses {
                    force_n: 3.0 * dynamic_force_n + 0.15 * viscous_ns_per_m,
                    pulse_s,
                    rest_s: 3.0 * pulse_s + 0.15,
                };
            }
        };
        let stiffness = (mass_kg * (TAU * 12.0).powi(2)).max(5000.0);
        Self::Hand {
            place_m,
            stiffness,
            damping: (1.4 * (stiffness * mass_kg).sqrt()).min(0.3 * mass_kg / STEP_S),
        }
    }

    /// The force after a time, N, and the place that an encoder on the drive's side shows, m.
    fn pull(&mut self, t_s: f64, mass: &Slider, random: &mut Rng) -> (f64, f64) {
        let (x, offset_n) = (mass.x_m, mass.values.offset_n);
        match self {
            Self::Hand {
                place_m,
                stiffness,
                damping,
            } => {
                let hand = place_m(t_s);
                let speed = (place_m(t_s + STEP_S) - place_m(t_s - STEP_S)) / (2.0 * STEP_S);
                let half = mass.conditions.backlash_m / 2.0;
                let apart = hand - x;
                let stretch = apart - apart.clamp(-half, half);
                if half > 0.0 && stretch == 0.0 {
                    return (0.0, hand);
                }
                let force = *stiffness * stretch + *damping * (speed - mass.v_mps);
                // A side of the gap pushes and does not pull.
                let force = if half > 0.0 && force * apart < 0.0 { 0.0 } else { force };
                (force, x + (apart - stretch))
            }
            Self::Relay {
                force_n,
                usual_m,
                ends_m,
            } => {
                let side = usize::from(*force_n < 0.0);
                if x * force_n.signum() > ends_m[side] {
                    *force_n = -*force_n;
                    ends_m[side] = *usual_m * (1.0 + 0.2 * random.f64());
                }
                (*force_n + offset_n, x)
            }
            Self::Pulses {
                force_n,
                pulse_s,
                rest_s,
            } => {
                let turns = t_s / (*pulse_s + *rest_s);
                let is_pulse = turns.fract() * (*pulse_s + *rest_s) < *pulse_s;
                let sign = if turns.rem_euclid(2.0) < 1.0 { 1.0 } else { -1.0 };
                (offset_n + if is_pulse { sign * *force_n } else { 0.0 }, x)
            }
        }
    }
}

/// A record, and the values behind it.
#[must_use]
pub fn record(kind: Kind, conditions: &Conditions, seed: u64) -> (Record, Values) {
    let random = &mut Rng::with_seed(seed.wrapping_mul(6).wrapping_add(kind as u64));
    let values = Values::draw(random);
    let mut drive = Drive::draw(kind, &values, conditions.duration_s, random);
    let mut slider = Slider {
        values,
        conditions: *conditions,
        x_m: 0.0,
        v_mps: 0.0,
        sense: 0.0,
    };
    let steps = samples_in(conditions.duration_s, STEP_S);
    let (mut forces, mut places) = (Vec::with_capacity(steps), Vec::with_capacity(steps));
    for step in 0..steps {
        let (force_n, place_m) = drive.pull(step as f64 * STEP_S, &slider, random);
        forces.push(force_n);
        places.push(place_m);
        slider.step(force_n);
    }
    let period_s = 1.0 / conditions.rate_hz;
    let first_s = MARGIN_S + period_s * random.f64();
    let samples = samples_in(conditions.duration_s - 2.0 * MARGIN_S, period_s).saturating_sub(1);
    let t_s: Vec<f64> = (0..samples).map(|sample| sample as f64 * period_s).collect();
    // Between two steps on a straight line; a step's force is that of its middle.
    let at = |values: &[f64], t_s: f64| {
        let place = (t_s / STEP_S).clamp(0.0, (steps - 2) as f64);
        let left = whole(place);
        values[left] + (place - left as f64) * (values[left + 1] - values[left])
    };
    let position_m: Vec<f64> = t_s.iter().map(|t_s| at(&places, first_s + t_s)).collect();
    let white = noise(random, conditions.noise_n, 0.0, samples);
    let slow = noise(random, conditions.slow_noise_n, (-period_s / SLOW_S).exp(), samples);
    let force_n = t_s
        .iter()
        .zip(white.iter().zip(&slow))
        .map(|(t_s, (white, slow))| at(&forces, first_s + t_s - conditions.shift_s - 0.5 * STEP_S) + white + slow)
        .collect();
    let record = Record {
        position_m: counted(random, &position_m, conditions.resolution_m),
        force_n,
        t_s,
        velocity_mps: None,
        resolution_m: Some(conditions.resolution_m),
    };
    (record, values)
}
