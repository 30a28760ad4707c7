//! Invariants of every law, for all parameters and all hands.

use crate::explore::T;
use crate::metamorphic::cases;
use crate::random::Random;
use haptic_core::block::{BlockState, Contact};
use haptic_core::friction::{Friction, LAWS, Reseat};
use haptic_core::{Direction, Parameter, Renderer, Scene, Scheme};
use proptest::prelude::*;

fn decades(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low..high).prop_map(|exponent: f64| 10_f64.powf(exponent))
}

/// A scene of any law whose values are anywhere in their ranges; `None` where no loop at this rate can have it.
fn any_scene() -> impl Strategy<Value = Option<Scene>> {
    let share = prop::option::weighted(0.3, prop_oneof![Just(0.0), 0.0..1.0f64]);
    let drawn = (
        0..LAWS.len(),
        prop::bool::weighted(0.7),
        any::<bool>(),
        share,
        1..u64::MAX,
    );
    drawn.prop_map(|(law, has_block, slides, share, seed)| {
        let mut scene = cases::scene(LAWS[law], has_block, &mut Random(seed));
        // Kinetic friction of any share of the static one, none included.
        if let (Some(share), Some(force)) = (share, scene.value(Parameter::StaticForce)) {
            let kinetic = Direction::BOTH.map(|direction| {
                let key = Parameter::DynamicForce.in_direction(direction);
                (key, share * force.get(direction))
            });
            scene = scene.with(&kinetic).unwrap_or(scene);
        }
        match &mut scene.friction {
            Friction::Karnopp(law) if slides && !has_block => law.reseat = Some(Reseat::Slides),
            Friction::ResetIntegrator(law) if slides => law.reseat = Reseat::Slides,
            _ => {}
        }
        (scene.validate().is_ok() && scene.validate_rate(T).is_ok()).then_some(scene)
    })
}

/// Whether a law is one that gives out no energy of its own.
fn is_passive(friction: &Friction) -> bool {
    match friction {
        Friction::ResetIntegrator(law) => law.reseat == Reseat::Continuous,
        // A threshold ends a slide with the drag of the moment in the spring, which it did not
        // store.
        Friction::SalcudeanVlaar(law) => law.velocity_threshold == 0.0,
        Friction::Lugre(law) => law.contact_damping == 0.0 && law.static_force == law.dynamic_force,
        Friction::ElastoPlastic(law) => law.contact_damping == 0.0 && law.static_force == law.dynamic_force,
        _ => true,
    }
}

/// Events of a tick: the most work of a bristle's tick, which is 16 and 128 and 8 for each half-turn
/// of 400 rad, and those of its last piece and of the implicit steps that end it.
const MAX_EVENTS: u32 = 16 + 128 + 8 * 128 + 32;

proptest! {
    #![proptest_config(ProptestConfig { cases: test_run::extent(80, 600), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_law_ever_blows_up(
        scene in any_scene(),
        scheme in prop_oneof![3 => Just(Scheme::Exact), 1 => Just(Scheme::Implicit), 1 => Just(Scheme::LITERAL)],
        steps in prop::collection::vec((0.0..1.0f64, -1.0..1.0f64, 0..60u8), 20..120),
        origin in prop_oneof![3 => Just(0.0), 1 => -10.0..10.0f64, 1 => Just(1e9)],
    ) {
        let Some(scene) = scene else { return Ok(()) };
        let mut surface = Renderer::new(&scene, scheme, T).expect("a valid scene");
        surface.start_at(origin, 0.0);
        let (mut position, mut velocity) = (origin, 0.0);
        for (jitter, push, event) in steps {
            // Missed ticks, and now and then a whole second of them.
            let elapsed = match event {
                0 => 0.04,
                3 => 1.0,
                _ => T * (0.7 + 0.6 * jitter),
            };
            velocity = 0.9 * velocity + 0.1 * push;
            position += velocity * elapsed + if event == 1 { 0.05 * push } else { 0.0 };
            if event == 2 {
                // The smallest numbers there are.
                velocity = f64::MIN_POSITIVE / 16.0;
            }
            let rendered = surface.tick(elapsed, position, velocity);
            if scheme == Scheme::LITERAL {
                // It does blow up, to forces that are no numbers for a tick. That must be all that
                // happens.
                continue;
            }
            let after = surface.state();
            prop_assert!(rendered.coupling_force.is_finite(), "{scene:?}: {rendered:?}");
            prop_assert!(after.position.is_finite() && after.velocity.is_finite(), "{scene:?}: {after:?}");
            prop_assert!(rendered.events <= MAX_EVENTS, "{scene:?}: {rendered:?}");
            if let (Friction::Karnopp(law), Some(_)) = (&scene.friction, scene.block) {
                let goes_as_stated = match after.contact {
                    Contact::Stuck => after.velocity == 0.0,
                    Contact::Sliding(direction) => direction.sign() * after.velocity >= 0.0,
                };
                prop_assert!(goes_as_stated, "{scene:?}: {after:?}");
                // 16, and two for each half-turn.
                prop_assert!(law.stribeck_velocity > 0.0 || rendered.events <= 271, "{scene:?}: {rendered:?}");
            }
        }
    }
}

proptest! {
    // Few of these scenes are passive, and none takes long.
    #![proptest_config(ProptestConfig { cases: test_run::extent(800, 10_000), failure_persistence: None, ..ProptestConfig::default() })]

    /// A block let go at a device that stands still: a contact that began without energy gives none
    /// out, so the block and its coupling never have more than they began with. Nor do the implicit
    /// steps add any, which are also what ends a tick whose work is used up.
    #[test]
    fn a_passive_law_creates_no_energy(
        scene in any_scene(),
        scheme in prop_oneof![2 => Just(Scheme::Exact), 1 => Just(Scheme::Implicit)],
        speed in decades(-4.0, 0.0),
    ) {
        let Some(scene) = scene else { return Ok(()) };
        let (Some(block), Some(coupling)) = (scene.block, scene.coupling) else { return Ok(()) };
        if !is_passive(&scene.friction) { return Ok(()) }
        let mut surface = Renderer::new(&scene, scheme, T).expect("a valid scene");
        surface.set_state(BlockState::new(0.0, speed, 0.0, 0.0));
        // A slide begins with its spring deflected by the kinetic force, which it gives back in the
        // end.
        let held = match &scene.friction {
            Friction::ResetIntegrator(law) => law.dynamic_force.greatest().powi(2) / (2.0 * law.contact_stiffness),
            _ => 0.0,
        };
        let begun = 0.5 * block.mass * speed * speed + held;
        for tick in 0..200 {
            let rendered = surface.tick(T, 0.0, 0.0);
            let now = surface.state();
            let energy = 0.5 * (block.mass * now.velocity * now.velocity + coupling.stiffness * now.position * now.position);
            prop_assert!(energy <= begun * (1.0 + 1e-5), "{energy} J of {begun} J at tick {tick}, {rendered:?}: \
                                                          {scheme:?} {scene:?}");
        }
    }
}
