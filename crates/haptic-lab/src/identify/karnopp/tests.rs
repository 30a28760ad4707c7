//! Identification of records whose truth is known.

use crate::identify::{Directions, Identified, ModelKind, Options, Record, identify};
use crate::motion::DeviceSample;
use crate::simulate::{Simulator, Start};
use haptic_core::{Directional, Scene, Scheme};

/// What is true of a synthetic record.
#[derive(Clone, Copy, Debug)]
struct Truth {
    mass: f64,
    dynamic: Directional,
    viscous: Directional,
    r#static: Directional,
    offset: f64,
}

const TRUTH: Truth = Truth {
    mass: 0.5,
    dynamic: Directional::both(3.5),
    viscous: Directional::both(10.0),
    r#static: Directional::both(5.0),
    offset: 0.0,
};

/// Noise that is the same in every run.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let mixed = (self.0 ^ (self.0 >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        (mixed >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (2.0 * std::f64::consts::PI * v).cos()
    }
}

/// The hand: sines from 0.5 to 3 Hz, then slow ramps to and fro.
fn hand(t: f64, sines_s: f64) -> (f64, f64) {
    let turn = 2.0 * std::f64::consts::PI;
    let sines = |t: f64| {
        [(0.5, 0.02, 0.0), (1.3, 0.012, 1.0), (2.9, 0.005, 2.0)]
            .iter()
            .fold((0.0, 0.0), |(p, v), (f, a, phase)| {
                let angle = turn * f * t + phase;
                (p + a * angle.sin(), v + a * turn * f * angle.cos())
            })
    };
    if t < sines_s {
        return sines(t);
    }
    // 0.8 mm/s for 2 s each way, with a rest at either end.
    let (end, _) = sines(sines_s);
    let phase = (t - sines_s) % 5.0;
    let (p, v) = match phase {
        p if p < 2.0 => (0.8e-3 * p, 0.8e-3),
        p if p < 2.5 => (1.6e-3, 0.0),
        p if p < 4.5 => (1.6e-3 - 0.8e-3 * (p - 2.5), -0.8e-3),
        _ => (0.0, 0.0),
    };
    (end + p, v)
}

