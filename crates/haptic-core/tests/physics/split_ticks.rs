//! A tick cut into ten changes nothing: where a tick is solved and not stepped through, neither its
//! force nor the energy that friction took depends on where samples lie between its ends. No reference is asked, so
//! that every law is tried with any parameters, any hand and any state.
//!
//! The device goes on straight lines of position and velocity within the tick, as the tick itself
//! takes `K p + B v`.

use crate::explore::{Meter, T};
use crate::random::Random;
use crate::random_laws::friction;
use haptic_core::block::{BlockState, Contact};
use haptic_core::friction::{Friction, Karnopp, LAWS};
use haptic_core::scene::{Block, Coupling};
use haptic_core::{Renderer, Scene, Scheme};

/// Difference of forces, N, beyond which a tick is wrong.
const TOLERANCE_N: f64 = 1e-9;
/// The same of the energy that friction took, J.
const TOLERANCE_J: f64 = 1e-11;
const PARTS: u32 = 10;

/// A device's motion, and the tick that it does: position (m) and velocity (m/s) at its ends.
type Ends = [(f64, f64); 2];

/// The end of a tick.
struct After {
    force_n: f64,
    taken_j: f64,
    exhausted: bool,
}

/// Does a tick in so many parts.
fn tick_in(parts: u32, block: &mut Renderer, elapsed_s: f64, [from, to]: Ends) -> After {
    let (mut force_n, mut exhausted, mut taken) = (0.0, false, Meter::default());
    for part in 1..=parts {
        let share = f64::from(part) / f64::from(parts);
        let at_share = |from: f64, to: f64| if part == parts { to } else { from + share * (to - from) };
        let rendered = block.tick_with_events(
            elapsed_s / f64::from(parts),
            at_share(from.0, to.0),
            at_share(from.1, to.1),
            &mut taken,
        );
        force_n = rendered.coupling_force;
        exhausted |= rendered.work_exhausted;
    }
    After {
        force_n,
        taken_j: taken.taken,
        exhausted,
    }
}

/// A push, N, less than a series leaves out.
const PUSH_N: f64 = 1e-11;
/// A tick may be wrong by as much as so many pushes make of it.
const PUSHES: f64 = 10.0;

/// How much a tick's force, N, changes with a push that grows to [`PUSH_N`]: where a slide all but
/// stops on a falling curve, by hundreds of it.
fn sensitivity(block: &Renderer, elapsed_s: f64, [from, to]: Ends, scene: &Scene) -> f64 {
    let stiffness = scene.coupling.expect("a coupling").stiffness;
    let pushed = |push: f64| {
        let to = (to.0 + push / stiffness, to.1);
        tick_in(1, &mut block.clone(), elapsed_s, [from, to]).force_n
    };
    (pushed(PUSH_N) - pushed(-PUSH_N)).abs() - 2.0 * PUSH_N
}

/// What splitting ticks showed.
#[derive(Debug, Default)]
struct Found {
    worst_n: f64,
    worst_j: f64,
    wrong: u32,
    /// Ticks that a push of [`PUSH_N`] decides.
    sensitive: u32,
    /// Ticks at their bound of work.
    exhausted: u32,
    ticks: u32,
    where_worst: String,
}

impl Found {
    /// Does a tick whole and in parts, and goes on with the whole one.
    fn tick(&mut self, block: &mut Renderer, elapsed_s: f64, ends: Ends, scene: &Scene) {
        let (began, mut split) = (block.clone(), block.clone());
        let whole = tick_in(1, block, elapsed_s, ends);
        let split = tick_in(PARTS, &mut split, elapsed_s, ends);
        let error = (whole.force_n - split.force_n).abs();
        self.ticks += 1;
        if whole.exhausted || split.exhausted {
            self.exhausted += u32::from(whole.exhausted);
            return;
        }
        self.worst_j = self.worst_j.max((whole.taken_j - split.taken_j).abs());
        if error > TOLERANCE_N {
            if error < PUSHES * sensitivity(&began, elapsed_s, ends, scene) {
                self.sensitive += 1;
                return;
            }
            self.wrong += 1;
        }
        if error > self.worst_n {
            self.worst_n = error;
            self.where_worst = format!(
                "{ends:?} in {elapsed_s} s from {began:?}: {} N, {} N in parts",
                whole.force_n, split.force_n
            );
        }
    }
}

