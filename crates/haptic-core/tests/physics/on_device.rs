//! Laws on the device itself: the force is that of the law along the hand's motion.
//!
//! A hand here has constant acceleration between two samples, so that positions and velocities of
//! any finer samples are known, turns included.

use crate::explore::{Meter, changed, on_device, renderer};
use crate::random::Random;
use crate::random_laws;
use haptic_core::friction::{Friction, LAWS, SalcudeanVlaar};
use haptic_core::{Direction, Directional, Parameter, Renderer, Scene};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// Error of a force that may be, N.
const TOLERANCE: f64 = 1e-10;

/// One tick: time, and the velocities at both ends.
#[derive(Clone, Copy, Debug)]
struct Tick {
    elapsed_s: f64,
    from: f64,
    to: f64,
}

impl Tick {
    /// Velocity and displacement after a share of it.
    fn at(&self, share: f64) -> (f64, f64) {
        let gained = (self.to - self.from) * share;
        (self.from + gained, (self.from + 0.5 * gained) * share * self.elapsed_s)
    }
}

/// A law on the device itself with random parameters.
fn friction(law: &str, random: &mut Random) -> Friction {
    let device = Scene {
        block: None,
        coupling: None,
        ..Scene::paper()
    };
    random_laws::friction(law, &device, random)
}

/// A hand that swings, slowly and fast, with turns anywhere between samples.
fn hand(random: &mut Random) -> Vec<Tick> {
    let speed = random.decades(2e-3, 1.0);
    let (slow, fast) = (random.between(0.3, 5.0), random.between(5.0, 60.0));
    let share = random.share();
    let (mut t, mut last) = (0.0, 0.0);
    (0..60)
        .map(|_| {
            let elapsed_s = random.between(7e-4, 1.3e-3);
            t += elapsed_s;
            let velocity = speed * (share * (TAU * slow * t).sin() + (1.0 - share) * (TAU * fast * t).sin());
            let tick = Tick {
                elapsed_s,
                from: last,
                to: velocity,
            };
            last = velocity;
            tick
        })
        .collect()
}

/// A surface that begins with some force in its contact.
fn begun(scene: &Scene, random: &mut Random) -> Renderer {
    let mut held = renderer(&on_device(Friction::SalcudeanVlaar(SalcudeanVlaar {
        static_force: Directional::both(20.0),
        contact_stiffness: 1e5,
        viscous: Directional::both(0.0),
        velocity_threshold: 0.0,
    })));
    held.tick(1e-3, random.between(-8e-5, 8e-5), 0.0);
    let mut surface = renderer(scene);
    surface.take_over(&held);
    surface
}

/// A velocity that does not agree with the positions says nothing of where the hand turned.
#[test]
fn an_estimated_velocity_takes_no_turn() {
    let mut random = Random(977_846_395_462_115_233);
    for law in ["dahl", "hayward-armstrong", "elasto-plastic"] {
        let omega = TAU * 60.0;
        let scene = on_device(friction(law, &mut random));
        let scene = changed(&changed(&scene, &[("b", 0.0)]), &[("sigma1", 0.0)]);
        let (mut estimated, mut without) = (renderer(&scene), renderer(&scene));
        for tick in 0..500 {
            let t = 1.3e-4 + f64::from(tick) * 1e-3;
            let position = 4e-3 * (1.0 - (omega * t).cos());
            let velocity = 4e-3 * omega * (omega * t).sin();
            let force = estimated.tick(1e-3, position, 1.001 * velocity).coupling_force;
            let expected = without.tick(1e-3, position, 0.0).coupling_force;
            assert!(
                (force - expected).abs() < 1e-10,
                "{law}: {force} N, without a velocity {expected} N"
            );
        }
    }
}

/// Where little is left of the limit at speed, the force is a number all the same.
#[test]
fn a_limit_that_falls_to_nothing_gives_numbers() {
    let mut random = Random(271_828_182_845_904_523);
    for law in ["lugre", "elasto-plastic"] {
        for _ in 0..test_run::extent(300, 3000) {
            let scene = on_device(friction(law, &mut random));
            let ws = random.decades(1e-3, 0.1);
            let held = random.decades(1e-3, 10.0);
            let scene = changed(&scene, &[("Fs", held), ("Fd", held / 99.0), ("ws", ws)]);
            let mut surface = renderer(&scene);
            for tick in hand(&mut random) {
                let at = surface.state().device_position + tick.at(1.0).1;
                let force = surface.tick(tick.elapsed_s, at, tick.to).coupling_force;
                assert!(force.is_finite(), "{scene:?}: {force}");
            }
        }
    }
}

