//! What a tick under a curved law costs behind a block while the hand vibrates, and how far it is
//! from the same tick cut into ten: `cargo bench -p haptic-core --bench curved`.
//!
//! Nanoseconds are medians over repeats of each tick from its own state; instructions come from
//! callgrind, where valgrind is installed, under which the program starts itself once more.

use haptic_core::block::BlockState;
use haptic_core::friction::{Dahl, ElastoPlastic, Friction, HaywardArmstrong, Karnopp, Lugre};
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::scene::{Block, Coupling};
use haptic_core::servo::{CompiledScene, Servo, Settings};
use haptic_core::velocity::Method;
use haptic_core::{Directional, Renderer, Scene, Scheme};
use std::hint::black_box;
use std::process::{Command, Stdio};
use std::time::Instant;

const T: f64 = 1e-3;
const TICKS: u32 = 300;

/// A block and the hand that shakes it.
struct Shaken {
    name: &'static str,
    mass: f64,
    frequency_hz: f64,
    amplitude_m: f64,
}

const HANDS: [Shaken; 4] = [
    Shaken {
        name: "2 Hz, 30 mm, 0.5 kg",
        mass: 0.5,
        frequency_hz: 2.0,
        amplitude_m: 0.03,
    },
    Shaken {
        name: "60 Hz, 4 mm, 0.5 kg",
        mass: 0.5,
        frequency_hz: 60.0,
        amplitude_m: 0.004,
    },
    Shaken {
        name: "437 Hz, 0.5 mm, 10 g",
        mass: 0.01,
        frequency_hz: 437.0,
        amplitude_m: 0.0005,
    },
    Shaken {
        name: "437 Hz, 0.5 mm, 1 g",
        mass: 0.001,
        frequency_hz: 437.0,
        amplitude_m: 0.0005,
    },
];

fn laws() -> Vec<(&'static str, Friction)> {
    let both = Directional::both;
    let (held, sliding) = (both(4.0), both(3.5));
    let contact_stiffness = 1e5;
    let dahl = |exponent| {
        Friction::Dahl(Dahl {
            dynamic_force: sliding,
            contact_stiffness,
            exponent,
            viscous: both(0.0),
        })
    };
    let lugre = Lugre {
        static_force: held,
        dynamic_force: sliding,
        stribeck_velocity: 0.01,
        contact_stiffness,
        contact_damping: 100.0,
        viscous: both(20.0),
    };
    vec![
        ("karnopp", Friction::Karnopp(Karnopp::new(5.0, 3.0))),
        (
            "karnopp, Stribeck",
            Friction::Karnopp(Karnopp {
                stribeck_velocity: 0.02,
                ..Karnopp::new(5.0, 3.0)
            }),
        ),
        ("dahl, i = 1", dahl(1.0)),
        ("dahl, i = 0.5", dahl(0.5)),
        ("dahl, i = 2", dahl(2.0)),
        (
            "hayward-armstrong",
            Friction::HaywardArmstrong(HaywardArmstrong {
                dynamic_force: sliding,
                contact_stiffness,
                elastic_fraction: 0.7,
                viscous: both(0.0),
            }),
        ),
        ("lugre", Friction::Lugre(lugre)),
        (
            "elasto-plastic",
            Friction::ElastoPlastic(ElastoPlastic {
                static_force: held,
                dynamic_force: sliding,
                stribeck_velocity: 0.01,
                contact_stiffness,
                contact_damping: 100.0,
                elastic_fraction: 0.7,
                viscous: both(20.0),
            }),
        ),
    ]
}

impl Shaken {
    /// Position (m) and velocity (m/s) at a tick.
    fn at(&self, tick: f64) -> (f64, f64) {
        let omega = std::f64::consts::TAU * self.frequency_hz;
        let phase = omega * tick * T;
        (
            self.amplitude_m * (1.0 - phase.cos()),
            self.amplitude_m * omega * phase.sin(),
        )
    }

    fn renderer(&self, friction: Friction) -> Renderer {
        let scene = Scene {
            name: String::new(),
            block: Some(Block { mass: self.mass }),
            coupling: Some(Coupling {
                stiffness: 25_000.0,
                damping: 10.0,
            }),
            friction,
        };
        let mut renderer = Renderer::new(&scene, Scheme::Exact, T).expect("a valid scene");
        let (position, velocity) = self.at(0.0);
        renderer.set_state(BlockState::new(position, 0.0, position, velocity));
        renderer
    }
}

/// What is counted: a function of its own, so that callgrind can tell it from the rest.
#[inline(never)]
fn counted_tick(renderer: &mut Renderer, elapsed_s: f64, (position, velocity): (f64, f64)) -> f64 {
    black_box(renderer.tick(elapsed_s, position, velocity)).coupling_force
}

/// Nanoseconds of a tick, by the median of a few batches.
fn nanoseconds(renderer: &Renderer, to: (f64, f64)) -> f64 {
    const BATCH: u32 = 16;
    let mut batches: Vec<f64> = (0..7)
        .map(|_| {
            let mut copies: Vec<Renderer> = (0..BATCH).map(|_| renderer.clone()).collect();
            let began = Instant::now();
            for copy in &mut copies {
                counted_tick(copy, T, to);
            }
            began.elapsed().as_secs_f64() * 1e9 / f64::from(BATCH)
        })
        .collect();
    batches.sort_by(f64::total_cmp);
    batches[batches.len() / 2]
}

