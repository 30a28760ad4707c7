//! What the table has: a scene for each thing that a tick may have to pay for, and the excitations.

use haptic_core::friction::{
    Dahl, ElastoPlastic, Friction, HaywardArmstrong, Karnopp, Lugre, Reseat, ResetIntegrator, SalcudeanVlaar, Viscous,
};
use haptic_core::{Course, Directional, Excitation, Scene};

/// The scenes of the table, from the least to the most that can be asked of a tick.
#[must_use]
pub fn scenes() -> Vec<(&'static str, Scene)> {
    let on_device = on_device().into_iter().map(|(name, friction)| {
        let scene = Scene {
            block: None,
            coupling: None,
            friction,
            ..Scene::paper()
        };
        (name, scene)
    });
    let behind_block = behind_block().into_iter().map(|(name, friction)| {
        let scene = Scene {
            friction,
            ..Scene::paper()
        };
        (name, scene)
    });
    on_device.chain(behind_block).collect()
}

const fn both(value: f64) -> Directional {
    Directional::both(value)
}

const VISCOUS: Friction = Friction::Viscous(Viscous { viscous: both(35.0) });

const DAHL: Friction = Friction::Dahl(Dahl {
    dynamic_force: both(3.5),
    contact_stiffness: 1e4,
    exponent: 1.0,
    viscous: both(0.0),
});

const LUGRE: Lugre = Lugre {
    static_force: both(4.0),
    dynamic_force: both(3.5),
    stribeck_velocity: 0.01,
    contact_stiffness: 1e4,
    contact_damping: 10.0,
    viscous: both(2.0),
};

const ELASTO_PLASTIC: ElastoPlastic = ElastoPlastic {
    static_force: both(4.0),
    dynamic_force: both(3.5),
    stribeck_velocity: 0.01,
    contact_stiffness: 1e4,
    contact_damping: 10.0,
    elastic_fraction: 0.7,
    viscous: both(2.0),
};

fn karnopp() -> Karnopp {
    Karnopp::new(4.0, 3.5)
}

/// Without a block.
fn on_device() -> [(&'static str, Friction); 10] {
    let salcudean_vlaar = SalcudeanVlaar {
        static_force: both(4.0),
        contact_stiffness: 5000.0,
        viscous: both(5.0),
        velocity_threshold: 0.002,
    };
    let hayward_armstrong = HaywardArmstrong {
        dynamic_force: both(3.5),
        contact_stiffness: 1e4,
        elastic_fraction: 0.7,
        viscous: both(0.0),
    };
    let reset_integrator = ResetIntegrator {
        static_force: both(4.0),
        dynamic_force: both(3.5),
        contact_stiffness: 1e4,
        contact_damping: 10.0,
        viscous: both(0.0),
        reseat: Reseat::Continuous,
    };
    let lugre_without_stribeck = Lugre {
        static_force: both(3.5),
        ..LUGRE
    };
    let elasto_plastic_without_stribeck = ElastoPlastic {
        static_force: both(3.5),
        ..ELASTO_PLASTIC
    };
    [
        ("viscous on the device", VISCOUS),
        (
            "Salcudean-Vlaar on the device",
            Friction::SalcudeanVlaar(salcudean_vlaar),
        ),
        ("Karnopp on the device", Friction::Karnopp(karnopp())),
        ("Dahl on the device", DAHL),
        (
            "Hayward-Armstrong on the device",
            Friction::HaywardArmstrong(hayward_armstrong),
        ),
        (
            "reset integrator on the device",
            Friction::ResetIntegrator(reset_integrator),
        ),
        (
            "LuGre without Stribeck on the device",
            Friction::Lugre(lugre_without_stribeck),
        ),
        ("LuGre on the device", Friction::Lugre(LUGRE)),
        (
            "elasto-plastic without Stribeck on the device",
            Friction::ElastoPlastic(elasto_plastic_without_stribeck),
        ),
        ("elasto-plastic on the device", Friction::ElastoPlastic(ELASTO_PLASTIC)),
    ]
}

/// Behind the paper's block.
fn behind_block() -> [(&'static str, Friction); 9] {
    let with_threshold = Karnopp {
        velocity_threshold: 0.01,
        ..karnopp()
    };
    let asymmetric = Karnopp {
        static_force: Directional {
            positive: 5.0,
            negative: 4.0,
        },
        dynamic_force: Directional {
            positive: 4.0,
            negative: 3.0,
        },
        ..karnopp()
    };
    let rising = Karnopp {
        rising_rate: 10.0,
        ..asymmetric
    };
    let with_stribeck = Karnopp {
        stribeck_velocity: 0.01,
        ..karnopp()
    };
    [
        ("viscous behind a block", VISCOUS),
        ("Karnopp behind a block", Friction::Karnopp(karnopp())),
        ("the same with DV", Friction::Karnopp(with_threshold)),
        ("the same, asymmetric", Friction::Karnopp(asymmetric)),
        ("asymmetric with rising Fs", Friction::Karnopp(rising)),
        ("Karnopp with Stribeck behind a block", Friction::Karnopp(with_stribeck)),
        ("Dahl behind a block", DAHL),
        ("LuGre behind a block", Friction::Lugre(LUGRE)),
        ("elasto-plastic behind a block", Friction::ElastoPlastic(ELASTO_PLASTIC)),
    ]
}

/// The excitations by which a rig is identified, within bounds that the table's hand keeps.
#[must_use]
pub fn excitations() -> Vec<(&'static str, Excitation)> {
    let along = |course| Excitation {
        course,
        force_limit_n: 20.0,
        slew_limit_n_per_s: 2000.0,
        stiffness_n_per_m: 1000.0,
        damping_ns_per_m: 20.0,
        travel_limit_m: 0.25,
        speed_limit_mps: 0.5,
        lag_limit_m: 0.25,
        wrong_way_limit_m: 0.25,
    };
    vec![
        (
            "excitation along a chirp",
            along(Course::Chirp {
                amplitude_m: 0.005,
                from_hz: 0.5,
                to_hz: 3.0,
                duration_s: 12.0,
            }),
        ),
        (
            "excitation along a sweep",
            along(Course::Sweep {
                travel_m: 0.02,
                speed_mps: 0.01,
                rounds: 1,
            }),
        ),
    ]
}
