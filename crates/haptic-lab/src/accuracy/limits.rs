//! Every law that is judged, and what it is held to: the one table of the limits that the tests check.

use haptic_core::Directional;
use haptic_core::friction::{
    Dahl, ElastoPlastic, Friction, HaywardArmstrong, Karnopp, Lugre, Reseat, ResetIntegrator, SalcudeanVlaar, Viscous,
};

/// The limits of a law with the exact scheme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawLimit {
    /// Name of the law, as in [`laws_under_hands`](super::hands::laws_under_hands).
    pub law: &'static str,
    /// Force error behind a block, N: all hands, masses and single ticks, except ticks at their
    /// bound of work and those after them.
    pub behind_block_n: f64,
    /// Median of the force error there, N, of the worst run.
    pub median_n: f64,
    /// Force error on the device itself, N.
    pub on_device_n: f64,
    /// Ticks at their bound of work behind a block.
    pub at_bound: f64,
    /// Runs whose stops and breakaways are not the truth's.
    pub other_lists: f64,
    /// Instructions a tick on each of [`INSTRUCTIONS_ON`], in the profile of the tests, with a tenth
    /// on top. Raise one only for something that the law really needs.
    pub instructions: [f64; 3],
}

/// The hand and the mass, kg, for which instructions are counted; none on the device itself.
pub const INSTRUCTIONS_ON: [(&str, Option<f64>); 3] = [("60 Hz", Some(0.5)), ("437 Hz", Some(0.01)), ("60 Hz", None)];

/// One row.
const fn law(
    law: &'static str,
    behind_block_n: f64,
    median_n: f64,
    on_device_n: f64,
    at_bound: f64,
    other_lists: f64,
    instructions: [f64; 3],
) -> LawLimit {
    LawLimit {
        law,
        behind_block_n,
        median_n,
        on_device_n,
        at_bound,
        other_lists,
        instructions,
    }
}

/// Every law. Columns: error behind a block, its median, error on the device, ticks at their bound, runs with other
/// stops or breakaways, instructions.
#[rustfmt::skip]
pub const LIMITS: [LawLimit; 16] = [
    law("karnopp",                        1e-11, 1e-12, 1e-10, 0.0, 0.0, [930.0, 5_441.0, 226.0]),
    law("viscous",                        1e-11, 1e-12, 1e-12, 0.0, 0.0, [218.0, 219.0, 31.0]),
    law("karnopp, Stribeck",              1e-9,  1e-11, 1e-10, 0.0, 0.0, [8_240.0, 58_100.0, 333.0]),
    law("karnopp, Stribeck and rising Fs", 1e-9,  1e-11, 0.0,   0.0, 0.0, [6_360.0, 38_700.0, 0.0]),
    law("karnopp, rising Fs",             1e-9,  1e-11, 0.0,   0.0, 0.0, [963.0, 5_536.0, 0.0]),
    law("dahl",                           1e-9,  1e-11, 1e-10, 0.0, 0.0, [5_430.0, 36_500.0, 278.0]),
    law("dahl, i = 0",                    1e-9,  1e-11, 1e-10, 0.0, 0.0, [2_517.0, 14_200.0, 226.0]),
    law("dahl, i = 0.5",                  1e-9,  1e-11, 1e-10, 0.0, 0.0, [3_150.0, 16_900.0, 321.0]),
    law("dahl, i = 2, asymmetric",        1e-9,  1e-11, 1e-10, 0.0, 0.0, [8_650.0, 52_800.0, 535.0]),
    law("hayward-armstrong",              1e-9,  1e-11, 1e-10, 0.0, 0.0, [25_800.0, 192_000.0, 367.0]),
    law("reset-integrator",               1e-9,  1e-11, 1e-10, 0.0, 0.0, [2_376.0, 11_400.0, 201.0]),
    law("lugre",                          1e-9,  1e-11, 1e-10, 0.0, 0.0, [14_600.0, 109_000.0, 3_808.0]),
    law("lugre, Fs = Fd",                 1e-9,  1e-11, 1e-10, 0.0, 0.0, [5_580.0, 45_700.0, 286.0]),
    law("elasto-plastic",                 1e-9,  1e-11, 1e-10, 0.0, 0.0, [28_200.0, 191_000.0, 24_925.0]),
    law("elasto-plastic, Fs = Fd",        1e-9,  1e-11, 1e-10, 0.0, 0.0, [15_200.0, 108_000.0, 450.0]),
    law("salcudean-vlaar",                1e-9,  1e-11, 1e-10, 0.0, 0.0, [2_343.0, 11_000.0, 198.0]),
];