/// Difference of the force, N, to that of the same tick cut into ten.
fn error(renderer: &Renderer, whole: f64, hand: [(f64, f64); 2]) -> f64 {
    let mut split = renderer.clone();
    let [from, to] = hand;
    let mut force = 0.0;
    for part in 1..=10 {
        let share = f64::from(part) / 10.0;
        let between = |from: f64, to: f64| from + share * (to - from);
        force = counted_tick(&mut split, 0.1 * T, (between(from.0, to.0), between(from.1, to.1)));
    }
    (force - whole).abs()
}

/// Median and largest.
fn spread(mut values: Vec<f64>) -> (f64, f64) {
    values.sort_by(f64::total_cmp);
    let largest = values.last().copied().unwrap_or(f64::NAN);
    (values.get(values.len() / 2).copied().unwrap_or(f64::NAN), largest)
}

/// Instructions of each tick, by callgrind; none where valgrind is missing.
fn instructions(law: usize, hand: usize) -> Option<Vec<f64>> {
    let directory = std::env::temp_dir().join(format!("curved-{}-{law}-{hand}", std::process::id()));
    std::fs::create_dir_all(&directory).ok()?;
    let out = directory.join("out");
    let ran = Command::new("valgrind")
        .args([
            "--tool=callgrind",
            "--toggle-collect=curved::counted_tick",
            "--dump-after=curved::counted_tick",
        ])
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(std::env::current_exe().ok()?)
        .args(["probe", &law.to_string(), &hand.to_string()])
        .stdin(Stdio::null())
        .output()
        .ok()
        .filter(|ran| ran.status.success());
    let count = |tick: u32| {
        let text = std::fs::read_to_string(format!("{}.{}", out.display(), tick + 1)).ok()?;
        let total = text.lines().find_map(|line| line.strip_prefix("totals: "))?;
        total.trim().parse().ok()
    };
    let counts = ran.and_then(|_| (0..TICKS).map(count).collect());
    std::fs::remove_dir_all(&directory).ok()?;
    counts
}

fn probe(law: usize, hand: usize) {
    let hand = &HANDS[hand];
    let mut renderer = hand.renderer(laws()[law].1);
    for tick in 1..=TICKS {
        counted_tick(&mut renderer, T, hand.at(f64::from(tick)));
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [probed, law, hand] = &arguments[..]
        && probed == "probe"
    {
        return probe(law.parse().expect("a number"), hand.parse().expect("a number"));
    }
    println!(
        "law                | hand                 | error, N: median, worst | ns: median, mean, dearest | \
         instructions: median, mean, dearest | at bound"
    );
    for (law, (name, friction)) in laws().into_iter().enumerate() {
        for (index, hand) in HANDS.iter().enumerate() {
            let mut renderer = hand.renderer(friction);
            let (mut errors, mut costs, mut exhausted) = (Vec::new(), Vec::new(), 0);
            for tick in 1..=TICKS {
                let ends = [hand.at(f64::from(tick - 1)), hand.at(f64::from(tick))];
                costs.push(nanoseconds(&renderer, ends[1]));
                let before = renderer.clone();
                let rendered = renderer.tick(T, ends[1].0, ends[1].1);
                exhausted += u32::from(rendered.work_exhausted);
                errors.push(error(&before, rendered.coupling_force, ends));
            }
            let mean = |values: &[f64]| values.iter().sum::<f64>() / f64::from(TICKS);
            let (mean_ns, mean_count);
            mean_ns = mean(&costs);
            let ((error, worst), (median_ns, dearest_ns)) = (spread(errors), spread(costs));
            let counts = instructions(law, index).unwrap_or_default();
            mean_count = mean(&counts);
            let (median_count, dearest_count) = spread(counts);
            println!(
                "{name:18} | {:20} | {error:7.0e} {worst:7.0e} | {median_ns:7.0} {mean_ns:7.0} {dearest_ns:7.0} | \
                 {median_count:7.0} {mean_count:7.0} {dearest_count:7.0} | {exhausted}",
                hand.name
            );
        }
    }
    print_snapshot();
}

/// What the loop does every ten seconds of a recording.
fn print_snapshot() {
    let settings = Settings {
        period_s: T,
        ramp_s: 0.1,
        limits: Limits::default(),
        losses: RigLosses {
            damping: 0.0,
            friction: 0.0,
        },
        passivity_control_n: 0.0,
        velocity: Method::FoawBestFit,
        stale_ns: 20_000_000,
        stop_button: None,
        enable_button: None,
        compensation: None,
    };
    let renderer = Renderer::new(&Scene::paper(), Scheme::Exact, T).expect("a valid scene");
    let mut servo = Servo::new(settings, Box::new(CompiledScene::at_once(renderer, 1)));
    let costs: Vec<f64> = (0..10_000)
        .map(|_| {
            let began = Instant::now();
            black_box(servo.snapshot());
            began.elapsed().as_secs_f64() * 1e9
        })
        .collect();
    let (median_ns, dearest_ns) = spread(costs);
    println!("a servo's snapshot: {median_ns:.0} ns (median), {dearest_ns:.0} ns (dearest of 10,000)");
}
