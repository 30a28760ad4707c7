//! The block in the plane, speed against error: `cargo bench -p haptic-core --bench planar`.
//!
//! Beside the exact tick: Moreau's implicit step, which physics engines take, once and a hundred times a tick, and one
//! Karnopp block for each axis, which is what the firmware of force-feedback devices does. Errors are those of the
//! force, N, to the references of tests/data/planar. Nanoseconds are of single ticks, less those of reading the clock;
//! instructions come from callgrind, where valgrind is installed, under which the program starts itself once more.

use haptic_core::block::{BlockState, Coupling};
use haptic_core::friction::{Friction, Karnopp};
use haptic_core::planar::{IsotropicKarnopp, PlanarBlock, PlanarState, Plane};
use haptic_core::scene::Block;
use haptic_core::{Directional, Renderer, Scene, Scheme};
use std::hint::black_box;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

const T: f64 = 1e-3;

/// Passes of a reference whose ticks are timed.
const PASSES: usize = 20;

/// Mass, coupling, friction.
type Block3 = (f64, Coupling, IsotropicKarnopp);

struct Reference {
    name: &'static str,
    block: Block3,
    /// Position and velocity of the device.
    samples: Vec<(Plane, Plane)>,
    forces: Vec<Plane>,
}

fn references() -> Vec<Reference> {
    let case = |name, mass, [stiffness, damping]: [f64; 2], [static_force, dynamic_force, viscous]: [f64; 3]| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/planar/{name}.csv"));
        let text = std::fs::read_to_string(path).expect("a reference");
        let rows = text.lines().skip(1).map(|line| {
            let row: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
            let pair = |at: usize| Plane::new(row[at], row[at + 1]);
            ((pair(1), pair(3)), pair(9))
        });
        let (samples, forces) = rows.unzip();
        let friction = IsotropicKarnopp {
            static_force,
            dynamic_force,
            viscous,
            velocity_threshold: 0.0,
        };
        Reference {
            name,
            block: (mass, Coupling { stiffness, damping }, friction),
            samples,
            forces,
        }
    };
    vec![
        case("circle", 0.5, [25_000.0, 10.0], [4.0, 3.5, 0.0]),
        case("zig-zag-stick", 0.5, [2000.0, 4.0], [4.0, 3.5, 0.0]),
        case("slanted-line", 0.5, [25_000.0, 10.0], [4.0, 3.5, 2.0]),
        case("light-block-spiral", 0.001, [25_000.0, 0.5], [2.0, 1.5, 0.0]),
    ]
}

/// Ways to move the block on.
enum Method {
    Exact(Box<PlanarBlock>),
    Moreau(Moreau),
    TwoAxes(Box<[Renderer; 2]>),
}

const METHODS: [&str; 4] = ["exact", "Moreau x1", "Moreau x100", "two Karnopps"];

impl Method {
    fn new(method: usize, reference: &Reference) -> Self {
        let (mass, coupling, friction) = reference.block;
        let (position, velocity) = reference.samples[0];
        match method {
            0 => {
                let mut block = PlanarBlock::new(mass, coupling, friction);
                block.set_state(PlanarState::new(Plane::ZERO, Plane::ZERO, position, velocity));
                Self::Exact(Box::new(block))
            }
            1 | 2 => Self::Moreau(Moreau {
                mass,
                coupling,
                friction,
                steps: if method == 1 { 1 } else { 100 },
                position: Plane::ZERO,
                velocity: Plane::ZERO,
                device: (position, velocity),
            }),
            _ => {
                let mut karnopp = Karnopp::new(friction.static_force, friction.dynamic_force);
                karnopp.viscous = Directional::both(friction.viscous);
                let scene = Scene {
                    name: String::new(),
                    block: Some(Block { mass }),
                    coupling: Some(coupling),
                    friction: Friction::Karnopp(karnopp),
                };
                let axis = |position, velocity| {
                    let mut axis = Renderer::new(&scene, Scheme::Exact, T).expect("a valid scene");
                    axis.set_state(BlockState::new(0.0, 0.0, position, velocity));
                    axis
                };
                Self::TwoAxes(Box::new([axis(position.x, velocity.x), axis(position.y, velocity.y)]))
            }
        }
    }
}

/// What is counted: a function of its own, so that callgrind can tell it from the rest.
#[inline(never)]
fn counted_tick(method: &mut Method, position: Plane, velocity: Plane) -> Plane {
    match method {
        Method::Exact(block) => block.tick(T, position, velocity, &mut ()).coupling_force,
        Method::Moreau(moreau) => moreau.tick(position, velocity),
        Method::TwoAxes(axes) => Plane::new(
            axes[0].tick(T, position.x, velocity.x).coupling_force,
            axes[1].tick(T, position.y, velocity.y).coupling_force,
        ),
    }
}

