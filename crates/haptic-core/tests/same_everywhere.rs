//! The same inputs give the same forces to the last bit, on every machine and in every build: each law's run is pinned by a checksum.
//!
//! A change of the physics changes a checksum; the failing test prints the new table. A difference between two machines, or between debug and
//! release, is a fault: something uses the platform's elementary functions or fuses a multiplication with an addition.

use haptic_core::block::Contact;
use haptic_core::friction::LAWS;
use haptic_core::velocity::{Estimator, METHODS};
use haptic_core::{ParameterKey, Renderer, Scene, Scheme};

/// Fowler, Noll and Vo's checksum (FNV-1a, 64 bits).
struct Checksum(u64);

impl Checksum {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, value: f64) {
        // Zero has two forms, and neither is felt.
        for byte in (value + 0.0).to_bits().to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// A hand that explores, at irregular times: time passed (s), position (m) and velocity (m/s). Made of sums and products alone.
struct Hand {
    random: u64,
    wanted: f64,
    position: f64,
    velocity: f64,
}

impl Hand {
    fn new() -> Self {
        Self {
            random: 88_172_645_463_325_252,
            wanted: 0.0,
            position: 0.0,
            velocity: 0.0,
        }
    }

    /// From 0 to 1, by Marsaglia's xorshift.
    fn share(&mut self) -> f64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        f64::from(u32::try_from(self.random >> 32).expect("32 bits")) / f64::from(u32::MAX)
    }

    fn next(&mut self, tick: u32) -> (f64, f64, f64) {
        let elapsed = match tick % 400 {
            399 => 0.004,
            n if n < 200 => 0.001,
            _ => 0.001 * (0.7 + 0.6 * self.share()),
        };
        if tick.is_multiple_of(70) {
            // Slow and fast strokes, and rests.
            let share = self.share() - 0.5;
            self.wanted = if tick.is_multiple_of(5 * 70) {
                0.0
            } else {
                share * share * share * 2.0
            };
        }
        let before = self.velocity;
        self.velocity += 0.05 * (self.wanted - self.velocity);
        self.position += 0.5 * elapsed * (before + self.velocity);
        (elapsed, self.position, self.velocity)
    }
}

/// Parameters with which a law takes its other ways, beside those that it has anyway.
const WAYS: [&[(&str, f64)]; 6] = [
    &[],
    &[
        ("Fs+", 5.0),
        ("Fs-", 3.75),
        ("Fd+", 3.0),
        ("Fd-", 2.5),
        ("b+", 4.0),
        ("b-", 2.0),
    ],
    &[("M", 0.01), ("b", 1.0), ("ws", 0.02)],
    &[("DV", 0.003), ("gamma", 8.0), ("i", 0.5)],
    &[("ws", 0.01), ("gamma", 8.0), ("zba", 0.4), ("i", 0.0)],
    &[("sigma1", 0.0), ("i", 2.0), ("M", 2.0), ("K", 900.0), ("B", 30.0)],
];

fn scenes() -> Vec<(String, Scene)> {
    let mut scenes = Vec::new();
    for law in LAWS {
        for (way, changes) in WAYS.iter().enumerate() {
            for (setting, block) in [("block", true), ("device", false)] {
                let mut scene = Scene::paper();
                if !block {
                    (scene.block, scene.coupling) = (None, None);
                }
                let mut scene = scene.with_law(law).expect("a law").expect("a scene");
                for &(name, value) in *changes {
                    let key: ParameterKey = name.parse().expect("a parameter");
                    // A law without the parameter goes without it.
                    scene = scene.with(&[(key, value)]).unwrap_or(scene);
                }
                scenes.push((format!("{law}, {setting}, {way}"), scene));
            }
        }
    }
    scenes
}

fn run(scene: &Scene, scheme: Scheme) -> u64 {
    let mut surface = Renderer::new(scene, scheme, 1e-3).expect("a valid scene");
    surface.start_at(0.0, 0.0);
    let (mut hand, mut sum) = (Hand::new(), Checksum::new());
    let mut energy = 0.0;
    for tick in 0..3000 {
        let (elapsed, position, velocity) = hand.next(tick);
        let rendered = if tick % 3 == 0 {
            let mut hear = |at: f64, _: Contact, to: Contact| energy += at * f64::from(to.as_number());
            surface.tick_with_events(elapsed, position, velocity, &mut hear)
        } else {
            surface.tick(elapsed, position, velocity)
        };
        sum.add(rendered.coupling_force);
        let state = surface.state();
        for value in [state.position, state.velocity, f64::from(state.contact.as_number())] {
            sum.add(value);
        }
    }
    sum.add(energy);
    sum.0
}

