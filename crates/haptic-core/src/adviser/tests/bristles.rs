//! The laws of bristles give out energy where the adviser says so: a bristle that was loaded slowly
//! and is torn away fast. Searched: a slow load, a burst at up to 100 m/s over part of the
//! deflection, and random motions.

use super::random;
use crate::adviser::{Check, advise};
use crate::{Direction, Parameter, Renderer, Scene, Scheme};
use proptest::prelude::*;
use std::vec::Vec;

/// `sigma0`, N/m.
const STIFFNESS: f64 = 1e5;

/// Energy, J, that friction has taken from a hand.
struct Meter {
    surface: Renderer,
    place: f64,
    speed: f64,
    force: f64,
    taken: f64,
    least: f64,
}

impl Meter {
    fn new(scene: &Scene) -> Self {
        let mut surface = Renderer::new(scene, Scheme::Exact, 1e-3).expect("a valid scene");
        surface.start_at(0.0, 0.0);
        Self {
            surface,
            place: 0.0,
            speed: 0.0,
            force: 0.0,
            taken: 0.0,
            least: 0.0,
        }
    }

    /// Comes to a speed, m/s, over next to no distance: so that what the trapezoid rule takes of a step
    /// of force is nothing.
    fn come_to(&mut self, speed: f64) {
        if self.speed * speed <= 0.0 && self.speed != 0.0 {
            self.go(1e-13 * self.speed.signum(), 0.0);
        }
        self.go(1e-13 * speed.signum(), speed);
    }

    /// Goes on to a speed, m/s, over a distance, m.
    fn go(&mut self, distance: f64, speed: f64) {
        let mean = 0.5 * (self.speed + speed);
        self.place += distance;
        let before = self.force;
        self.force = self
            .surface
            .tick((distance / mean).abs(), self.place, speed)
            .coupling_force;
        self.taken += 0.5 * (before + self.force) * distance;
        self.least = self.least.min(self.taken);
        self.speed = speed;
    }
}

fn scene(law: &str, [held, kinetic, sigma1, drag, velocity]: [f64; 5], direction: f64) -> Scene {
    let mut scene = Scene::paper();
    (scene.block, scene.coupling) = (None, None);
    let scene = scene.with_law(law).expect("a law").expect("a valid scene");
    let of = |direction: f64, values: [f64; 3]| {
        let parameters = [Parameter::StaticForce, Parameter::DynamicForce, Parameter::Viscous];
        let keys = parameters.map(|parameter| parameter.in_direction(Direction::of(direction)));
        keys.into_iter().zip(values)
    };
    let both_ways = [
        (Parameter::ContactStiffness.into(), STIFFNESS),
        (Parameter::ContactDamping.into(), sigma1),
        (Parameter::StribeckVelocity.into(), velocity),
    ];
    // The other way it is passive.
    let by_direction = of(direction, [held, kinetic, drag]).chain(of(-direction, [2.0, 2.0, 0.0]));
    let changes: Vec<_> = by_direction.chain(both_ways).collect();
    scene.with(&changes).expect("a valid scene")
}

/// The least that is taken by a load (N) at 1 um/s and a burst of such a speed (m/s) and distance (m).
fn torn(scene: &Scene, load: f64, burst: f64, distance: f64, direction: f64) -> f64 {
    let mut meter = Meter::new(scene);
    for _ in 0..500 {
        meter.go(direction * 4.0 * load / STIFFNESS / 500.0, direction * 1e-6);
    }
    meter.come_to(direction * burst);
    for _ in 0..500 {
        meter.go(direction * distance / 500.0, direction * burst);
    }
    meter.least
}

fn bound(scene: &Scene, direction: f64) -> f64 {
    let findings = advise(scene, Scheme::Exact, &super::RIG);
    let of_check = findings.iter().filter(|found| found.check == Check::FrictionPassivity);
    let found: Vec<_> = of_check.collect();
    assert_eq!(found.len(), 2, "one of each direction");
    found[usize::from(direction < 0.0)].bound
}

proptest! {
    #![proptest_config(ProptestConfig { cases: test_run::extent(10, 100), rng_seed: proptest::test_runner::RngSeed::Fixed(36), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_bristle_gives_out_energy_below_its_bound_alone(
        law in prop_oneof![Just("lugre"), Just("elasto-plastic")], kinetic in 0.5..3.0f64, ratio in 1.2..4.0f64,
        sigma1 in 20.0..400.0f64, velocity in 1e-3..0.05f64, direction in prop_oneof![Just(1.0), Just(-1.0)],
        seed in any::<u64>(),
    ) {
        let of_drag = |drag| scene(law, [ratio * kinetic, kinetic, sigma1, drag, velocity], direction);
        let bound = bound(&of_drag(0.0), direction);
        prop_assert!((bound - sigma1 * (ratio - 1.0)).abs() < 1e-9 * bound);
        let (distance, load) = (kinetic / STIFFNESS, ratio * kinetic);
        let least = |drag: f64| {
            let scene = of_drag(drag);
            let bursts = [0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0];
            let shares = [0.05, 0.1, 0.2, 0.5, 1.0];
            let by_share = |burst: f64| shares.map(|share| torn(&scene, load, burst, share * distance, direction));
            let torn = bursts.iter().flat_map(|burst| by_share(*burst));
            torn.fold(f64::INFINITY, f64::min)
        };
        let (inside, outside) = (least(bound * (1.0 + 1e-6)), least(0.8 * bound));
        prop_assert!(inside > -1e-9, "inside {inside} J");
        prop_assert!(outside < -1e-6, "outside {outside} J");
        let mut meter = Meter::new(&of_drag(bound));
        let mut shares = random(seed);
        for _ in 0..400 {
            let share = shares.next().expect("endless");
            // Fine enough for the trapezoid rule.
            let speed = share.signum() * 10_f64.powf(3.0 * shares.next().expect("endless") - 3.0);
            meter.come_to(speed);
            for _ in 0..50 {
                meter.go(share * distance / 50.0, speed);
            }
        }
        prop_assert!(meter.least > -1e-9, "at random {} J", meter.least);
    }
}
