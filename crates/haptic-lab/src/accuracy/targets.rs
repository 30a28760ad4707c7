//! The figures that the exact scheme is held to, each measured here and now.

use super::cases::{self, OscillatingHand};
use super::{compare, reference};
use crate::motion::DeviceSample;
use crate::simulate::{Start, measure_cost, renderer, simulate};
use haptic_core::friction::{Dahl, ElastoPlastic, Friction, HaywardArmstrong, Karnopp, Lugre, Reseat, ResetIntegrator};
use haptic_core::scene::{Block, Coupling};
use haptic_core::{Directional, ParameterKey, Renderer, Scene, SceneError, Scheme};
use haptic_motion::median::median;
use std::time::Instant;

/// A figure and its target.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// The quantity.
    pub what: &'static str,
    /// The figure, with its unit.
    pub measured: String,
    /// The target.
    pub target: &'static str,
    /// Whether it is.
    pub met: bool,
}

pub(super) fn target(what: &'static str, target: &'static str, met: bool, measured: String) -> Target {
    Target {
        what,
        measured,
        target,
        met,
    }
}

/// Measures every target. Nanoseconds are this machine's, at this moment.
///
/// # Errors
/// Never in practice: the scenes are valid.
pub fn targets() -> Result<Vec<Target>, SceneError> {
    let mut targets = Vec::new();
    accuracy(&mut targets)?;
    speed(&mut targets)?;
    stillness(&mut targets)?;
    blow_ups(&mut targets);
    Ok(targets)
}

/// The six stored references' scenes, whose stored digits the reference solver gives.
const REFERENCES: [&str; 6] = [
    "paper",
    "high stiction",
    "viscous friction alone",
    "slow ramp",
    "free motion",
    "light block, 10 g",
];

fn accuracy(targets: &mut Vec<Target>) -> Result<(), SceneError> {
    let (mut position, mut force, mut time) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (mut same_lists, mut created) = (true, 0.0);
    for case in cases::of_karnopp() {
        let run = simulate(&case.scene, Scheme::Exact, &case.motion, case.start)?;
        created += run.energy_created_j;
        if REFERENCES.contains(&case.name.as_str()) {
            let error = compare(
                &run,
                &reference::solve(&case.scene, &case.motion, case.start),
                case.stiffness(),
            );
            position = position.max(error.position_m);
            force = force.max(error.relative_force);
            time = time.max(error.event_time_s.unwrap_or(0.0));
            same_lists &= error.event_time_s.is_some();
        }
    }
    targets.push(target(
        "position error on the reference scenes",
        "<= 1e-12 m",
        position <= 1e-12,
        format!("{position:.1e} m"),
    ));
    targets.push(target(
        "force error there, over max(K |p|, 1 N)",
        "<= 1e-9",
        force <= 1e-9,
        format!("{force:.1e}"),
    ));
    targets.push(target(
        "event times there, lists of events alike",
        "<= 1e-12 s, yes",
        time <= 1e-12 && same_lists,
        format!("{time:.1e} s, {}", if same_lists { "yes" } else { "no" }),
    ));
    targets.push(target(
        "energy created by friction, 29 cases",
        "0 J",
        created == 0.0,
        format!("{created} J"),
    ));
    Ok(())
}

fn nanoseconds(work: impl FnOnce()) -> f64 {
    let began = Instant::now();
    work();
    #[expect(clippy::cast_precision_loss, reason = "less than a second")]
    let took = began.elapsed().as_nanos() as f64;
    took
}

fn tick(renderer: &mut Renderer, from: &DeviceSample, to: &DeviceSample) -> u32 {
    std::hint::black_box(renderer.tick(to.t_s - from.t_s, to.position_m, to.velocity_mps)).events
}