/// One checksum for each law and scheme, over all its ways in both settings.
fn checksums() -> Vec<(String, u64)> {
    let mut all: Vec<(String, u64)> = Vec::new();
    for (name, scene) in scenes() {
        for scheme in [Scheme::Exact, Scheme::Implicit, Scheme::LITERAL] {
            let law = name.split(',').next().expect("a law");
            let name = format!("{law}, {scheme}");
            let sum = run(&scene, scheme);
            match all.iter_mut().find(|(known, _)| *known == name) {
                Some((_, total)) => *total = (*total ^ sum).wrapping_mul(0x0100_0000_01b3),
                None => all.push((name, sum)),
            }
        }
    }
    for method in METHODS {
        let mut estimator = Estimator::new(method, 1e-3, 1e-5);
        let (mut hand, mut sum) = (Hand::new(), Checksum::new());
        for tick in 0..3000 {
            let (elapsed, position, _) = hand.next(tick);
            sum.add(estimator.update(elapsed, (position * 1e5).round() / 1e5));
        }
        all.push((method.to_string(), sum.0));
    }
    all
}

const PINNED: &[(&str, u64)] = &[
    ("karnopp, exact", 0x3367_5d26_5c67_6c66),
    ("karnopp, implicit", 0x0536_c927_dac2_579a),
    ("karnopp, literal", 0x1709_5cb2_2718_3ad5),
    ("dahl, exact", 0x2cdd_605e_d9a7_03e0),
    ("dahl, implicit", 0x2252_5ea7_a23f_3160),
    ("dahl, literal", 0x5084_3642_7b97_f38d),
    ("hayward-armstrong, exact", 0xf142_2253_5490_829e),
    ("hayward-armstrong, implicit", 0x987f_c25f_7b16_aed9),
    ("hayward-armstrong, literal", 0xea9d_59ed_2b49_915a),
    ("reset-integrator, exact", 0x012d_c5df_6865_869b),
    ("reset-integrator, implicit", 0xc520_5048_71ed_834f),
    ("reset-integrator, literal", 0xbd7b_41bf_708c_d292),
    ("lugre, exact", 0x06eb_6686_4ed8_44a4),
    ("lugre, implicit", 0xfac3_9da2_81d2_f516),
    ("lugre, literal", 0x0d73_7cda_984b_2c0f),
    ("elasto-plastic, exact", 0x0445_0aa7_4501_4b25),
    ("elasto-plastic, implicit", 0x193a_462c_3e39_7957),
    ("elasto-plastic, literal", 0x364c_5097_748a_9108),
    ("salcudean-vlaar, exact", 0x7be1_a603_ab78_4d5d),
    ("salcudean-vlaar, implicit", 0x00cb_78ad_6679_1b85),
    ("salcudean-vlaar, literal", 0xfbb4_1b8f_2559_11a2),
    ("viscous, exact", 0xb3d3_b3c5_c9aa_90ae),
    ("viscous, implicit", 0x4adb_a0ae_3dcb_55c0),
    ("viscous, literal", 0x188c_8b56_d2e8_cedb),
    ("finite-difference", 0x438c_1bc7_8285_3801),
    ("low-pass", 0x38b4_b7ad_73a9_91ae),
    ("alpha-beta-gamma", 0x806a_5496_9894_814b),
    ("foaw-end-fit", 0x2c3b_353f_cfa9_3aee),
    ("foaw-best-fit", 0x1f20_68c6_f9b5_8c47),
];

#[test]
fn every_laws_forces_are_pinned_to_the_last_bit() {
    let now = checksums();
    let pinned: Vec<(String, u64)> = PINNED.iter().map(|&(name, sum)| (name.to_owned(), sum)).collect();
    for (name, sum) in &now {
        println!("    ({name:?}, {sum:#018x}),");
    }
    assert_eq!(now, pinned);
}
