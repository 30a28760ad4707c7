//! The hands that every law is held against, the blocks behind which it is, and ticks drawn at
//! random.

use super::cases::OscillatingHand;
use super::limits::laws;
use crate::motion::DeviceSample;
use crate::simulate::Start;
use haptic_core::friction::{Dahl, ElastoPlastic, Friction, HaywardArmstrong, Karnopp, Lugre};
use haptic_core::scene::{Block, Coupling};
use haptic_core::{Directional, Scene};

/// A hand that goes to and fro over 4 mm at 1 kHz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// Name, for people and tables.
    pub name: &'static str,
    /// Turns a second, Hz.
    pub frequency_hz: f64,
}

/// A slow hand, hands that vibrate as a human hand can and a motor does, and one that turns in
/// nearly every tick.
pub const HANDS: [Hand; 5] = [
    Hand::new("slow, 1 Hz", 1.0),
    Hand::new("15 Hz", 15.0),
    Hand::new("40 Hz", 40.0),
    Hand::new("60 Hz", 60.0),
    Hand::new("437 Hz", 437.0),
];

/// Masses of the block, kg.
pub const MASSES_KG: [f64; 4] = [0.5, 0.05, 0.01, 0.001];

/// Half of the stroke, m.
const AMPLITUDE_M: f64 = 0.002;
/// Time of a tick, s.
const PERIOD_S: f64 = 1e-3;

impl Hand {
    const fn new(name: &'static str, frequency_hz: f64) -> Self {
        Self { name, frequency_hz }
    }

    /// The motion, over a number of samples.
    #[must_use]
    pub fn motion(&self, samples: usize) -> Vec<DeviceSample> {
        self.sampled(PERIOD_S, samples)
    }

    fn sampled(&self, period_s: f64, samples: usize) -> Vec<DeviceSample> {
        OscillatingHand {
            amplitude_m: AMPLITUDE_M,
            frequency_hz: self.frequency_hz,
            period_s,
            samples,
            ..OscillatingHand::PLAIN
        }
        .samples()
    }

    /// The motion with constant acceleration between two samples, so that on the device itself the
    /// path of the hand is known everywhere: the velocities are those of a swing. A hand that turns
    /// in nearly every millisecond is sampled at 10 kHz: two samples would not say where it went.
    #[must_use]
    pub fn motion_on_device(&self, samples: usize) -> Vec<DeviceSample> {
        let turns_in_a_tick = 2.0 * self.frequency_hz * PERIOD_S;
        let period_s = if turns_in_a_tick > 0.5 {
            0.1 * PERIOD_S
        } else {
            PERIOD_S
        };
        let mut motion = self.sampled(period_s, samples);
        for k in 1..motion.len() {
            let (before, here) = (motion[k - 1], motion[k]);
            motion[k].position_m =
                before.position_m + 0.5 * (before.velocity_mps + here.velocity_mps) * (here.t_s - before.t_s);
        }
        motion
    }
}

/// Every law, with the paper's forces.
#[must_use]
pub fn laws_under_hands() -> Vec<(&'static str, Friction)> {
    let mut all = vec![("karnopp", Friction::Karnopp(Karnopp::new(4.0, 3.5)))];
    for (name, law) in laws() {
        all.push((name, law));
        let both = Directional::both(3.5);
        // Without Stribeck's fall a bristle is another curve.
        match law {
            Friction::Lugre(law) => all.push((
                "lugre, Fs = Fd",
                Friction::Lugre(Lugre {
                    static_force: both,
                    stribeck_velocity: 0.0,
                    ..law
                }),
            )),
            Friction::ElastoPlastic(law) => all.push((
                "elasto-plastic, Fs = Fd",
                Friction::ElastoPlastic(ElastoPlastic {
                    static_force: both,
                    stribeck_velocity: 0.0,
                    ..law
                }),
            )),
            _ => {}
        }
    }
    all
}

/// The paper's scene with a law behind a block of a mass.
#[must_use]
pub fn behind_block(friction: Friction, mass: f64) -> Scene {
    Scene {
        block: Some(Block { mass }),
        friction,
        ..Scene::paper()
    }
}

/// A law on the device itself.
#[must_use]
pub fn on_device(friction: Friction) -> Scene {
    Scene {
        block: None,
        coupling: None,
        friction,
        ..Scene::paper()
    }
}

