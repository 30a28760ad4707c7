//! The experiments of the study.

use super::{Experiment, Movement, Sensors, Truth};
use crate::identify::ModelKind;
use haptic_core::Directional;
use haptic_core::friction::{Dahl, ElastoPlastic, Friction, Karnopp, Lugre};

/// An experiment, and the model that is asked of it.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name, for people and tables.
    pub name: &'static str,
    /// The experiment.
    pub experiment: Experiment,
    /// The model.
    pub model: ModelKind,
    /// Whether the record is one that cannot, or hardly, determine all of the model.
    pub is_hard: bool,
}

/// Dahl's friction of 4 N that gives way by 0.1 mm.
pub const DAHL: Dahl = Dahl {
    dynamic_force: Directional::both(4.0),
    contact_stiffness: 4e4,
    exponent: 1.0,
    viscous: Directional::both(5.0),
};

/// LuGre friction that falls from 4.5 to 3.5 N and gives way by 0.1 mm.
pub const LUGRE: Lugre = Lugre {
    static_force: Directional::both(4.5),
    dynamic_force: Directional::both(3.5),
    stribeck_velocity: 0.005,
    contact_stiffness: 4e4,
    contact_damping: 60.0,
    viscous: Directional::both(5.0),
};

/// Half a kilogram on a surface, and a sensor that is 0.2 N off.
#[must_use]
pub fn half_a_kilogram(friction: Friction) -> Truth {
    Truth {
        mass_kg: 0.5,
        friction,
        offset_n: 0.2,
    }
}

/// Vibration within presliding, which shows a bristle's damping.
const VIBRATION: Movement = Movement::Chirp {
    from_hz: 15.0,
    to_hz: 40.0,
    stroke_m: 4e-4,
    duration_s: 4.0,
};

/// Strokes of 0.3 mm: the hand's are longer by what its grip yields.
const SHORT: Movement = Movement::Chirp {
    from_hz: 1.0,
    to_hz: 3.0,
    stroke_m: 7e-4,
    duration_s: 20.0,
};

/// All of them.
#[must_use]
pub fn cases() -> Vec<Case> {
    let thorough = |friction| Experiment::thorough(half_a_kilogram(friction));
    let dahl = || thorough(Friction::Dahl(DAHL));
    let case = |name, experiment, model| Case {
        name,
        experiment,
        model,
        is_hard: false,
    };
    let hard = |name, experiment, model| Case {
        is_hard: true,
        ..case(name, experiment, model)
    };
    let mut lugre = thorough(Friction::Lugre(LUGRE));
    lugre.movements.push(VIBRATION);
    vec![
        case("dahl", dahl(), ModelKind::Dahl),
        case(
            "dahl, stiff and sharp",
            thorough(Friction::Dahl(Dahl {
                contact_stiffness: 1e5,
                exponent: 0.7,
                ..DAHL
            })),
            ModelKind::Dahl,
        ),
        case("dahl, teflon, directions differ", teflon(), ModelKind::Dahl),
        case("lugre", lugre, ModelKind::Lugre),
        case(
            "karnopp",
            thorough(Friction::Karnopp(Karnopp {
                viscous: Directional::both(5.0),
                ..Karnopp::new(4.0, 3.5)
            })),
            ModelKind::Karnopp,
        ),
        hard("strokes of 0.3 mm", dahl().with_movements(&[SHORT]), ModelKind::Dahl),
        hard("encoder of 0.2 mm", watched(dahl(), 0.1, 0.0, 2e-4), ModelKind::Dahl),
        hard("one way", dahl().with_movements(&[ONE_WAY]), ModelKind::Dahl),
        hard("0.3 N of slow noise", watched(dahl(), 0.3, 0.02, 1e-5), ModelKind::Dahl),
        hard(
            "elasto-plastic",
            thorough(Friction::ElastoPlastic(elasto_plastic())),
            ModelKind::Dahl,
        ),
    ]
}

/// A slow stroke in one direction.
const ONE_WAY: Movement = Movement::Ramp {
    speed_mps: 0.05,
    stroke_m: 1.0,
    duration_s: 15.0,
};

/// A kilogram on teflon, with a sensor that was zeroed.
fn teflon() -> Experiment {
    Experiment::thorough(Truth {
        mass_kg: 1.0,
        friction: Friction::Dahl(Dahl {
            dynamic_force: Directional {
                positive: 2.2,
                negative: 1.8,
            },
            contact_stiffness: 2e4,
            exponent: 1.5,
            viscous: Directional::both(1.0),
        }),
        offset_n: 0.0,
    })
}

/// Friction that is none of the models.
const fn elasto_plastic() -> ElastoPlastic {
    ElastoPlastic {
        static_force: Directional::both(4.5),
        dynamic_force: Directional::both(3.5),
        stribeck_velocity: 0.005,
        contact_stiffness: 4e4,
        contact_damping: 60.0,
        elastic_fraction: 0.8,
        viscous: Directional::both(5.0),
    }
}

fn watched(mut experiment: Experiment, force_noise_n: f64, noise_memory_s: f64, resolution_m: f64) -> Experiment {
    experiment.sensors = Sensors {
        force_noise_n,
        noise_memory_s,
        resolution_m,
        ..experiment.sensors
    };
    experiment
}