fn speed(targets: &mut Vec<Target>) -> Result<(), SceneError> {
    // A steady slide: the hand keeps one speed.
    let steady: Vec<DeviceSample> = (0..2000)
        .map(|k| DeviceSample {
            t_s: f64::from(k) * 1e-3,
            position_m: f64::from(k) * 2e-4,
            velocity_mps: 0.2,
        })
        .collect();
    let start = Start {
        position_m: None,
        velocity_mps: 0.2,
    };
    let paper = Scene::paper();
    // Side by side, turn by turn, so that the machine's moods are shared.
    let (mut exact, mut literal) = (Vec::new(), Vec::new());
    for _ in 0..9 {
        exact.push(measure_cost(&paper, Scheme::Exact, &steady, start)?.median_ns);
        literal.push(measure_cost(&paper, Scheme::LITERAL, &steady, start)?.median_ns);
    }
    let [exact, literal] = [exact, literal].map(|mut costs| median(&mut costs).unwrap_or(f64::NAN));
    targets.push(target(
        "steady exact tick, paper scene, median",
        "<= 40 ns",
        exact <= 40.0,
        format!("{exact:.1} ns"),
    ));
    targets.push(target(
        "the same, over the literal scheme's tick",
        "<= 3",
        exact <= 3.0 * literal,
        format!("{:.2}", exact / literal),
    ));
    let one_event = slowest_tick(&paper, &OscillatingHand::PLAIN.samples(), |events| events == 1)?;
    targets.push(target(
        "tick with one event, paper scene, the dearest one's median",
        "<= 1 us",
        one_event <= 1000.0,
        format!("{:.2} us", one_event * 1e-3),
    ));
    // omega_d T = 30 without damping, where every half-turn can hold a stop: M = K T^2/900.
    let light = changed(&[("M", 25_000.0 * 1e-6 / 900.0), ("B", 0.0)]);
    let hand = OscillatingHand {
        samples: 400,
        ..OscillatingHand::PLAIN
    };
    let any = slowest_tick(&light, &hand.samples(), |_| true)?;
    targets.push(target(
        "any tick with omega_d T <= 30, the dearest one's median",
        "<= 5 us",
        any <= 5000.0,
        format!("{:.2} us", any * 1e-3),
    ));
    Ok(())
}

/// The cost of the dearest tick of a run, ns: each tick that counts is done over and over from its
/// own state, and its median taken.
fn slowest_tick(scene: &Scene, motion: &[DeviceSample], counts: impl Fn(u32) -> bool) -> Result<f64, SceneError> {
    const REPEATS: usize = 51;
    const BATCH: u32 = 20;
    let mut renderer = renderer(scene, Scheme::Exact, motion, Start::default())?;
    let mut slowest = 0.0_f64;
    for pair in motion.windows(2) {
        let (from, to) = (&pair[0], &pair[1]);
        let before = renderer.state();
        if counts(tick(&mut renderer, from, to)) {
            let after = renderer.state();
            let mut costs: Vec<f64> = (0..REPEATS)
                .map(|_| {
                    nanoseconds(|| {
                        for _ in 0..BATCH {
                            renderer.set_state(std::hint::black_box(before));
                            tick(&mut renderer, from, to);
                        }
                    }) / f64::from(BATCH)
                })
                .collect();
            slowest = slowest.max(median(&mut costs).unwrap_or(f64::NAN));
            renderer.set_state(after);
        }
    }
    Ok(slowest)
}

fn changed(changes: &[(&str, f64)]) -> Scene {
    let changes: Vec<(ParameterKey, f64)> = changes
        .iter()
        .map(|&(name, value)| (name.parse().expect("a parameter"), value))
        .collect();
    Scene::paper().with(&changes).expect("a valid scene")
}

fn stillness(targets: &mut Vec<Target>) -> Result<(), SceneError> {
    // 60 s under three quarters of the static limit.
    let position = 0.75 * 4.0 / 25_000.0;
    let mut block = Renderer::new(&Scene::paper(), Scheme::Exact, 1e-3)?;
    block.start_at(0.0, 0.0);
    for _ in 0..60_000 {
        block.tick(1e-3, position, 0.0);
    }
    let crept = block.state().position;
    targets.push(target(
        "creep in 60 s under 0.75 Fs",
        "0 m",
        crept == 0.0,
        format!("{crept} m"),
    ));
    for (name, what, bound_text, bound) in [
        ("karnopp", "creep under a shaking load, Karnopp", "0", 0.0),
        (
            "reset-integrator",
            "creep under a shaking load, reset integrator",
            "0",
            1e-9,
        ),
        (
            "elasto-plastic",
            "creep under a shaking load, elasto-plastic",
            "<= 0.01 um/s",
            0.01,
        ),
        (
            "hayward-armstrong",
            "creep under a shaking load, Hayward-Armstrong",
            "-",
            f64::INFINITY,
        ),
        ("lugre", "creep under a shaking load, LuGre", "-", f64::INFINITY),
        (
            "dahl",
            "creep under a shaking load, Dahl with i = 1",
            "-",
            f64::INFINITY,
        ),
    ] {
        let crept = creep(name)?;
        targets.push(target(
            what,
            bound_text,
            crept.abs() <= bound,
            format!("{:.4} um/s", crept.abs()),
        ));
    }
    Ok(())
}

