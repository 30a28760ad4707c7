//! The exact tick against true motions: the project's own reference solver, first held against the stored references, then used on the hard cases.

use haptic_core::{ParameterKey, Scene, Scheme};
use haptic_lab::accuracy::reference::solve;
use haptic_lab::motion::{self, DeviceSample};
use haptic_lab::simulate::{Simulation, Start, simulate};
use proptest::prelude::*;
use std::path::Path;

fn scene(changes: &[(&str, f64)]) -> Scene {
    let changes: Vec<(ParameterKey, f64)> = changes
        .iter()
        .map(|&(name, value)| (name.parse().expect("a parameter"), value))
        .collect();
    Scene::paper().with(&changes).expect("a valid scene")
}

fn stored(name: &str) -> (Vec<DeviceSample>, Vec<[f64; 3]>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../haptic-core/tests/data/reference")
        .join(format!("{name}.csv"));
    let truth = std::fs::read_to_string(&path)
        .expect("the fixture")
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
            [cells[3], cells[5], cells[6]]
        })
        .collect();
    (motion::read(&path).expect("a motion"), truth)
}

/// Worst differences of a run from the truth: position m, force relative to max(K |p|, 1 N), event time s; and whether both have the same list
/// of changes of contact.
#[derive(Debug)]
struct Difference {
    position: f64,
    force: f64,
    event_time: f64,
    same_events: bool,
}

fn difference(scene: &Scene, run: &Simulation, truth: &Simulation) -> Difference {
    let stiffness = scene.coupling.stiffness;
    let rows = || run.rows.iter().zip(&truth.rows);
    let kinds = |simulation: &Simulation| {
        simulation
            .events
            .iter()
            .map(|event| (event.from, event.to))
            .collect::<Vec<_>>()
    };
    Difference {
        position: rows()
            .map(|(row, truth)| (row.block_position_m - truth.block_position_m).abs())
            .fold(0.0, f64::max),
        force: rows()
            .map(|(row, truth)| {
                let scale = (stiffness * row.device.position_m.abs()).max(1.0);
                (row.coupling_force_n - truth.coupling_force_n).abs() / scale
            })
            .fold(0.0, f64::max),
        event_time: run
            .events
            .iter()
            .zip(&truth.events)
            .map(|(event, truth)| (event.t_s - truth.t_s).abs())
            .fold(0.0, f64::max),
        same_events: kinds(run) == kinds(truth),
    }
}

#[test]
fn the_reference_solver_gives_the_stored_references() {
    for (name, changes, start) in [
        ("paper", vec![], 0.0),
        ("high-stiction", vec![("Fs", 7.0)], 0.0),
        ("viscous", vec![("Fs", 0.0), ("Fd", 0.0), ("b", 35.0)], 0.0),
        ("free-motion", vec![("Fs", 4.0), ("Fd", 4.0)], 0.5),
        ("light-block-10g", vec![("M", 0.01)], 0.0),
        ("slow-ramp-stick-slip", vec![("K", 500.0), ("B", 2.0)], 0.0),
    ] {
        let (motion, truth) = stored(name);
        let start = Start {
            velocity_mps: start,
            ..Start::default()
        };
        let run = solve(&scene(&changes), &motion, start);
        for (row, [position, force, contact]) in run.rows.iter().zip(truth) {
            assert!((row.block_position_m - position).abs() <= 2e-17, "{name}: {row:?}");
            assert!((row.coupling_force_n - force).abs() <= 1e-12, "{name}: {row:?}");
            assert_eq!(f64::from(row.contact.as_number()), contact, "{name}: {row:?}");
        }
    }
}

/// A hand that goes to and fro, with jitter, missed ticks, jumps and encoder steps where wanted; the same in every run.
struct HandMotion {
    amplitude: f64,
    frequency: f64,
    period: f64,
    jitter: f64,
    encoder: f64,
    jump_every: usize,
    miss_every: usize,
    samples: usize,
}

