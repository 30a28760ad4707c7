//! The plots of the pages that explain: each is what the project's own code computes, and the same on every machine.
//! `HAPTICD_UPDATE_BOOK=1 cargo test -p system-tests --test system book_figures::` draws them again.

use device_io::Device;
use device_io::fake::{FakeRig, Hand, RigProperties};
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::servo::{Command, CompiledScene, Events, Inputs, Servo, Settings};
use haptic_core::velocity::{self, AlphaBetaGamma};
use haptic_core::{Renderer, Scene, Scheme};
use haptic_lab::drawing::{Chart, Trace, svg};
use haptic_lab::motion::DeviceSample;
use haptic_lab::simulate::{SimulatedRow, Start, simulate};
use std::f64::consts::TAU;
use system_tests::drawn;

/// Period of the loop in all plots, s.
const PERIOD_S: f64 = 1e-3;

/// The paper's block with other values.
fn scene(values: &[(&str, f64)]) -> Scene {
    let values: Vec<_> = values
        .iter()
        .map(|(name, value)| (name.parse().expect("a parameter"), *value))
        .collect();
    Scene::paper().with(&values).expect("values in their ranges")
}

/// A hand that is somewhere at a time, sampled at these times: position m, velocity m/s.
fn sampled(times_s: impl IntoIterator<Item = f64>, hand: impl Fn(f64) -> (f64, f64)) -> Vec<DeviceSample> {
    times_s
        .into_iter()
        .map(|t_s| {
            let (position_m, velocity_mps) = hand(t_s);
            DeviceSample {
                t_s,
                position_m,
                velocity_mps,
            }
        })
        .collect()
}

fn every_period(duration_s: f64) -> impl Iterator<Item = f64> {
    (0..)
        .map(|tick| f64::from(tick) * PERIOD_S)
        .take_while(move |t_s| *t_s <= duration_s)
}

fn rendered(scene: &Scene, scheme: Scheme, motion: &[DeviceSample]) -> Vec<SimulatedRow> {
    simulate(scene, scheme, motion, Start::default())
        .expect("it can be rendered")
        .rows
}

/// A line of points: time in ms, and what `value` makes of a row.
fn over_time(rows: &[SimulatedRow], value: impl Fn(&SimulatedRow) -> f64) -> Vec<[f64; 2]> {
    rows.iter().map(|row| [1e3 * row.device.t_s, value(row)]).collect()
}

fn largest(points: &[[f64; 2]]) -> f64 {
    points.iter().map(|point| point[1].abs()).fold(0.0, f64::max)
}

fn sine(amplitude_m: f64, frequency_hz: f64) -> impl Fn(f64) -> (f64, f64) {
    let omega = TAU * frequency_hz;
    move |t_s| {
        (
            amplitude_m * (omega * t_s).sin(),
            amplitude_m * omega * (omega * t_s).cos(),
        )
    }
}

/// A hand that moves at 20 mm/s and comes to rest between 50 and 100 ms.
fn halting(t_s: f64) -> (f64, f64) {
    const SPEED_MPS: f64 = 0.02;
    const FROM_S: f64 = 0.05;
    const FOR_S: f64 = 0.05;
    let s = ((t_s - FROM_S) / FOR_S).clamp(0.0, 1.0);
    let until_s = t_s.min(FROM_S);
    (SPEED_MPS * (until_s + FOR_S * (s - 0.5 * s * s)), SPEED_MPS * (1.0 - s))
}

