//! Scenes of every law, and a hand that explores them.

use crate::random::Random;
use haptic_core::block::{Contact, EventSink};
use haptic_core::friction::{Friction, LAWS};
use haptic_core::scene::{Block, Coupling};
use haptic_core::{ParameterKey, Renderer, Scene, Scheme};
use std::path::Path;

/// Duration of a tick, s.
pub(crate) const T: f64 = 1e-3;

/// The rows of a table of numbers below `tests/data`.
pub(crate) fn table(name: &str) -> Vec<Vec<f64>> {
    let row = |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect();
    data(&format!("{name}.csv")).lines().skip(1).map(row).collect()
}

/// A file below `tests/data`.
pub(crate) fn data(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(file);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A law on the device itself.
pub(crate) fn on_device(friction: Friction) -> Scene {
    Scene {
        name: String::new(),
        block: None,
        coupling: None,
        friction,
    }
}

/// A law under a block of a mass, kg, in the paper's grip.
pub(crate) fn behind_block(friction: Friction, mass: f64) -> Scene {
    Scene {
        block: Some(Block { mass }),
        coupling: Some(Coupling {
            stiffness: 25_000.0,
            damping: 10.0,
        }),
        ..on_device(friction)
    }
}

/// A scene with other values; the scene itself where one is refused or it lacks a parameter.
pub(crate) fn changed(scene: &Scene, changes: &[(&str, f64)]) -> Scene {
    let keys = changes
        .iter()
        .map(|&(name, value)| (name.parse().expect("a parameter"), value));
    let changes: Vec<(ParameterKey, f64)> = keys.collect();
    scene.with(&changes).unwrap_or_else(|_| scene.clone())
}

/// The energy that friction took, J, and what it gave back.
#[derive(Default)]
pub(crate) struct Meter {
    pub(crate) taken: f64,
    pub(crate) created: f64,
}

impl EventSink for Meter {
    fn contact_changed(&mut self, _at_s: f64, _from: Contact, _to: Contact) {}

    fn dissipated(&mut self, energy_j: f64) {
        self.taken += energy_j;
        self.created += (-energy_j).max(0.0);
    }
}

/// The exact scheme.
pub(crate) fn renderer(scene: &Scene) -> Renderer {
    Renderer::new(scene, Scheme::Exact, T).expect("a valid scene")
}

/// A hand that explores, at irregular times: time passed (s), position (m) and velocity (m/s). Made
/// of sums and products alone.
pub(crate) struct Hand {
    random: Random,
    wanted: f64,
    position: f64,
    velocity: f64,
}

impl Hand {
    pub(crate) fn new() -> Self {
        Self {
            random: Random(88_172_645_463_325_252),
            wanted: 0.0,
            position: 0.0,
            velocity: 0.0,
        }
    }

    /// The next sample: time passed, position and velocity.
    pub(crate) fn next(&mut self, tick: u32) -> (f64, f64, f64) {
        let elapsed = match tick % 400 {
            399 => 0.004,
            n if n < 200 => 0.001,
            _ => 0.001 * (0.7 + 0.6 * self.random.share()),
        };
        if tick.is_multiple_of(70) {
            // Slow and fast strokes, and rests.
            let share = self.random.share() - 0.5;
            self.wanted = if tick.is_multiple_of(5 * 70) {
                0.0
            } else {
                share * share * share * 2.0
            };
        }
        let before = self.velocity;
        self.velocity += 0.05 * (self.wanted - self.velocity);
        self.position += 0.5 * elapsed * (before + self.velocity);
        (elapsed, self.position, self.velocity)
    }
}

/// Parameters with which a law takes its other ways, beside those that it has anyway.
const WAYS: [&[(&str, f64)]; 6] = [
    &[],
    &[
        ("Fs+", 5.0),
        ("Fs-", 3.75),
        ("Fd+", 3.0),
        ("Fd-", 2.5),
        ("b+", 4.0),
        ("b-", 2.0),
    ],
    &[("M", 0.01), ("b", 1.0), ("ws", 0.02)],
    &[("DV", 0.003), ("gamma", 8.0), ("i", 0.5)],
    &[("ws", 0.01), ("gamma", 8.0), ("zba", 0.4), ("i", 0.0)],
    &[("sigma1", 0.0), ("i", 2.0), ("M", 2.0), ("K", 900.0), ("B", 30.0)],
];

/// Every law, behind a block and on the device itself, in each of its ways, by name.
pub(crate) fn scenes() -> Vec<(String, Scene)> {
    let mut scenes = Vec::new();
    for law in LAWS {
        for (way, changes) in WAYS.iter().enumerate() {
            for (setting, block) in [("block", true), ("device", false)] {
                let mut scene = Scene::paper();
                if !block {
                    (scene.block, scene.coupling) = (None, None);
                }
                let mut scene = scene.with_law(law).expect("a law").expect("a scene");
                for change in *changes {
                    // A law without the parameter goes without it.
                    scene = changed(&scene, &[*change]);
                }
                scenes.push((format!("{law}, {setting}, {way}"), scene));
            }
        }
    }
    scenes
}