/// Splits the ticks of random scenes under random hands.
fn explore(name: &str) -> Found {
    let mut random = Random(88_172_645_463_325_252);
    let mut found = Found::default();
    for _ in 0..test_run::extent(600, 15_000) {
        let scene = Scene {
            friction: friction(name, &Scene::paper(), &mut random),
            block: Some(Block {
                mass: random.decades(1e-3, 1.0),
            }),
            coupling: Some(Coupling {
                stiffness: random.decades(300.0, 1e5),
                damping: random.one_of(&[0.5, 3.0, 10.0, 30.0]),
            }),
            ..Scene::paper()
        };
        let mut block = Renderer::new(&scene, Scheme::Exact, T).expect("a valid scene");
        let frequency = random.one_of(&[2.0, 15.0, 60.0, 437.0]);
        let omega = std::f64::consts::TAU * frequency;
        let amplitude = random.decades(1e-4, 0.2) / frequency;
        let phase = random.between(0.0, 6.0);
        let hand = |t: f64| {
            (
                amplitude * (omega * t + phase).sin(),
                amplitude * omega * (omega * t + phase).cos(),
            )
        };
        let (position, velocity) = hand(0.0);
        let own = random.one_of(&[0.0, 0.0, 1.0]) * random.between(-0.5, 0.5);
        let offset = if own == 0.0 { 0.0 } else { random.between(-3e-4, 3e-4) };
        block.set_state(BlockState::new(position + offset, own, position, velocity));
        let mut t = 0.0;
        let mut from = (position, velocity);
        for _ in 0..40 {
            let elapsed_s = T * random.between(0.7, 1.3);
            t += elapsed_s;
            let to = hand(t);
            found.tick(&mut block, elapsed_s, [from, to], &scene);
            from = to;
        }
    }
    found
}

#[test]
fn tick_cut_into_ten_gives_same_force_and_energy() {
    let mut wrong = Vec::new();
    for name in LAWS {
        let found = explore(name);
        println!("{name}: {found:?}");
        let most = 1 + found.ticks / 100_000;
        // A slide that all but stops is as rare as a tick at its bound of work.
        assert!(found.sensitive <= most && found.exhausted <= most, "{name}: {found:?}");
        if found.wrong > 0 || found.worst_j > TOLERANCE_J {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn brief_stop_within_a_tick_on_stribeck_curve_is_found() {
    let friction = Friction::Karnopp(Karnopp {
        stribeck_velocity: 0.01,
        ..Karnopp::new(5.0, 3.0)
    });
    let scene = crate::explore::behind_block(friction, 0.02);
    let mut block = crate::explore::renderer(&scene);
    block.set_state(BlockState::new(0.000_287, 0.108, 0.0, 0.26));
    let mut times = Vec::new();
    let mut hear = |at: f64, _: Contact, _: Contact| times.push(at);
    let rendered = block.tick_with_events(T, 0.000_67, 0.33, &mut hear);
    // Found by an independent integration in long double.
    let truth = 11.042_603_322_216;
    assert!(
        (rendered.coupling_force - truth).abs() < TOLERANCE_N,
        "{} N for {truth} N",
        rendered.coupling_force
    );
    assert!(
        times.len() == 2 && (times[0] - 0.497e-3).abs() < 1e-6 && (times[1] - 0.576e-3).abs() < 1e-6,
        "a stop and a breakaway: {times:?}"
    );
}
