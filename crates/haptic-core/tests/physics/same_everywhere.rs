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

/// One checksum for each law, over all its ways in both settings and by every scheme.
fn checksums() -> Vec<(String, u64)> {
    let mut all: Vec<(String, u64)> = Vec::new();
    for (name, scene) in scenes() {
        for scheme in [Scheme::Exact, Scheme::Implicit, Scheme::LITERAL] {
            let law = name.split(',').next().expect("a law");
            let sum = run(&scene, scheme);
            match all.iter_mut().find(|(known, _)| known == law) {
                Some((_, total)) => *total = (*total ^ sum).wrapping_mul(0x0100_0000_01b3),
                None => all.push((law.to_owned(), sum)),
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
    ("karnopp", 0x0c8b_afdf_6fc1_9830),
    ("dahl", 0x5768_1a80_e11d_65cb),
    ("hayward-armstrong", 0x58bb_a1b3_3dd1_1474),
    ("reset-integrator", 0x6a10_f79c_aa4e_4b61),
    ("lugre", 0xbb00_a354_ffc0_fd50),
    ("elasto-plastic", 0xd716_4864_f42e_cc50),
    ("salcudean-vlaar", 0x1128_28ed_d959_69e1),
    ("viscous", 0x68bd_2e2c_1e57_0336),
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
