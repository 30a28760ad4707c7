//! Figures of the exact scheme that no test can hold, since they are this machine's, or that only inform, beside what
//! they are to be. The tests hold errors, instructions and lists of contact changes to [`LIMITS`](super::LIMITS).

use super::by_law::{LawMeasurement, worst_of};
use super::cases::{OscillatingHand, changed};
use crate::motion::DeviceSample;
use crate::simulate::{Start, measure_cost, renderer};
use haptic_core::friction::{Dahl, ElastoPlastic, Friction, HaywardArmstrong, Karnopp, Lugre, Reseat, ResetIntegrator};
use haptic_core::scene::{Block, Coupling};
use haptic_core::{Directional, Renderer, Scene, SceneError, Scheme};
use haptic_motion::median::median;
use std::time::Instant;

/// A figure and its target.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// The quantity.
    pub what: String,
    /// The figure, with its unit.
    pub measured: String,
    /// The target.
    pub target: &'static str,
    /// Whether it is.
    pub met: bool,
}

fn target(what: impl Into<String>, target: &'static str, met: bool, measured: String) -> Target {
    Target {
        what: what.into(),
        measured,
        target,
        met,
    }
}

/// Measures every target. Nanoseconds are this machine's, at this moment. `karnopp_instructions` are those a tick of
/// the scene "Karnopp behind a block".
///
/// # Errors
/// Never in practice: the scenes are valid.
pub fn targets(laws: &[LawMeasurement], karnopp_instructions: Option<f64>) -> Result<Vec<Target>, SceneError> {
    let uncertainty_n = worst_of(laws).uncertainty_n;
    let mut targets = vec![target(
        "the reference's own error, all laws, hands and masses",
        "<= 1e-12 N",
        uncertainty_n <= 1e-12,
        format!("{uncertainty_n:.0e} N"),
    )];
    single_ticks(&mut targets)?;
    under_hands(&mut targets, laws);
    if let Some(count) = karnopp_instructions {
        let text = format!("{count:.0}");
        targets.push(target("Karnopp's instructions a tick", "<= 266", count <= 266.5, text));
    }
    for (name, what, to_be, bound) in CREEPS {
        let crept = creep(name)?.abs();
        let what = format!("creep under a shaking load, {what}");
        targets.push(target(what, to_be, crept <= bound, format!("{crept:.4} um/s")));
    }
    Ok(targets)
}

/// What a tick under a hand costs: law, the largest that it may be, us, and the same in words.
const MEDIANS: [(&str, f64, &str); 6] = [
    ("karnopp", 0.032, "<= 0.032 us"),
    ("karnopp, Stribeck", 0.15, "<= 0.15 us"),
    ("dahl", 0.45, "<= 0.45 us"),
    ("lugre", 0.6, "<= 0.6 us"),
    ("hayward-armstrong", 0.45, "<= 0.45 us"),
    ("elasto-plastic", 1.2, "<= 1.2 us"),
];
const DEAREST: [(&str, f64, &str); 5] = [
    ("karnopp, Stribeck", 8.0, "<= 8 us"),
    ("dahl", 8.0, "<= 8 us"),
    ("lugre", 10.0, "<= 10 us"),
    ("hayward-armstrong", 22.0, "<= 22 us"),
    ("elasto-plastic", 20.0, "<= 20 us"),
];
const ON_DEVICE: [(&str, f64, &str); 2] = [
    ("hayward-armstrong", 0.025, "<= 0.025 us"),
    ("elasto-plastic, Fs = Fd", 0.025, "<= 0.025 us"),
];

/// Laws under a shaking load: what their creep is to be, um/s.
const CREEPS: [(&str, &str, &str, f64); 6] = [
    ("karnopp", "Karnopp", "0", 0.0),
    ("reset-integrator", "reset integrator", "0", 1e-9),
    ("elasto-plastic", "elasto-plastic", "<= 0.01 um/s", 0.01),
    ("hayward-armstrong", "Hayward-Armstrong", "-", f64::INFINITY),
    ("lugre", "LuGre", "-", f64::INFINITY),
    ("dahl", "Dahl with i = 1", "-", f64::INFINITY),
];

fn under_hands(targets: &mut Vec<Target>, laws: &[LawMeasurement]) {
    let mut add = |what: &str, rows: &[(&str, f64, &'static str)], hand: &str, mass_kg, is_dearest: bool| {
        for &(law, most_us, to_be) in rows {
            let is_wanted = |one: &&LawMeasurement| {
                (one.law, one.scheme, one.hand, one.mass_kg) == (law, Scheme::Exact, hand, mass_kg)
            };
            let cost = laws.iter().find(is_wanted).and_then(|one| one.cost);
            let us = cost.map_or(f64::NAN, |cost| {
                1e-3 * if is_dearest { cost.dearest_ns } else { cost.median_ns }
            });
            targets.push(target(
                format!("{what}: {law}"),
                to_be,
                us <= most_us,
                format!("{us:.3} us"),
            ));
        }
    };
    add("median tick, 60 Hz, 0.5 kg", &MEDIANS, "60 Hz", Some(0.5), false);
    add("dearest tick, 437 Hz, 10 g", &DEAREST, "437 Hz", Some(0.01), true);
    add("median tick on the device", &ON_DEVICE, "60 Hz", None, false);
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

fn single_ticks(targets: &mut Vec<Target>) -> Result<(), SceneError> {
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