/// The laws beside plain Karnopp friction, with limits of the paper's size.
#[must_use]
pub fn laws() -> Vec<(&'static str, Friction)> {
    const BRISTLE: f64 = 1e5;
    let none = Directional::both(0.0);
    let (held, sliding) = (Directional::both(4.0), Directional::both(3.5));
    let asymmetric = Directional {
        positive: 4.0,
        negative: 2.0,
    };
    let dahl = |exponent| Dahl {
        dynamic_force: sliding,
        contact_stiffness: BRISTLE,
        exponent,
        viscous: none,
    };
    let lugre = Lugre {
        static_force: held,
        dynamic_force: sliding,
        stribeck_velocity: 0.01,
        contact_stiffness: BRISTLE,
        contact_damping: 100.0,
        viscous: Directional::both(20.0),
    };
    vec![
        (
            "viscous",
            Friction::Viscous(Viscous {
                viscous: Directional::both(35.0),
            }),
        ),
        (
            "karnopp, Stribeck",
            Friction::Karnopp(Karnopp {
                stribeck_velocity: 0.02,
                ..Karnopp::new(5.0, 3.0)
            }),
        ),
        (
            "karnopp, Stribeck and rising Fs",
            Friction::Karnopp(Karnopp {
                stribeck_velocity: 0.02,
                rising_rate: 20.0,
                ..Karnopp::new(6.0, 3.0)
            }),
        ),
        (
            "karnopp, rising Fs",
            Friction::Karnopp(Karnopp {
                rising_rate: 20.0,
                ..Karnopp::new(6.0, 3.0)
            }),
        ),
        ("dahl", Friction::Dahl(dahl(1.0))),
        ("dahl, i = 0", Friction::Dahl(dahl(0.0))),
        ("dahl, i = 0.5", Friction::Dahl(dahl(0.5))),
        (
            "dahl, i = 2, asymmetric",
            Friction::Dahl(Dahl {
                dynamic_force: asymmetric,
                ..dahl(2.0)
            }),
        ),
        (
            "hayward-armstrong",
            Friction::HaywardArmstrong(HaywardArmstrong {
                dynamic_force: sliding,
                contact_stiffness: BRISTLE,
                elastic_fraction: 0.7,
                viscous: none,
            }),
        ),
        (
            "reset-integrator",
            Friction::ResetIntegrator(ResetIntegrator {
                static_force: held,
                dynamic_force: sliding,
                contact_stiffness: BRISTLE,
                contact_damping: 20.0,
                viscous: none,
                reseat: Reseat::Continuous,
            }),
        ),
        ("lugre", Friction::Lugre(lugre)),
        (
            "elasto-plastic",
            Friction::ElastoPlastic(ElastoPlastic {
                static_force: held,
                dynamic_force: sliding,
                stribeck_velocity: 0.01,
                contact_stiffness: BRISTLE,
                contact_damping: 100.0,
                elastic_fraction: 0.7,
                viscous: none,
            }),
        ),
        (
            "salcudean-vlaar",
            Friction::SalcudeanVlaar(SalcudeanVlaar {
                static_force: held,
                contact_stiffness: BRISTLE,
                viscous: Directional::both(5.0),
                velocity_threshold: 0.0,
            }),
        ),
    ]
}