/// Creep, um/s, of a contact that holds 4 N with 1e5 N/m, under 1.5 N + 1.0 N sin(25 Hz) for 60 s.
///
/// A block of 1 g takes the load through a soft coupling whose end goes with the block, so that the
/// load is the prescribed one.
fn creep(law: &str) -> Result<f64, SceneError> {
    const COUPLING: Coupling = Coupling {
        stiffness: 100.0,
        damping: 5.0,
    };
    const SECONDS: u32 = 60;
    let both = Directional::both(4.0);
    let (contact_stiffness, viscous) = (1e5, Directional::both(0.0));
    let friction = match law {
        "karnopp" => Friction::Karnopp(Karnopp::new(4.0, 4.0)),
        "reset-integrator" => Friction::ResetIntegrator(ResetIntegrator {
            static_force: both,
            dynamic_force: both,
            contact_stiffness,
            contact_damping: 0.0,
            viscous,
            reseat: Reseat::Continuous,
        }),
        "elasto-plastic" => Friction::ElastoPlastic(ElastoPlastic {
            static_force: both,
            dynamic_force: both,
            stribeck_velocity: 0.0,
            contact_stiffness,
            contact_damping: 0.0,
            elastic_fraction: 0.7,
            viscous,
        }),
        "hayward-armstrong" => Friction::HaywardArmstrong(HaywardArmstrong {
            dynamic_force: both,
            contact_stiffness,
            elastic_fraction: 0.95,
            viscous,
        }),
        "lugre" => Friction::Lugre(Lugre {
            static_force: both,
            dynamic_force: both,
            stribeck_velocity: 0.0,
            contact_stiffness,
            contact_damping: 0.0,
            viscous,
        }),
        _ => Friction::Dahl(Dahl {
            dynamic_force: both,
            contact_stiffness,
            exponent: 1.0,
            viscous,
        }),
    };
    let scene = Scene {
        block: Some(Block { mass: 1e-3 }),
        coupling: Some(COUPLING),
        friction,
        ..Scene::paper()
    };
    let mut block = Renderer::new(&scene, Scheme::Exact, 1e-3)?;
    block.start_at(0.0, 0.0);
    let mut after_a_second = 0.0;
    for k in 1..=SECONDS * 1000 {
        let t = f64::from(k) * 1e-3;
        let load = 1.5 + (std::f64::consts::TAU * 25.0 * t).sin();
        let now = block.state();
        block.tick(1e-3, now.position + load / COUPLING.stiffness, now.velocity);
        if k == 1000 {
            after_a_second = block.state().position;
        }
    }
    Ok((block.state().position - after_a_second) * 1e6 / f64::from(SECONDS - 1))
}

/// A million ticks of scenes drawn at random, with jitter, missed ticks and jumps.
fn blow_ups(targets: &mut Vec<Target>) {
    const TICKS: u32 = 1_000_000;
    const TICKS_A_SCENE: u32 = 500;
    let mut seed = 1_u64;
    let mut uniform = || {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        #[expect(clippy::cast_precision_loss, reason = "53 bits of it")]
        let number = (seed >> 11) as f64 / (1_u64 << 53) as f64;
        number
    };
    let (mut ticks, mut blown_up, mut exhausted) = (0, 0, 0);
    while ticks < TICKS {
        let mut decade = |low: f64, high: f64| 10_f64.powf(low + (high - low) * uniform());
        let fs = decade(-2.0, 2.0);
        let (mass, stiffness, damping) = (decade(-6.0, 2.0), decade(0.0, 6.4), decade(-2.0, 3.0));
        let fd = fs * uniform();
        let scene = Scene {
            block: Some(Block { mass }),
            coupling: Some(Coupling { stiffness, damping }),
            friction: Friction::Karnopp(Karnopp::new(fs, fd)),
            ..Scene::paper()
        };
        let Ok(mut block) = Renderer::new(&scene, Scheme::Exact, 1e-3) else {
            // Too fast for the rate, and refused.
            continue;
        };
        block.start_at(0.0, 0.0);
        let (mut position, mut velocity) = (0.0, 0.0);
        for _ in 0..TICKS_A_SCENE {
            let elapsed = 1e-3 * (0.7 + 0.6 * uniform()) * if uniform() < 0.01 { 30.0 } else { 1.0 };
            velocity = 0.95 * velocity + 0.05 * (2.0 * uniform() - 1.0);
            position += velocity * elapsed
                + if uniform() < 0.01 {
                    0.02 * (uniform() - 0.5)
                } else {
                    0.0
                };
            let rendered = block.tick(elapsed, position, velocity);
            // The hand goes no farther than this in these runs, and a block that is dragged no
            // farther from it.
            let lost = !rendered.coupling_force.is_finite() || (block.state().position - position).abs() > 100.0;
            blown_up += u32::from(lost);
            exhausted += u32::from(rendered.work_exhausted);
            ticks += 1;
        }
    }
    targets.push(target(
        "blow-ups in 1e6 ticks of random scenes, jumps and jitter",
        "0",
        blown_up == 0,
        format!("{blown_up} ({exhausted} ticks at their bound of work)"),
    ));
}