#[test]
fn why_the_exact_step() {
    let scene = scene(&[("Fs", 4.0), ("Fd", 4.0)]);
    let motion = sampled(every_period(2.0), halting);
    let [literal, exact] = [Scheme::LITERAL, Scheme::Exact].map(|scheme| rendered(&scene, scheme, &motion));
    // Half of what the velocity changes by from tick to tick, long after the hand has stopped.
    let rattle = |rows: &[SimulatedRow]| {
        let last: Vec<f64> = rows[rows.len() - 100..]
            .iter()
            .map(|row| 1e3 * row.block_velocity_mps)
            .collect();
        last.windows(2)
            .map(|pair| 0.5 * (pair[1] - pair[0]).abs())
            .fold(0.0, f64::max)
    };
    let [literal_mmps, exact_mmps] = [rattle(&literal), rattle(&exact)];
    // The amplitude that the formula of the page gives.
    assert!(
        (literal_mmps - 4.0921).abs() < 1e-3 && exact_mmps == 0.0,
        "{literal_mmps} mm/s, {exact_mmps} mm/s"
    );
    let speed = |rows: &[SimulatedRow]| over_time(&rows[..200], |row| 1e3 * row.block_velocity_mps);
    let force = |rows: &[SimulatedRow]| over_time(&rows[..200], |row| row.coupling_force_n);
    let speeds = Chart::new(
        "A block that its hand brings to rest at 100 ms",
        "Time (ms)",
        "Block velocity (mm/s)",
    )
    .with(Trace::line(
        format!("Euler step: rattles by {literal_mmps:.2} mm/s"),
        speed(&literal),
    ))
    .with(Trace::line(format!("exact step: {exact_mmps} mm/s"), speed(&exact)));
    let forces = Chart::new("What the hand holds", "Time (ms)", "Coupling force (N)")
        .with(Trace::line("Euler step", force(&literal)))
        .with(Trace::line("exact step", force(&exact)));
    drawn::figure("why-exact.svg", &svg(&[speeds, forces]));
}

#[test]
fn why_a_virtual_coupling() {
    const STEP_M: f64 = 10e-6;
    let hand = sine(1e-3, 1.0);
    let mut tracker = AlphaBetaGamma::new(PERIOD_S);
    let mut last_s = 0.0;
    let motion: Vec<DeviceSample> = sampled(every_period(1.0), hand)
        .into_iter()
        .map(|sample| {
            let position_m = STEP_M * (sample.position_m / STEP_M).round();
            let velocity_mps = tracker.update(sample.t_s - last_s, position_m);
            last_s = sample.t_s;
            DeviceSample {
                position_m,
                velocity_mps,
                ..sample
            }
        })
        .collect();
    let behind = rendered(&scene(&[]), Scheme::Exact, &motion);
    let force = |rows: &[SimulatedRow]| over_time(rows, |row| row.coupling_force_n);
    let direct: Vec<[f64; 2]> = motion
        .iter()
        .map(|sample| {
            [
                1e3 * sample.t_s,
                3.5 * sample.velocity_mps.signum() * f64::from(sample.velocity_mps != 0.0),
            ]
        })
        .collect();
    let steps = |points: &[[f64; 2]]| {
        points
            .windows(2)
            .filter(|pair| (pair[1][1] - pair[0][1]).abs() > 3.0)
            .count()
    };
    let (without, with) = (steps(&direct), steps(&force(&behind)));
    assert!(without > 5 && with < 3, "{without}, {with}");
    let chart = Chart::new(
        "A hand that goes 1 mm to and fro, seen by an encoder of 10 um",
        "Time (ms)",
        "Force (N)",
    )
    .with(Trace::line(
        format!("Fd against the measured velocity: {without} steps of more than 3 N"),
        direct.clone(),
    ))
    .with(Trace::line(format!("block behind a coupling: {with}"), force(&behind)));
    drawn::figure("why-coupling.svg", &svg(&[chart]));
}

#[test]
fn what_dv_does() {
    // A soft coupling, a hand that pulls slowly.
    let motion = sampled(every_period(2.5), |t_s| (0.01 * t_s, 0.01));
    let mut chart = Chart::new(
        "A hand that pulls a block of 0.5 kg at 10 mm/s by a spring of 500 N/m",
        "Time (ms)",
        "Coupling force (N)",
    );
    for threshold in [0.0, 0.02, 0.05] {
        let scene = scene(&[("K", 500.0), ("B", 5.0), ("Fs", 4.0), ("Fd", 3.0), ("DV", threshold)]);
        let rows = rendered(&scene, Scheme::Exact, &motion);
        let force = over_time(&rows, |row| row.coupling_force_n);
        let name = format!("DV = {} mm/s", 1e3 * threshold);
        chart = chart.with(Trace::line(name, force));
    }
    drawn::figure("what-dv-does.svg", &svg(&[chart]));
}