/// Velocities are estimates: without a change of position none of them moves a contact.
#[test]
fn hand_at_rest_moves_no_contact_at_any_velocity_estimate() {
    let mut random = Random(123_456_789_987_654_321);
    for law in LAWS {
        let scene = on_device(friction(law, &mut random));
        let mut surface = begun(&scene, &mut random);
        for tick in hand(&mut random) {
            let at = surface.state().device_position + tick.at(1.0).1;
            surface.tick(tick.elapsed_s, at, tick.to);
        }
        // Comes to rest; a slide that is slower than its threshold ends.
        let at = surface.state().device_position;
        surface.tick(1e-3, at, 0.0);
        surface.tick(1e-3, at, 0.0);
        let held = surface.tick(1e-3, at, 0.0).coupling_force;
        for _ in 0..1000 {
            surface.tick(1e-3, at, random.between(-0.05, 0.05));
        }
        let after = surface.tick(1e-3, at, 0.0).coupling_force;
        assert!((after - held).abs() <= 1e-12, "{law}: {held} N, then {after} N");
    }
}

/// A value of a scene in a direction; 0 where it has none.
fn value(scene: &Scene, parameter: Parameter, direction: f64) -> f64 {
    scene
        .value(parameter)
        .map_or(0.0, |value| value.get(Direction::of(direction)))
}

/// `dF/dx` over `sigma` of a law as its authors write it, along the direction, at a force, N, and a speed, m/s.
fn elastic_share(scene: &Scene, direction: f64, force: f64, speed: f64) -> f64 {
    let of = |parameter| value(scene, parameter, direction);
    let (kinetic, fraction) = (of(Parameter::DynamicForce), of(Parameter::ElasticFraction));
    let level = || {
        let fallen = (-(speed / of(Parameter::StribeckVelocity)).powi(2)).exp();
        kinetic + (of(Parameter::StaticForce) - kinetic) * fallen
    };
    match scene.friction.law() {
        "dahl" => (1.0 - force / kinetic).max(0.0).powf(of(Parameter::Exponent)),
        "hayward-armstrong" => {
            let (u, onset) = (force / kinetic, fraction.powi(8));
            1.0 - (1.0 + onset) * u.powi(9) / (onset + u.powi(8))
        }
        "lugre" => 1.0 - force / level(),
        "elasto-plastic" => {
            let u = force / level();
            let share = ((u - fraction) / (1.0 - fraction)).clamp(0.0, 1.0);
            1.0 - (0.5 + 0.5 * (PI * (share - 0.5)).sin()) * u
        }
        other => panic!("no equation of {other}"),
    }
}

/// `sigma1` and `b` of a scene in a direction.
fn dampings(scene: &Scene, direction: f64) -> (f64, f64) {
    let of = |parameter| value(scene, parameter, direction);
    (of(Parameter::ContactDamping), of(Parameter::Viscous))
}

/// The bristle's force, N, and the energies, J, that friction took: all of it, and what is left
/// without damping. By the classical Runge-Kutta method in steps so small that a kink of a law
/// hardly counts.
#[derive(Clone, Copy, Debug, Default)]
struct Fine {
    force: f64,
    work: f64,
    plastic_work: f64,
}

impl Fine {
    fn follow(&mut self, scene: &Scene, tick: &Tick) {
        let turn = if tick.from * tick.to < 0.0 {
            tick.from / (tick.from - tick.to)
        } else {
            1.0
        };
        self.follow_leg(scene, tick, 0.0, turn);
        if turn < 1.0 {
            self.follow_leg(scene, tick, turn, 1.0);
        }
    }

