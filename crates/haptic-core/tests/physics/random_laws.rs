//! Laws on the device itself, with random parameters.

use crate::random::Random;
use haptic_core::Directional;
use haptic_core::friction::{
    Dahl, ElastoPlastic, Friction, HaywardArmstrong, Karnopp, Lugre, Reseat, ResetIntegrator, SalcudeanVlaar,
};

/// Names for [`friction`].
pub(crate) const LAWS: [&str; 10] = [
    "karnopp",
    "dahl",
    "hayward-armstrong",
    "reset-integrator",
    "lugre",
    "lugre, Stribeck",
    "elasto-plastic",
    "elasto-plastic, Stribeck",
    "salcudean-vlaar",
    "karnopp, rising Fs",
];

/// A law with random parameters.
pub(crate) fn friction(law: &str, random: &mut Random) -> Friction {
    let dynamic_force = random.directional(0.5, 6.0);
    let more = random.directional(0.1, 3.0);
    let above = Directional {
        positive: dynamic_force.positive + more.positive,
        negative: dynamic_force.negative + more.negative,
    };
    let contact_stiffness = random.decades(1e3, 3e5);
    let falls = law.ends_with("Stribeck");
    let static_force = if falls { above } else { dynamic_force };
    let stribeck_velocity = random.decades(1e-3, 0.1);
    let viscous = random.directional(0.0, 5.0);
    let contact_damping = random.between(0.0, 20.0);
    let elastic_fraction = random.between(0.05, 0.95);
    let velocity_threshold = if random.one_in(2) {
        0.0
    } else {
        random.decades(1e-3, 0.1)
    };
    // Half of them at the closed forms of their own.
    let exponent = if random.one_in(2) {
        random.between(0.0, 4.0)
    } else {
        (random.between(-0.5, 4.5).round() / 2.0).abs()
    };
    let rises = law.ends_with("rising Fs");
    match law.split(',').next().expect("a name") {
        "karnopp" => Friction::Karnopp(Karnopp {
            viscous,
            velocity_threshold,
            stribeck_velocity: if random.one_in(2) { 0.0 } else { stribeck_velocity },
            rising_rate: if rises { random.decades(1.0, 1e3) } else { 0.0 },
            contact_stiffness: Some(contact_stiffness),
            ..Karnopp::new(above, dynamic_force)
        }),
        "dahl" => Friction::Dahl(Dahl {
            dynamic_force,
            contact_stiffness,
            exponent,
            viscous,
        }),
        "hayward-armstrong" => Friction::HaywardArmstrong(HaywardArmstrong {
            dynamic_force,
            contact_stiffness,
            elastic_fraction,
            viscous,
        }),
        "reset-integrator" => Friction::ResetIntegrator(ResetIntegrator {
            static_force: above,
            dynamic_force,
            contact_stiffness,
            contact_damping,
            viscous,
            reseat: Reseat::Continuous,
        }),
        "lugre" => Friction::Lugre(Lugre {
            static_force,
            dynamic_force,
            stribeck_velocity,
            contact_stiffness,
            contact_damping,
            viscous,
        }),
        "elasto-plastic" => Friction::ElastoPlastic(ElastoPlastic {
            static_force,
            dynamic_force,
            stribeck_velocity,
            contact_stiffness,
            contact_damping,
            elastic_fraction,
            viscous,
        }),
        "salcudean-vlaar" => Friction::SalcudeanVlaar(SalcudeanVlaar {
            static_force: above,
            contact_stiffness,
            viscous,
            velocity_threshold,
        }),
        unknown => panic!("{unknown}"),
    }
}