/// Backward Euler with Coulomb friction in the cone (Moreau 1988).
struct Moreau {
    mass: f64,
    coupling: Coupling,
    friction: IsotropicKarnopp,
    steps: u32,
    position: Plane,
    velocity: Plane,
    device: (Plane, Plane),
}

impl Moreau {
    fn tick(&mut self, position: Plane, velocity: Plane) -> Plane {
        let Coupling { stiffness, damping } = self.coupling;
        let step_s = T / f64::from(self.steps);
        let from = self.device;
        for step in 1..=self.steps {
            let share = f64::from(step) / f64::from(self.steps);
            let there = from.0 + (position - from.0) * share;
            let fast = from.1 + (velocity - from.1) * share;
            let pull = (there - self.position) * stiffness + fast * damping;
            let impulse = self.velocity * (self.mass / step_s) + pull;
            let is_stuck = self.velocity == Plane::ZERO;
            let holds = if is_stuck {
                self.friction.static_force
            } else {
                self.friction.dynamic_force
            };
            let length = impulse.length();
            let drag = self.mass / step_s + damping + self.friction.viscous + stiffness * step_s;
            self.velocity = if length <= holds {
                Plane::ZERO
            } else {
                impulse * ((length - self.friction.dynamic_force) / (drag * length))
            };
            self.position += self.velocity * step_s;
        }
        self.device = (position, velocity);
        (position - self.position) * stiffness + (velocity - self.velocity) * damping
    }
}

/// Median, the 99th of a hundred, and the largest.
fn spread(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [values.len() / 2, values.len() * 99 / 100, values.len() - 1].map(|at| values[at])
}

/// Time that reading the clock takes, ns.
fn clock_ns() -> f64 {
    spread(
        (0..1000)
            .map(|_| Instant::now().elapsed().as_secs_f64() * 1e9)
            .collect(),
    )[0]
}

/// Median and mean instructions of a tick, by callgrind; none where valgrind is missing.
fn instructions(method: usize, reference: usize, ticks: usize) -> Option<[f64; 2]> {
    let directory = std::env::temp_dir().join(format!("planar-{}-{method}-{reference}", std::process::id()));
    std::fs::create_dir_all(&directory).ok()?;
    let out = directory.join("out");
    let ran = Command::new("valgrind")
        .args([
            "--tool=callgrind",
            "--toggle-collect=planar::counted_tick",
            "--dump-after=planar::counted_tick",
        ])
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(std::env::current_exe().ok()?)
        .args(["probe", &method.to_string(), &reference.to_string()])
        .stdin(Stdio::null())
        .output()
        .ok()
        .filter(|ran| ran.status.success());
    let count = |tick: usize| -> Option<f64> {
        let text = std::fs::read_to_string(format!("{}.{tick}", out.display())).ok()?;
        text.lines()
            .find_map(|line| line.strip_prefix("totals: "))?
            .trim()
            .parse()
            .ok()
    };
    let counts: Option<Vec<f64>> = ran.and_then(|_| (1..=ticks).map(count).collect());
    std::fs::remove_dir_all(&directory).ok()?;
    let counts = counts?;
    let mean = counts.iter().sum::<f64>() / counts.len() as f64;
    Some([spread(counts)[0], mean])
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let references = references();
    if let [probed, method, reference] = &arguments[..]
        && probed == "probe"
    {
        let reference = &references[reference.parse::<usize>().expect("a number")];
        let mut method = Method::new(method.parse().expect("a number"), reference);
        for (position, velocity) in &reference.samples[1..] {
            black_box(counted_tick(&mut method, *position, *velocity));
        }
        return;
    }
    let clock_ns = clock_ns();
    println!(
        "| reference | tick | error, N: median | worst | ns: median | p99 | worst | instructions: median | mean |\n\
         |---|---|---|---|---|---|---|---|---|"
    );
    for (index, reference) in references.iter().enumerate() {
        for (method, name) in METHODS.iter().enumerate() {
            let (mut errors, mut costs) = (Vec::new(), Vec::new());
            for pass in 0..PASSES {
                let mut block = Method::new(method, reference);
                for ((position, velocity), force) in reference.samples.iter().zip(&reference.forces).skip(1) {
                    let began = Instant::now();
                    let rendered = black_box(counted_tick(&mut block, *position, *velocity));
                    costs.push((began.elapsed().as_secs_f64() * 1e9 - clock_ns).max(0.0));
                    if pass == 0 {
                        errors.push((rendered - *force).length());
                    }
                }
            }
            let [error, _, worst] = spread(errors);
            let [median_ns, p99_ns, worst_ns] = spread(costs);
            let counts = instructions(method, index, reference.samples.len() - 1);
            let [median, mean] = counts.unwrap_or([f64::NAN; 2]);
            println!(
                "| {} | {name} | {error:.0e} | {worst:.0e} | {median_ns:.0} | {p99_ns:.0} | {worst_ns:.0} | {median:.0} | \
                 {mean:.0} |",
                reference.name
            );
        }
    }
}
