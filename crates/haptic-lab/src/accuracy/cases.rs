//! The scenes and hands that schemes are held against: the stored references' parameters, and the
//! hard cases.

use super::hands::Random;
use super::limits::laws;
use crate::motion::DeviceSample;
use crate::simulate::Start;
use haptic_core::friction::{Friction, Karnopp};
use haptic_core::{ParameterKey, Scene};

/// A scene with the hand that moves it.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name, for people and tables.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// The device's motion.
    pub motion: Vec<DeviceSample>,
    /// Where the block begins.
    pub start: Start,
}

impl Case {
    /// Stiffness of the coupling, N/m.
    #[must_use]
    pub fn stiffness(&self) -> f64 {
        self.scene.coupling.map_or(0.0, |coupling| coupling.stiffness)
    }
}

/// A hand that oscillates, with jitter, missed ticks, jumps and encoder steps where wanted.
/// The same in every run.
#[derive(Clone, Copy, Debug)]
pub struct OscillatingHand {
    /// Half the stroke, m.
    pub amplitude_m: f64,
    /// Turns a second, Hz.
    pub frequency_hz: f64,
    /// Time between samples, s.
    pub period_s: f64,
    /// Jitter of that time, as a share of it.
    pub jitter: f64,
    /// One count of the encoder, m; 0 for a perfect one.
    pub encoder_m: f64,
    /// Samples between jumps of up to 2 mm; 0 for no jumps.
    pub jump_every: usize,
    /// Samples between gaps of eleven missed ticks; 0 for no gaps.
    pub miss_every: usize,
    /// Samples in all.
    pub samples: usize,
}

impl OscillatingHand {
    /// 30 mm at 2 Hz, 1 kHz, 0.7 s: the hand of the paper's reference scene.
    pub const PLAIN: Self = Self {
        amplitude_m: 0.03,
        frequency_hz: 2.0,
        period_s: 1e-3,
        jitter: 0.0,
        encoder_m: 0.0,
        jump_every: 0,
        miss_every: 0,
        samples: 700,
    };

    /// The same with all that a rig does to it.
    const ROUGH: Self = Self {
        encoder_m: 1e-5,
        jitter: 0.3,
        jump_every: 40,
        miss_every: 23,
        ..Self::PLAIN
    };

    /// The motion.
    #[must_use]
    pub fn samples(&self) -> Vec<DeviceSample> {
        let omega = std::f64::consts::TAU * self.frequency_hz;
        let mut random = Random(12_345);
        let (mut t, mut offset) = (0.0, 0.0);
        (0..self.samples)
            .map(|k| {
                let noise = random.between(-1.0, 1.0);
                let every = |count: usize| count > 0 && k > 0 && k.is_multiple_of(count);
                if k > 0 {
                    let periods = if every(self.miss_every) { 12.0 } else { 1.0 };
                    t += self.period_s * (1.0 + self.jitter * noise) * periods;
                }
                if every(self.jump_every) {
                    offset += 0.002 * noise;
                }
                let mut position = offset - self.amplitude_m * (omega * t).cos();
                if self.encoder_m > 0.0 {
                    position = (position / self.encoder_m).round() * self.encoder_m;
                }
                DeviceSample {
                    t_s: t,
                    position_m: position,
                    velocity_mps: self.amplitude_m * omega * (omega * t).sin(),
                }
            })
            .collect()
    }
}

/// The paper's scene with some parameters changed.
///
/// # Panics
/// A name is no parameter's, or the scene is not valid.
#[must_use]
pub fn changed(changes: &[(&str, f64)]) -> Scene {
    let changes: Vec<(ParameterKey, f64)> = changes
        .iter()
        .map(|&(name, value)| (name.parse().expect("the cases name parameters"), value))
        .collect();
    Scene::paper().with(&changes).expect("the cases are valid scenes")
}

/// A device that stands still, and a block that is released.
fn release() -> (Vec<DeviceSample>, Start) {
    let motion = (0..700)
        .map(|k| DeviceSample {
            t_s: f64::from(k) * 1e-3,
            ..DeviceSample::default()
        })
        .collect();
    let start = Start {
        velocity_mps: 0.5,
        ..Start::default()
    };
    (motion, start)
}

/// A device that creeps along at 1 mm/s.
fn creep() -> Vec<DeviceSample> {
    (0..12_000)
        .map(|k| DeviceSample {
            t_s: f64::from(k) * 1e-3,
            position_m: f64::from(k) * 1e-6,
            velocity_mps: 1e-3,
        })
        .collect()
}

/// Every case there is.
#[must_use]
pub fn all() -> Vec<Case> {
    let mut cases = of_karnopp();
    cases.extend(of_laws());
    cases
}

