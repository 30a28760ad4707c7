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
    ("karnopp, exact", 0xfe47_a4ff_5bb4_b2b1),
    ("karnopp, implicit", 0x30d9_89c3_fdd2_df98),
    ("karnopp, literal", 0xda4f_a943_ad68_2fc3),
    ("dahl, exact", 0x0fca_e424_2760_eae8),
    ("dahl, implicit", 0xad08_3b17_d904_d33f),
    ("dahl, literal", 0x7e45_264c_921f_4b81),
    ("hayward-armstrong, exact", 0xc233_12a0_1f7d_b42c),
    ("hayward-armstrong, implicit", 0xd149_def3_f519_c033),
    ("hayward-armstrong, literal", 0x6702_8dc4_ff2d_487c),
    ("reset-integrator, exact", 0xd0e1_39f1_6e78_c14d),
    ("reset-integrator, implicit", 0xd3a4_962f_7c9c_1889),
    ("reset-integrator, literal", 0x2128_a9f2_9d1d_6db4),
    ("lugre, exact", 0x7bda_4e44_7d93_e075),
    ("lugre, implicit", 0x2e6a_2250_0bca_6deb),
    ("lugre, literal", 0x6f2e_7718_aa9d_e60a),
    ("elasto-plastic, exact", 0xf39a_90c6_04f2_e7ea),
    ("elasto-plastic, implicit", 0x38ff_a2e7_2f01_c701),
    ("elasto-plastic, literal", 0x5d67_535e_8d09_1040),
    ("salcudean-vlaar, exact", 0x41b8_5470_2c6d_0643),
    ("salcudean-vlaar, implicit", 0xb085_cfa1_61ad_0d99),
    ("salcudean-vlaar, literal", 0x9378_45b5_78ce_b828),
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
