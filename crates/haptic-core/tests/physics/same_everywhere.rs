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
    ("karnopp, exact", 0x125d_ae97_9409_db68),
    ("karnopp, implicit", 0x7c95_c86b_fc3f_9d28),
    ("karnopp, literal", 0x513c_bbab_05db_e813),
    ("dahl, exact", 0xa932_76e8_70cd_4921),
    ("dahl, implicit", 0x3a4f_9853_b66b_2576),
    ("dahl, literal", 0x5f87_639c_09dd_1b13),
    ("hayward-armstrong, exact", 0x0dcc_c03f_a47e_1684),
    ("hayward-armstrong, implicit", 0x7eee_471b_ed68_7c0e),
    ("hayward-armstrong, literal", 0xdf09_a87f_5ce3_8ff9),
    ("reset-integrator, exact", 0x991f_535d_ad3f_8873),
    ("reset-integrator, implicit", 0x3b30_e0bb_82bb_de53),
    ("reset-integrator, literal", 0xfbe7_faa4_bf17_c52e),
    ("lugre, exact", 0x8794_2d5b_d4ff_21fa),
    ("lugre, implicit", 0x70e0_08ab_29a0_1907),
    ("lugre, literal", 0x269a_df27_6523_6b70),
    ("elasto-plastic, exact", 0xa3c7_e41e_0f33_1132),
    ("elasto-plastic, implicit", 0xf269_a0e9_de4b_90ec),
    ("elasto-plastic, literal", 0xd468_3580_aa75_e098),
    ("salcudean-vlaar, exact", 0xba20_a19d_900e_f62c),
    ("salcudean-vlaar, implicit", 0x89ec_5dfc_2a36_d0b4),
    ("salcudean-vlaar, literal", 0xaa32_2a8b_89f2_ae83),
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