/// Every law but plain Karnopp friction, under the paper's block, under a light one, and under a
/// rough hand.
///
/// # Panics
/// Never: the cases are valid scenes, which the tests run through.
#[must_use]
pub fn of_laws() -> Vec<Case> {
    let [plain, rough] =
        [OscillatingHand::PLAIN, OscillatingHand::ROUGH].map(|hand| OscillatingHand { samples: 300, ..hand });
    let mut cases = vec![Case {
        name: "karnopp, Stribeck, loaded beyond Fs".to_owned(),
        scene: Scene {
            friction: Friction::Karnopp(Karnopp {
                stribeck_velocity: 0.5,
                ..Karnopp::new(4.0, 2.0)
            }),
            ..Scene::paper()
        },
        motion: release().0,
        start: Start {
            position_m: Some(-0.02),
            velocity_mps: 0.0,
        },
    }];
    for (law, friction) in laws() {
        for (what, mass, hand) in [("", 0.5, plain), (", 10 g", 0.01, plain), (", rough hand", 0.5, rough)] {
            let mut scene = changed(&[("M", mass)]);
            scene.friction = friction;
            cases.push(Case {
                name: format!("{law}{what}"),
                scene,
                motion: hand.samples(),
                start: Start::default(),
            });
        }
    }
    cases
}

/// Every case of plain Karnopp friction, which the exact tick solves to the last digit.
///
/// # Panics
/// Never: the cases are valid scenes, which the tests run through.
#[must_use]
pub fn of_karnopp() -> Vec<Case> {
    const PLAIN: OscillatingHand = OscillatingHand::PLAIN;
    const ASYMMETRIC: &[(&str, f64)] = &[
        ("Fs+", 5.0),
        ("Fs-", 3.0),
        ("Fd+", 3.0),
        ("Fd-", 2.5),
        ("b+", 4.0),
        ("b-", 0.5),
    ];
    const NONE: &[(&str, f64)] = &[];
    type Changes = &'static [(&'static str, f64)];
    let hands: [(&'static str, Changes, OscillatingHand); 27] = [
        ("paper", NONE, PLAIN),
        ("high stiction", &[("Fs", 7.0)], PLAIN),
        (
            "viscous friction alone",
            &[("Fs", 0.0), ("Fd", 0.0), ("b", 35.0)],
            PLAIN,
        ),
        ("light block, 10 g", &[("M", 0.01)], PLAIN),
        ("asymmetric limits", ASYMMETRIC, PLAIN),
        ("K = 0", &[("K", 0.0), ("B", 30.0)], PLAIN),
        ("B = 0", &[("B", 0.0)], PLAIN),
        ("Fs = Fd", &[("Fs", 3.5)], PLAIN),
        ("no friction", &[("Fs", 0.0), ("Fd", 0.0)], PLAIN),
        (
            "no friction, no damping",
            &[("Fs", 0.0), ("Fd", 0.0), ("B", 0.0)],
            PLAIN,
        ),
        ("Fs >> Fd", &[("Fs", 40.0), ("Fd", 0.01)], PLAIN),
        ("Fd above Fs", &[("Fs", 2.0), ("Fd", 3.5)], PLAIN),
        ("1 g", &[("M", 1e-3)], PLAIN),
        (
            "1 mg, soft",
            &[("M", 1e-6), ("K", 500.0), ("B", 0.01)],
            OscillatingHand { samples: 260, ..PLAIN },
        ),
        ("100 kg", &[("M", 100.0), ("Fs", 60.0), ("Fd", 50.0)], PLAIN),
        ("3e6 N/m", &[("K", 3e6), ("B", 100.0)], PLAIN),
        ("critical damping", &[("K", 200.0), ("B", 20.0)], PLAIN),
        ("overdamped", &[("K", 2000.0), ("B", 300.0)], PLAIN),
        ("jitter of 30 %", NONE, OscillatingHand { jitter: 0.3, ..PLAIN }),
        (
            "missed ticks",
            NONE,
            OscillatingHand {
                miss_every: 17,
                ..PLAIN
            },
        ),
        (
            "jumps",
            NONE,
            OscillatingHand {
                jump_every: 40,
                ..PLAIN
            },
        ),
        (
            "encoder of 10 um",
            NONE,
            OscillatingHand {
                encoder_m: 1e-5,
                ..PLAIN
            },
        ),
        ("all of these, asymmetric", ASYMMETRIC, OscillatingHand::ROUGH),
        ("DV of 50 mm/s", &[("DV", 0.05)], PLAIN),
        (
            "light and undamped",
            &[("M", 1e-4), ("B", 0.0)],
            OscillatingHand { samples: 400, ..PLAIN },
        ),
        (
            "20 kHz",
            NONE,
            OscillatingHand {
                period_s: 5e-5,
                samples: 4000,
                frequency_hz: 20.0,
                ..PLAIN
            },
        ),
        (
            "100 Hz",
            NONE,
            OscillatingHand {
                period_s: 1e-2,
                samples: 200,
                ..PLAIN
            },
        ),
    ];
    let mut cases: Vec<Case> = hands
        .into_iter()
        .map(|(name, changes, hand)| Case {
            name: name.to_owned(),
            scene: changed(changes),
            motion: hand.samples(),
            start: Start::default(),
        })
        .collect();
    let (motion, start) = release();
    cases.push(Case {
        name: "free motion".to_owned(),
        scene: changed(&[("Fs", 4.0), ("Fd", 4.0)]),
        motion,
        start,
    });
    cases.push(Case {
        name: "slow ramp".to_owned(),
        scene: changed(&[("K", 500.0), ("B", 2.0)]),
        motion: creep(),
        start: Start::default(),
    });
    cases
}