/// A block on its coupling, solved exactly, seen by an encoder of 10 um and a sensor with noise of 0.1 N.
fn record(truth: &Truth, seed: u64, period_s: f64) -> Record {
    let scene: Scene = serde_json::from_value(serde_json::json!({
        "name": "truth",
        "block": { "mass": truth.mass },
        "coupling": { "stiffness": 25000, "damping": 10 },
        "friction": {
            "law": "karnopp",
            "static_force": truth.r#static,
            "dynamic_force": truth.dynamic,
            "viscous": truth.viscous,
        },
    }))
    .expect("a scene");
    let mut noise = Noise(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let at = |t: f64| {
        let (position_m, velocity_mps) = hand(t, 12.0);
        DeviceSample {
            t_s: t,
            position_m,
            velocity_mps,
        }
    };
    // The block is solved at 10 kHz at least, and seen at the record's rate.
    let every = (period_s / 1e-4).round().max(1.0) as usize;
    let fine_s = period_s / every as f64;
    let mut simulator =
        Simulator::new(&scene, Scheme::Exact, fine_s, &at(0.0), Start::default()).expect("it can be rendered");
    let mut record = Record::default();
    let count = (27.0 / fine_s) as usize;
    let mut events = Vec::new();
    for index in 0..count {
        let sample = at(index as f64 * fine_s);
        let row = simulator.step(&sample, &mut events);
        if index % every == 0 {
            record.t_s.push(sample.t_s);
            record.position_m.push((row.block_position_m / 1e-5).round() * 1e-5);
            record
                .force_n
                .push(row.coupling_force_n + truth.offset + 0.1 * noise.normal());
        }
    }
    record
}

fn found(record: &Record) -> Identified {
    identify(record, &Options::new(ModelKind::Karnopp)).expect("a record")
}

/// Every parameter that is reported, with its truth and how far it may be from it.
fn pairs(found: &Identified, truth: &Truth) -> Vec<(&'static str, f64, f64, f64)> {
    let mut pairs = Vec::new();
    if let Some(mass) = found.mass_kg {
        pairs.push(("mass_kg", mass, truth.mass, 0.01));
    }
    let mut both = |names: [&'static str; 2], value: Option<Directional>, truth: Directional, within: f64| {
        if let Some(value) = value {
            pairs.push((names[0], value.positive, truth.positive, within));
            pairs.push((names[1], value.negative, truth.negative, within));
        }
    };
    both(
        ["dynamic_force_N.positive", "dynamic_force_N.negative"],
        found.dynamic_force_n,
        truth.dynamic,
        0.005,
    );
    both(
        ["viscous_Ns_per_m.positive", "viscous_Ns_per_m.negative"],
        found.viscous_ns_per_m,
        truth.viscous,
        0.01,
    );
    both(
        ["static_force_N.positive", "static_force_N.negative"],
        found.static_force_n,
        truth.r#static,
        0.05,
    );
    if let Some(offset) = found.offset_n {
        pairs.push(("offset_N", offset, truth.offset, 0.05));
    }
    pairs
}

#[test]
fn the_truth_is_found_and_its_intervals_hold() {
    let seeds = test_run::extent(6, 100);
    let mut held = std::collections::BTreeMap::<&str, u32>::new();
    for seed in 1..=seeds {
        let found = found(&record(&TRUTH, seed as u64, 1e-3));
        assert!(found.refused.is_empty(), "{:?}", found.refused);
        if seed == 1 {
            println!("{found:#?}");
        }
        for (name, value, truth, within) in pairs(&found, &TRUTH) {
            assert!(
                (value - truth).abs() <= within * truth.abs().max(1.0),
                "{seed}: {name} = {value}"
            );
            if let Some([low, high]) = found.intervals.get(name) {
                *held.entry(name).or_default() += u32::from((*low..=*high).contains(&truth));
                println!("{seed} {name} {value:.5} in [{low:.5}, {high:.5}]");
            }
        }
    }
    println!("{held:?} of {seeds}");
    for (name, count) in held {
        assert!(
            count as usize * 10 >= seeds as usize * 9 - 5,
            "{name}: {count} of {seeds}"
        );
    }
}

#[test]
fn friction_that_differs_by_direction_is_found_and_its_offset_refused() {
    let truth = Truth {
        dynamic: Directional {
            positive: 3.5,
            negative: 3.0,
        },
        viscous: Directional {
            positive: 10.0,
            negative: 12.0,
        },
        r#static: Directional {
            positive: 5.0,
            negative: 4.0,
        },
        ..TRUTH
    };
    let found = found(&record(&truth, 1, 1e-3));
    let refused: Vec<&str> = found.refused.iter().map(|each| each.parameter.as_str()).collect();
    assert_eq!(refused, ["offset_N"], "{found:#?}");
    let pairs = pairs(&found, &truth);
    assert_eq!(pairs.len(), 7);
    for (name, value, truth, within) in pairs {
        assert!(
            (value - truth).abs() <= within * truth.abs().max(1.0),
            "{name} = {value}"
        );
    }
}

#[test]
fn a_real_drive_gives_the_figures_of_an_independent_fit() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/emps-pulses.csv");
    let Ok(text) = std::fs::read_to_string(path) else {
        test_run::skip("emps-pulses.csv", "the real machine's record, in ../shared/data");
        return;
    };
    let mut record = Record::default();
    for line in text.lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
        record.t_s.push(cells[0]);
        record.position_m.push(cells[1]);
        record.force_n.push(cells[2]);
    }
    for directions in [Directions::Auto, Directions::Separate] {
        let began = std::time::Instant::now();
        let found = identify(
            &record,
            &Options {
                directions,
                ..Options::new(ModelKind::Karnopp)
            },
        )
        .expect("a record");
        println!("{found:#?} in {:?}", began.elapsed());
        if directions == Directions::Separate {
            continue;
        }
        let near = |value: Option<f64>, truth: f64| {
            let value = value.expect("found");
            assert!((value - truth).abs() <= 0.03 * truth.abs(), "{value} for {truth}");
        };
        near(found.mass_kg, 93.6);
        for side in [|pair: Directional| pair.positive, |pair: Directional| pair.negative] {
            near(found.viscous_ns_per_m.map(side), 211.0);
            near(found.dynamic_force_n.map(side), 20.9);
        }
        near(found.offset_n, -3.2);
        assert!(found.residual_rms_n <= 1.05 * 2.1, "{}", found.residual_rms_n);
    }
}