/// The handle of the fake rig, pushed with 1 N against a block that holds: position over time, us and ms.
fn pushed(stiffness: f64) -> Vec<[f64; 2]> {
    const MS: u64 = 1_000_000;
    let properties = RigProperties {
        friction_n: 0.0,
        ..RigProperties::default()
    };
    let hand = Hand::Push {
        offset_n: 1.0,
        amplitude_n: 0.0,
        frequency_hz: 1.0,
    };
    let mut rig = FakeRig::new(properties, hand);
    let scene = scene(&[("K", stiffness), ("B", 10.0)]);
    let renderer = Renderer::new(&scene, Scheme::Exact, PERIOD_S).expect("a valid scene");
    let settings = Settings {
        period_s: PERIOD_S,
        ramp_s: 0.001,
        limits: Limits::default(),
        losses: RigLosses {
            damping: 0.0,
            friction: 0.0,
        },
        passivity_control_n: 0.0,
        velocity: velocity::Method::AlphaBetaGamma,
        stale_ns: 20 * MS,
        stop_button: None,
        enable_button: None,
        workspace: None,
        compensation: None,
    };
    let mut servo = Servo::new(settings, Box::new(CompiledScene::at_once(renderer, 1)));
    let mut points = Vec::new();
    for tick in 0..1000_u32 {
        let outputs = servo.step(
            &Inputs {
                elapsed_ns: MS,
                sample: rig.read(u64::from(tick) * MS),
                device_resolution_m: rig.bounds().resolution_m,
                device_force_limit_n: rig.bounds().force_limit_n,
                events: Events::default(),
                command: (tick == 1).then_some(Command::Engage),
            },
            None,
        );
        rig.write(outputs.force_n, outputs.enabled).expect("it is there");
        points.push([f64::from(tick), 1e6 * rig.plant().position_m()]);
    }
    points
}

#[test]
fn what_a_limit_cycle_is() {
    let mut chart = Chart::new(
        "A handle that is pushed with 1 N against a block that holds",
        "Time (ms)",
        "Position (um)",
    );
    for stiffness in [10_000.0, 40_000.0] {
        chart = chart.with(Trace::line(format!("K = {} N/mm", stiffness / 1e3), pushed(stiffness)));
    }
    drawn::figure("limit-cycle.svg", &svg(&[chart]));
}

/// Numbers from 0 to 1, the same in every run.
fn uniform(seed: u64) -> impl Iterator<Item = f64> {
    let mut state = seed;
    std::iter::repeat_with(move || {
        // Knuth's MMIX generator; its upper bits are good enough for a jitter.
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        #[expect(clippy::cast_precision_loss, reason = "53 bits fit")]
        let upper = (state >> 11) as f64;
        upper / (1_u64 << 53) as f64
    })
}

#[test]
fn why_ticks_are_timed() {
    let hand = sine(0.01, 2.0);
    let scene = scene(&[("b", 20.0)]);
    let times: Vec<f64> = every_period(0.5)
        .zip(uniform(1))
        .map(|(t_s, u)| t_s + 0.3 * PERIOD_S * (2.0 * u - 1.0))
        .collect();
    let motion = sampled(times.iter().map(|t_s| t_s.max(0.0)), &hand);
    // What a loop believes that counts its ticks in place of looking at the device's clock.
    let counted: Vec<DeviceSample> = motion
        .iter()
        .zip(every_period(1.0))
        .map(|(sample, t_s)| DeviceSample { t_s, ..*sample })
        .collect();
    // The truth: twenty times as many samples, and these among them.
    let mut dense: Vec<f64> = motion.iter().map(|sample| sample.t_s).collect();
    for pair in motion.windows(2) {
        dense.extend((1..20).map(|part| pair[0].t_s + f64::from(part) / 20.0 * (pair[1].t_s - pair[0].t_s)));
    }
    dense.sort_by(f64::total_cmp);
    let truth = rendered(&scene, Scheme::Exact, &sampled(dense, &hand));
    let truth_at: Vec<f64> = motion
        .iter()
        .map(|sample| {
            truth
                .iter()
                .find(|row| row.device.t_s == sample.t_s)
                .expect("it is among them")
                .coupling_force_n
        })
        .collect();
    let mut chart = Chart::new(
        "Ticks that come up to 0.3 ms early or late",
        "Time (ms)",
        "Force error (N)",
    );
    for (name, motion) in [
        ("one period a tick assumed", &counted),
        ("elapsed time integrated", &motion),
    ] {
        let rows = rendered(&scene, Scheme::Exact, motion);
        let error: Vec<[f64; 2]> = rows
            .iter()
            .zip(&truth_at)
            .map(|(row, truth)| [1e3 * row.device.t_s, row.coupling_force_n - truth])
            .collect();
        chart = chart.with(Trace::line(format!("{name}: {:.4} N at most", largest(&error)), error));
    }
    drawn::figure("why-timed.svg", &svg(&[chart]));
}