const HAND: HandMotion = HandMotion {
    amplitude: 0.03,
    frequency: 2.0,
    period: 1e-3,
    jitter: 0.0,
    encoder: 0.0,
    jump_every: 0,
    miss_every: 0,
    samples: 700,
};

impl HandMotion {
    fn samples(&self) -> Vec<DeviceSample> {
        let omega = std::f64::consts::TAU * self.frequency;
        let mut random = 12345_u64;
        let mut t = 0.0;
        let mut offset = 0.0;
        (0..self.samples)
            .map(|k| {
                random = random
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                let noise = (random >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0;
                if k > 0 {
                    let missed = self.miss_every > 0 && k % self.miss_every == 0;
                    t += self.period * (1.0 + self.jitter * noise) * if missed { 12.0 } else { 1.0 };
                }
                if self.jump_every > 0 && k > 0 && k % self.jump_every == 0 {
                    offset += 0.002 * noise;
                }
                let mut position = offset - self.amplitude * (omega * t).cos();
                if self.encoder > 0.0 {
                    position = (position / self.encoder).round() * self.encoder;
                }
                DeviceSample {
                    t_s: t,
                    position_m: position,
                    velocity_mps: self.amplitude * omega * (omega * t).sin(),
                }
            })
            .collect()
    }
}

#[test]
fn the_exact_tick_is_true_on_the_hard_cases() {
    let asymmetric: &[(&'static str, f64)] = &[
        ("Fs+", 5.0),
        ("Fs-", 3.0),
        ("Fd+", 3.0),
        ("Fd-", 2.5),
        ("b+", 4.0),
        ("b-", 0.5),
    ];
    type Case = (&'static str, Vec<(&'static str, f64)>, HandMotion);
    let cases: Vec<Case> = vec![
        ("asymmetric limits", asymmetric.to_vec(), HAND),
        ("K = 0", vec![("K", 0.0), ("B", 30.0)], HAND),
        ("B = 0", vec![("B", 0.0)], HAND),
        ("Fs = Fd", vec![("Fs", 3.5)], HAND),
        ("no friction", vec![("Fs", 0.0), ("Fd", 0.0)], HAND),
        (
            "no friction, no damping",
            vec![("Fs", 0.0), ("Fd", 0.0), ("B", 0.0)],
            HAND,
        ),
        ("Fs >> Fd", vec![("Fs", 40.0), ("Fd", 0.01)], HAND),
        ("Fd above Fs", vec![("Fs", 2.0), ("Fd", 3.5)], HAND),
        ("1 g", vec![("M", 1e-3)], HAND),
        (
            "1 mg, soft",
            vec![("M", 1e-6), ("K", 500.0), ("B", 0.01)],
            HandMotion { samples: 260, ..HAND },
        ),
        ("100 kg", vec![("M", 100.0), ("Fs", 60.0), ("Fd", 50.0)], HAND),
        ("3e6 N/m", vec![("K", 3e6), ("B", 100.0)], HAND),
        ("critical damping", vec![("K", 200.0), ("B", 20.0)], HAND),
        ("overdamped", vec![("K", 2000.0), ("B", 300.0)], HAND),
        ("jitter of 30 %", vec![], HandMotion { jitter: 0.3, ..HAND }),
        ("missed ticks", vec![], HandMotion { miss_every: 17, ..HAND }),
        ("jumps", vec![], HandMotion { jump_every: 40, ..HAND }),
        ("encoder of 10 um", vec![], HandMotion { encoder: 1e-5, ..HAND }),
        (
            "encoder, jitter, jumps, asymmetric",
            asymmetric.to_vec(),
            HandMotion {
                encoder: 1e-5,
                jitter: 0.3,
                jump_every: 40,
                miss_every: 23,
                ..HAND
            },
        ),
        ("DV of 50 mm/s", vec![("DV", 0.05)], HAND),
        (
            "DV of 20 mm/s, light",
            vec![("DV", 0.02), ("M", 0.02), ("B", 1.0)],
            HAND,
        ),
        (
            "light and undamped",
            vec![("M", 1e-4), ("B", 0.0)],
            HandMotion { samples: 400, ..HAND },
        ),
        (
            "20 kHz",
            vec![],
            HandMotion {
                period: 5e-5,
                samples: 4000,
                frequency: 20.0,
                ..HAND
            },
        ),
        (
            "100 Hz",
            vec![],
            HandMotion {
                period: 1e-2,
                samples: 200,
                ..HAND
            },
        ),
    ];
    let mut failures = Vec::new();
    for (name, changes, hand) in cases {
        let scene = scene(&changes);
        let motion = hand.samples();
        let truth = solve(&scene, &motion, Start::default());
        let run = simulate(&scene, Scheme::Exact, &motion, Start::default()).expect("a valid scene");
        let off = difference(&scene, &run, &truth);
        println!(
            "{name:36} {off:?}, {} events, {} exhausted",
            truth.events.len(),
            run.exhausted_ticks
        );
        let ok = off.same_events && off.position <= 1e-12 && off.force <= 1e-9 && off.event_time <= 1e-12;
        if !ok || run.energy_created_j != 0.0 || run.exhausted_ticks != 0 {
            failures.push(name);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}

/// A number from each decade of a range alike, or exactly zero now and then.
fn decades(low: f64, high: f64, zero: u32) -> impl Strategy<Value = f64> {
    prop_oneof![
        zero => Just(0.0),
        10 => (low..high).prop_map(|exponent: f64| 10_f64.powf(exponent)),
    ]
}

prop_compose! {
    fn any_scene()(
        mass in decades(-3.0, 1.0, 0),
        stiffness in decades(1.0, 6.0, 1),
        damping in decades(-2.0, 2.0, 1),
        plus in decades(-1.0, 1.3, 1),
        minus in decades(-1.0, 1.3, 1),
        share in prop_oneof![Just(1.0), Just(0.0), 0.0..1.0],
        viscous in decades(-1.0, 1.5, 3),
        threshold in prop_oneof![2 => Just(0.0), 1 => 0.0..0.3],
    ) -> Option<Scene> {
        let changes = [
            ("M", mass), ("K", stiffness), ("B", damping), ("Fs+", plus), ("Fs-", minus), ("Fd+", plus * share),
            ("Fd-", minus * share), ("b+", viscous), ("b-", 0.3 * viscous), ("DV", threshold),
        ].map(|(name, value)| (name.parse().expect("a parameter"), value));
        Scene::paper().with(&changes).ok()
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_exact_tick_is_true_on_any_scene(
        scene in any_scene(),
        frequency in 0.5..20.0,
        jitter in prop_oneof![Just(0.0), Just(0.3)],
        encoder in prop_oneof![Just(0.0), Just(1e-5)],
        jump_every in prop_oneof![2 => Just(0_usize), 1 => 5_usize..40],
    ) {
        let Some(scene) = scene else { return Ok(()) };
        let motion = HandMotion { frequency, jitter, encoder, jump_every, amplitude: 0.03 / frequency, samples: 120, ..HAND }.samples();
        let truth = solve(&scene, &motion, Start::default());
        let run = simulate(&scene, Scheme::Exact, &motion, Start::default()).expect("a valid scene");
        let off = difference(&scene, &run, &truth);
        prop_assert!(off.position <= 1e-12 && off.force <= 1e-9, "{scene:?}: {off:?}");
        prop_assert!(off.same_events && off.event_time <= 1e-12, "{scene:?}: {off:?}, {:?} {:?}", run.events, truth.events);
        prop_assert_eq!(run.energy_created_j, 0.0);
        prop_assert_eq!(run.exhausted_ticks, 0);
    }
}