/// One tick of a scene.
#[derive(Clone, Debug)]
pub struct SingleTick {
    /// The scene.
    pub scene: Scene,
    /// Its two samples.
    pub motion: [DeviceSample; 2],
    /// Where the block begins, which moves.
    pub start: Start,
}

/// Numbers for scenes and motions: Knuth's linear congruential generator, the same everywhere.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let share = (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        low + (high - low) * share
    }

    fn decades(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.between(0.0, 1.0))
    }
}

/// Ticks drawn at random: scenes of a law with a block of 1 g to 1 kg, in motion, under a hand in
/// motion. The same in every run.
pub fn single_ticks(law: Friction) -> impl Iterator<Item = SingleTick> {
    let mut random = Random(law.law().len() as u64 * 7919);
    std::iter::from_fn(move || Some(single_tick(&law, &mut random)))
}

fn single_tick(law: &Friction, random: &mut Random) -> SingleTick {
    let (friction, mass) = drawn_friction(law, random);
    let coupling = Coupling {
        stiffness: random.decades(5e3, 5e4),
        damping: random.decades(1.0, 50.0),
    };
    let velocity_mps = random.between(-0.5, 0.5);
    let next_mps = velocity_mps + random.between(-0.2, 0.2);
    let at = |t_s: f64, position_m: f64, velocity_mps: f64| DeviceSample {
        t_s,
        position_m,
        velocity_mps,
    };
    SingleTick {
        scene: Scene {
            block: Some(Block { mass }),
            coupling: Some(coupling),
            friction,
            ..Scene::paper()
        },
        motion: [
            at(0.0, 0.0, velocity_mps),
            at(PERIOD_S, 0.5 * (velocity_mps + next_mps) * PERIOD_S, next_mps),
        ],
        start: Start {
            position_m: Some(random.between(-5e-4, 5e-4)),
            velocity_mps: random.between(-0.5, 0.5),
        },
    }
}

/// The law with parameters drawn at random, and the mass of a block for which the adviser takes them, kg.
fn drawn_friction(law: &Friction, random: &mut Random) -> (Friction, f64) {
    let mut between = |low, high| random.between(low, high);
    let dynamic_force = Directional::both(between(1.0, 5.0));
    let held = Directional::both(dynamic_force.positive * between(1.0, 2.0));
    let (fraction, viscous) = (between(0.5, 0.9), Directional::both(between(0.0, 20.0)));
    let (stribeck, stiffness) = (random.decades(0.003, 0.1), random.decades(1e4, 3e5));
    // Beyond sigma1 T/M of 300 the adviser says no.
    let mass = random.decades(1e-3, 1.0);
    let damping = random.between(0.0, 200.0_f64.min(250.0 * mass / PERIOD_S));
    let static_force = |velocity: f64| if velocity > 0.0 { held } else { dynamic_force };
    let fall = |velocity: f64| velocity.min(1.0) * stribeck / 0.01;
    let friction = match *law {
        Friction::Karnopp(law) => Friction::Karnopp(Karnopp {
            static_force: held,
            dynamic_force,
            viscous,
            stribeck_velocity: if law.stribeck_velocity > 0.0 { stribeck } else { 0.0 },
            ..law
        }),
        Friction::Dahl(law) => Friction::Dahl(Dahl {
            dynamic_force: if law.dynamic_force.is_symmetric() {
                dynamic_force
            } else {
                Directional {
                    negative: 0.5 * dynamic_force.negative,
                    ..dynamic_force
                }
            },
            contact_stiffness: stiffness,
            viscous,
            ..law
        }),
        Friction::HaywardArmstrong(_) => Friction::HaywardArmstrong(HaywardArmstrong {
            dynamic_force,
            contact_stiffness: stiffness,
            elastic_fraction: fraction,
            viscous,
        }),
        Friction::Lugre(law) => Friction::Lugre(Lugre {
            static_force: static_force(law.stribeck_velocity),
            dynamic_force,
            stribeck_velocity: fall(law.stribeck_velocity),
            contact_stiffness: stiffness,
            contact_damping: damping,
            viscous,
        }),
        Friction::ElastoPlastic(law) => Friction::ElastoPlastic(ElastoPlastic {
            static_force: static_force(law.stribeck_velocity),
            dynamic_force,
            stribeck_velocity: fall(law.stribeck_velocity),
            contact_stiffness: stiffness,
            contact_damping: damping,
            elastic_fraction: fraction,
            viscous,
        }),
        law => law,
    };
    (friction, mass)
}
