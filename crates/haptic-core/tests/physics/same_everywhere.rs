//! The same inputs give the same forces to the last bit, on every machine and in every build: each
//! law's run is pinned by a checksum.
//!
//! A change of the physics changes a checksum; the failing test prints the new table. A difference
//! between two machines, or between debug and release, is a fault: something uses the platform's
//! elementary functions or fuses a multiplication with an addition.

use crate::explore::{Hand, scenes};
use haptic_core::block::Contact;
use haptic_core::velocity::{Estimator, METHODS};
use haptic_core::{Renderer, Scene, Scheme};

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
    ("karnopp, exact", 0xa02e_14e2_a181_4a96),
    ("karnopp, implicit", 0xf475_9a00_7b6d_def9),
    ("karnopp, literal", 0xda4f_a943_ad68_2fc3),
    ("dahl, exact", 0xc698_d334_6cbd_e647),
    ("dahl, implicit", 0x5cc9_778a_8172_9b7b),
    ("dahl, literal", 0x7e45_264c_921f_4b81),
    ("hayward-armstrong, exact", 0x2f4a_6591_5ced_6ba7),
    ("hayward-armstrong, implicit", 0x22f8_8702_051c_896f),
    ("hayward-armstrong, literal", 0x6601_0408_9fff_f7c6),
    ("reset-integrator, exact", 0x60a9_c0e6_aeb1_fad2),
    ("reset-integrator, implicit", 0xb785_bbd2_269b_2b45),
    ("reset-integrator, literal", 0x2128_a9f2_9d1d_6db4),
    ("lugre, exact", 0x29c8_e3e4_6436_a146),
    ("lugre, implicit", 0xc30d_b8b4_5797_97fa),
    ("lugre, literal", 0x6f2e_7718_aa9d_e60a),
    ("elasto-plastic, exact", 0xe0f1_2bd5_84a3_a31a),
    ("elasto-plastic, implicit", 0x4911_86db_0b10_c12c),
    ("elasto-plastic, literal", 0x5d67_535e_8d09_1040),
    ("salcudean-vlaar, exact", 0x65e7_b635_5eaf_97d9),
    ("salcudean-vlaar, implicit", 0xbed2_02e0_5d1f_33a8),
    ("salcudean-vlaar, literal", 0x9378_45b5_78ce_b828),
    ("viscous, exact", 0x18d6_029d_fafb_76b1),
    ("viscous, implicit", 0x6982_f03d_8b3a_2e90),
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
