//! Every friction law, behind a block and on the device itself: what its authors promise of it.

use crate::explore::{Meter, T, behind_block, changed, on_device, renderer};
use haptic_core::block::{BlockState, Contact};
use haptic_core::friction::{ElastoPlastic, Friction, Karnopp, LAWS, Lugre, Reseat, SalcudeanVlaar};
use haptic_core::{Directional, Renderer, Scene, Scheme};

const BRISTLE: f64 = 1e4;

fn both(value: f64) -> Directional {
    Directional::both(value)
}

fn karnopp() -> Karnopp {
    Karnopp {
        contact_stiffness: Some(BRISTLE),
        ..Karnopp::new(4.0, 3.0)
    }
}

fn lugre() -> Lugre {
    Lugre {
        static_force: both(4.0),
        dynamic_force: both(3.0),
        stribeck_velocity: 0.01,
        contact_stiffness: BRISTLE,
        contact_damping: 10.0,
        viscous: both(5.0),
    }
}

/// Every law with limits of 4 N and 3 N.
fn laws() -> [Friction; LAWS.len()] {
    LAWS.map(|law| {
        let mut scene = on_device(Friction::default_of(law).expect("a law of the list"));
        for change in [("Fs", 4.0), ("Fd", 3.0), ("Kp", BRISTLE), ("b", 5.0)] {
            // A law without the parameter goes without it.
            scene = changed(&scene, &[change]);
        }
        match scene.friction {
            Friction::SalcudeanVlaar(law) => Friction::SalcudeanVlaar(SalcudeanVlaar {
                velocity_threshold: 0.005,
                ..law
            }),
            other => other,
        }
    })
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few thousand")]
fn ticks_in(time_s: f64) -> u32 {
    (time_s / T).round() as u32
}

/// Moves the device by `distance` at a steady speed; the forces, N.
fn drag(surface: &mut Renderer, distance: f64, speed: f64) -> Vec<f64> {
    let from = surface.state().device_position;
    let ticks = ticks_in(distance.abs() / speed.abs());
    (1..=ticks)
        .map(|k| {
            let position = from + distance * f64::from(k) / f64::from(ticks);
            surface.tick(T, position, distance.signum() * speed).coupling_force
        })
        .collect()
}

#[test]
fn a_long_slide_on_the_device_has_its_laws_force_by_direction() {
    let stribeck = Karnopp {
        stribeck_velocity: 0.01,
        ..karnopp()
    };
    for friction in laws().into_iter().chain([Friction::Karnopp(stribeck)]) {
        let (law, mut scene) = (friction.law(), on_device(friction));
        for change in [("Fd-", 2.0), ("b-", 7.0)] {
            // A law without the parameter goes without it.
            scene = changed(&scene, &[change]);
        }
        let mut surface = renderer(&scene);
        for speed in [0.01, 0.02, 0.1] {
            for direction in [1.0, -1.0] {
                let force = *drag(&mut surface, direction * 0.05, speed).last().expect("ticks");
                let expected = scene.friction.steady_force(direction * speed);
                assert!((force - expected).abs() < 1e-6, "{law}: {force} N for {expected} N");
            }
        }
        let mut surface = renderer(&changed(&scene, &[("Fd", 0.5)]));
        drag(&mut surface, 0.02, 0.2);
        let state = surface.state();
        assert!(matches!(state.contact, Contact::Sliding(_)), "{law}: {state:?}");
    }
}

#[test]
fn a_contact_lets_go_at_the_limit_of_its_direction() {
    for friction in laws() {
        let mut scene = on_device(friction);
        // A law without one of them goes without it, and some do not let `Fs` fall below `Fd`.
        for change in [("Fd", 2.0), ("Fs+", 4.0), ("Fs-", 2.0), ("Fd+", 4.0)] {
            scene = changed(&scene, &[change]);
        }
        let mut surface = renderer(&scene);
        let positive = drag(&mut surface, 0.01, 0.01).into_iter().fold(0.0, f64::max);
        let negative = -drag(&mut surface, -0.02, 0.01).into_iter().fold(0.0, f64::min);
        let is_held = (3.6..4.3).contains(&positive) && (1.8..2.3).contains(&negative);
        let law = friction.law();
        assert!(law == "viscous" || is_held, "{law}: {positive} N, {negative} N");
    }
}

#[test]
fn slides_reseat_creates_energy_and_continuous_does_not() {
    let created = |reseat| {
        let law = Karnopp {
            velocity_threshold: 0.005,
            reseat: Some(reseat),
            ..karnopp()
        };
        let mut surface = renderer(&on_device(Friction::Karnopp(law)));
        let mut energy = Meter::default();
        for k in 1..4000 {
            let phase = 0.01 * f64::from(k);
            surface.tick_with_events(T, 0.01 * phase.sin(), 0.1 * phase.cos(), &mut energy);
        }
        energy.created
    };
    assert!(created(Reseat::Continuous) < 1e-12, "{} J", created(Reseat::Continuous));
    // (Fs^2 - Fd^2)/2 Kp = 0.35 mJ at each of a dozen re-sticks.
    assert!(created(Reseat::Slides) > 1e-3, "{} J", created(Reseat::Slides));
}

#[test]
fn a_law_that_gives_out_no_energy_is_seen_to_give_out_none() {
    let stribeck = Karnopp {
        stribeck_velocity: 0.02,
        contact_stiffness: None,
        ..karnopp()
    };
    let undamped = Lugre {
        static_force: both(3.0),
        contact_damping: 0.0,
        ..lugre()
    };
    let passive = laws().into_iter().filter_map(|friction| match friction {
        Friction::Karnopp(_) => Some(Friction::Karnopp(stribeck)),
        Friction::Lugre(_) => Some(Friction::Lugre(undamped)),
        Friction::ElastoPlastic(law) => Some(Friction::ElastoPlastic(ElastoPlastic {
            static_force: both(3.0),
            contact_damping: 0.0,
            ..law
        })),
        Friction::SalcudeanVlaar(_) => None,
        other => Some(other),
    });
    for friction in passive {
        for mass in [0.5, 0.01] {
            let mut block = renderer(&behind_block(friction, mass));
            let mut energy = Meter::default();
            for tick in 1..2000 {
                let phase = 0.4 * f64::from(tick);
                block.tick_with_events(T, 0.002 * phase.sin(), 0.8 * phase.cos(), &mut energy);
            }
            // It takes some 10 mJ a stroke.
            assert!(
                energy.created < 1e-12,
                "{}, {mass} kg: {} J",
                friction.law(),
                energy.created
            );
        }
    }
}

#[test]
fn a_hand_that_turns_within_a_sample_unloads_the_spring_in_it() {
    for friction in laws() {
        if !matches!(friction, Friction::Karnopp(_) | Friction::ResetIntegrator(_)) {
            continue;
        }
        let mut surface = renderer(&changed(&on_device(friction), &[("b", 0.0)]));
        let mut energy = Meter::default();
        drag(&mut surface, 0.01, 2.0);
        let turned = surface.tick_with_events(T, -0.02, -30.0, &mut energy).coupling_force;
        assert!((turned + 3.0).abs() < 1e-9, "{}: {turned} N", friction.law());
        assert!(energy.created < 1e-9, "{}: {} J", friction.law(), energy.created);
    }
}

#[test]
fn a_slide_on_a_curve_with_rising_stiction_ends_without_a_step() {
    let law = Karnopp {
        stribeck_velocity: 0.05,
        rising_rate: 5.0,
        ..karnopp()
    };
    let mut surface = renderer(&on_device(Friction::Karnopp(law)));
    let mut last = 0.0_f64;
    for k in 1..4000 {
        let phase = 0.0126 * f64::from(k);
        let force = surface
            .tick(T, -0.03 * phase.cos() + 0.03, 0.378 * phase.sin())
            .coupling_force;
        // Kp v T is what a stuck spring may gain in a tick.
        assert!(
            (force - last).abs() <= BRISTLE * 0.378 * T + 0.2,
            "from {last} N to {force} N at {k}"
        );
        last = force;
    }
}

#[test]
fn a_limit_of_nothing_is_the_limit_of_little() {
    for friction in laws() {
        let unload = |limit: f64| {
            let mut scene = changed(&on_device(friction), &[("b", 0.0)]);
            for name in ["Fd-", "Fs-"] {
                scene = changed(&scene, &[(name, limit)]);
            }
            let mut surface = renderer(&scene);
            drag(&mut surface, 0.004, 0.01);
            drag(&mut surface, -3e-4, 0.01)
        };
        for (none, little) in unload(0.0).into_iter().zip(unload(1e-9)) {
            assert!((none - little).abs() < 1e-3, "{}: {none} N, {little} N", friction.law());
        }
    }
}

/// The pull at which a block breaks loose after a rest, N, and for how long it has rested then, s.
fn breakaway_after(rest_s: f64, law: Karnopp) -> (f64, f64) {
    let mut block = renderer(&behind_block(Friction::Karnopp(law), 0.5));
    // A slide, so that the rest begins with its end.
    block.set_state(BlockState::new(0.0, 0.05, 0.0, 0.05));
    let mut position = 0.0;
    while block.state().contact != Contact::Stuck {
        block.tick(T, position, 0.0);
    }
    for _ in 0..ticks_in(rest_s) {
        block.tick(T, position, 0.0);
    }
    let (mut force, mut rested_s) = (0.0, rest_s);
    while block.state().contact == Contact::Stuck {
        position += 2e-6;
        rested_s += T;
        force = block.tick(T, position, 2e-3).coupling_force;
    }
    (force, rested_s)
}

#[test]
fn static_friction_rises_while_the_block_rests() {
    let law = Karnopp {
        rising_rate: 5.0,
        ..Karnopp::new(6.0, 3.0)
    };
    for rest_s in [0.0, 0.1, 0.3, 2.0] {
        let (force, rested_s) = breakaway_after(rest_s, law);
        let limit = 6.0 - 3.0 * (-5.0 * rested_s).exp();
        assert!(
            (force - limit).abs() < 0.1,
            "{force} N for {limit} N after {rested_s} s"
        );
    }
    let (at_once, _) = breakaway_after(0.0, Karnopp::new(6.0, 3.0));
    assert!((at_once - 6.0).abs() < 0.1, "{at_once}");
}

#[test]
fn stribeck_curve_softens_drop_and_keeps_breakaway() {
    let drop = |stribeck_velocity| {
        let law = Karnopp {
            stribeck_velocity,
            ..Karnopp::new(6.0, 3.0)
        };
        let mut block = renderer(&behind_block(Friction::Karnopp(law), 0.5));
        let (mut breakaway, mut position) = (0.0, 0.0);
        let mut lowest_after = f64::INFINITY;
        for _ in 0..400 {
            position += 1e-6;
            let force = block.tick(T, position, 1e-3).coupling_force;
            if block.state().contact != Contact::Stuck {
                lowest_after = lowest_after.min(force);
            } else if lowest_after.is_infinite() {
                breakaway = force;
            }
        }
        assert!((breakaway - 6.0).abs() < 0.05, "breakaway at {breakaway} N");
        6.0 - lowest_after
    };
    let (sudden, gentle) = (drop(0.0), drop(0.05));
    assert!(sudden > 4.0 && gentle < 0.5 * sudden, "{sudden} N, {gentle} N");
}

#[test]
fn every_change_of_law_takes_the_force_over() {
    let mut scenes: Vec<Scene> = Vec::new();
    for friction in laws() {
        scenes.push(on_device(friction));
        let mut behind = friction;
        if let Friction::Karnopp(law) = &mut behind {
            law.contact_stiffness = None;
        }
        scenes.push(behind_block(behind, 0.5));
    }
    for scheme in ["exact", "literal", "implicit"] {
        let scheme: Scheme = scheme.parse().expect("a scheme");
        for from in &scenes {
            for to in &scenes {
                // Held with 2 N, at rest: what any law with a limit of 3 N can take over.
                let mut old = Renderer::new(from, scheme, T).expect("a valid scene");
                let mut force = 0.0;
                let mut position = 0.0;
                while force < 2.0 && position < 1e-3 {
                    position += 1e-6;
                    force = old.tick(T, position, 0.0).coupling_force;
                }
                let force = old.tick(T, position, 0.0).coupling_force;
                let mut new = Renderer::new(to, scheme, T).expect("a valid scene");
                let step = new.take_over(&old);
                let after = new.tick(0.0, position, 0.0).coupling_force;
                assert!(
                    (force - after - step).abs() < 1e-9,
                    "{scheme}: {} to {}: {force} N, then {after} N and {step} N of bump",
                    from.friction.law(),
                    to.friction.law()
                );
                let holds = !matches!(to.friction, Friction::Viscous(_)) || to.block.is_some();
                assert!(!holds || step.abs() < 1e-9, "{scheme}: {from:?} to {to:?}: {step} N");
            }
        }
    }
}