    fn follow_leg(&mut self, scene: &Scene, tick: &Tick, begin: f64, end: f64) {
        let middle = tick.at(0.5 * (begin + end)).0;
        let direction = middle.signum();
        let stiffness = value(scene, Parameter::ContactStiffness, direction);
        let (contact, drag) = dampings(scene, direction);
        let rate = |share: f64, along: f64| {
            let speed = direction * tick.at(share).0;
            let elastic = elastic_share(scene, direction, along, speed);
            let metres = speed * tick.elapsed_s;
            let plastic = along * (1.0 - elastic);
            [
                stiffness * elastic * metres,
                (plastic + (contact * elastic + drag) * speed) * metres,
                plastic * metres,
            ]
        };
        let distance = (tick.at(end).1 - tick.at(begin).1).abs();
        let steps = (stiffness * distance / 2e-4 / 0.5).clamp(400.0, 20_000.0).ceil();
        let h = (end - begin) / steps;
        let mut along = direction * self.force;
        let mut k = 0.0;
        while k < steps {
            let at = begin + k * h;
            let first = rate(at, along);
            let second = rate(at + 0.5 * h, along + 0.5 * h * first[0]);
            let third = rate(at + 0.5 * h, along + 0.5 * h * second[0]);
            let fourth = rate(at + h, along + h * third[0]);
            let mean = |i: usize| h / 6.0 * (first[i] + 2.0 * second[i] + 2.0 * third[i] + fourth[i]);
            along += mean(0);
            self.work += mean(1);
            self.plastic_work += mean(2);
            k += 1.0;
        }
        self.force = direction * along;
    }

    /// The force with damping, N.
    fn felt(&self, scene: &Scene, velocity: f64) -> f64 {
        let direction = if velocity < 0.0 { -1.0 } else { 1.0 };
        let elastic = elastic_share(scene, direction, direction * self.force, velocity.abs());
        let (contact, drag) = dampings(scene, direction);
        self.force + (contact * elastic + drag) * velocity
    }
}

/// Whether a bristle's force falls with its speed: its damping then takes part in its energy, and may give some back.
fn falls(scene: &Scene) -> bool {
    let held = scene.value(Parameter::StaticForce);
    held.is_some() && held != scene.value(Parameter::DynamicForce)
}

#[test]
fn the_force_and_the_energy_are_those_of_a_fine_integration() {
    let mut random = Random(362_436_069_521_288_629);
    let mut worst: BTreeMap<&str, (f64, f64, f64)> = BTreeMap::new();
    for law in ["dahl", "hayward-armstrong", "lugre", "elasto-plastic"] {
        for _ in 0..test_run::extent(4, 40) {
            let scene = on_device(friction(law, &mut random));
            if scene
                .value(Parameter::Exponent)
                .is_some_and(|exponent| exponent.positive < 1.0)
            {
                // It comes to its limit at a slope that is no number.
                continue;
            }
            let mut surface = renderer(&scene);
            let (mut fine, mut meter) = (Fine::default(), Meter::default());
            let (mut at, mut error): (f64, f64) = (0.0, 0.0);
            let stiffness = value(&scene, Parameter::ContactStiffness, 1.0);
            for tick in hand(&mut random) {
                at += tick.at(1.0).1;
                let force = surface
                    .tick_with_events(tick.elapsed_s, at, tick.to, &mut meter)
                    .coupling_force;
                fine.follow(&scene, &tick);
                error = error.max((force - fine.felt(&scene, tick.to)).abs());
            }
            let falls = falls(&scene);
            let work = if falls { fine.work } else { fine.plastic_work };
            let energy = (meter.taken - work).abs() / (work + 0.5 / stiffness);
            let worst = worst.entry(law).or_default();
            *worst = (
                worst.0.max(error),
                worst.1.max(energy),
                worst.2.max(if falls { 0.0 } else { meter.created }),
            );
        }
    }
    for (law, (error, energy, created)) in &worst {
        println!("{law:26} {error:8.1e} N, energy off by {energy:8.1e} of it, {created:8.1e} J created");
    }
    for (law, (error, energy, created)) in worst {
        assert!(error <= TOLERANCE, "{law}: {error:e} N");
        assert!(energy <= 1e-6, "{law}: {energy:e} of its energy");
        assert!(created <= 1e-15, "{law} created {created:e} J");
    }
}
