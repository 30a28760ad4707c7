//! Laws with random parameters: every law of the list, in the ways that its parameters open.

use crate::random::Random;
use haptic_core::friction::Friction;
use haptic_core::{Direction, Directional, Parameter, Scene};

/// A limit, mostly the same either way, now and then none one way.
fn limit(random: &mut Random) -> Directional {
    let positive = random.decades(0.3, 10.0);
    let negative = match random.share() {
        x if x < 0.6 => positive,
        x if x < 0.95 => random.decades(0.3, 10.0),
        _ => 0.0,
    };
    Directional { positive, negative }
}

/// A law of a scene with random parameters.
pub(crate) fn friction(law: &str, scene: &Scene, random: &mut Random) -> Friction {
    let scene = scene.with_law(law).expect("a law").expect("a scene");
    let dynamic_force = limit(random);
    // A third of them without a fall of the force.
    let above = random.between(1.0, 2.0);
    let above = random.one_of(&[1.0, above, above]);
    let viscous = random.one_of(&[0.0, 2.0, 20.0]);
    let mut changes = Vec::new();
    for coordinate in scene.friction.vector(scene.block.is_none()) {
        let dynamic_force = dynamic_force.get(coordinate.key.direction.unwrap_or(Direction::Positive));
        let value = match coordinate.key.parameter {
            Parameter::DynamicForce => dynamic_force,
            Parameter::StaticForce => above * dynamic_force,
            Parameter::Viscous => viscous,
            Parameter::StribeckVelocity if law == "karnopp" && random.one_in(2) => 0.0,
            Parameter::StribeckVelocity => random.decades(2e-3, 0.1),
            Parameter::VelocityThreshold => random.one_of(&[0.0, 0.0, 1e-3, 0.02]),
            Parameter::RisingRate if random.one_in(2) => 0.0,
            Parameter::RisingRate => random.decades(1.0, 1e3),
            Parameter::ContactStiffness => random.decades(1e3, 2e5),
            Parameter::ContactDamping if scene.block.is_none() => random.between(0.0, 20.0),
            Parameter::ContactDamping => random.one_of(&[0.0, 10.0, 100.0]),
            Parameter::ElasticFraction => random.between(0.05, 0.95),
            // Half of them at the closed forms of their own.
            Parameter::Exponent if random.one_in(2) => random.one_of(&[0.0, 0.5, 1.0, 1.5, 2.0]),
            Parameter::Exponent => random.between(0.0, 4.0),
            other => random.between(other.info().slider_min, other.info().slider_max),
        };
        changes.push((coordinate.key, value));
    }
    let changed = scene.with(&changes);
    changed
        .unwrap_or_else(|error| panic!("{law}, {changes:?}: {error}"))
        .friction
}
