//! What the two motors of a rig are to the hand, by what a commissioning has found of each of them alone.
//!
//! A motor that is driven alone shows the friction and the mass of the whole linkage along its own force, where it was
//! driven. Its own part follows from how the other motor went along. Friction is taken to be at the motors, the mass at
//! the hand (`mu`, alike in all directions) and at the motors (`I`), so that the motors' inertia matrix is
//! `H = mu J'J + diag(I)`, with `a` and `b` the lengths of the columns of `J` and `g` their product:
//!
//! ```text
//! found friction = f1 + |s1| f2           s1 = -mu g/(mu b^2 + I2), how far the other motor goes with this one
//! found inertia  = I1 + mu (a^2 + s1 g)
//! ```
//!
//! What is found to be at the hand is the same everywhere. What is at the motors is the least to the hand where the
//! hand moves farthest with them.

use crate::control::rig::commission_record::Findings;
use device_io::kinematics::{Kinematics, Worst};
use serde::{Deserialize, Serialize};

/// Least cosine between the paths on which two motors carry the hand, from which on it shows a mass at the hand: below,
/// a motor hardly takes the other along, wherever the mass is.
const MIN_COSINE: f64 = 0.2;

/// A pulse of one motor alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(in crate::control) struct DrivenAlone {
    /// Positions of both motors where it began, m or rad.
    pub(in crate::control) at: [f64; 2],
    /// How far it moved them, m or rad.
    pub(in crate::control) moved: [f64; 2],
}

/// Where on a rig of two axes a friction and a mass are the least, and the heaviest mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::control) struct WorstPlaces {
    pub(in crate::control) friction_n: Option<Worst>,
    pub(in crate::control) lightest_kg: Option<Worst>,
    pub(in crate::control) heaviest_kg: Option<Worst>,
}

/// What was found of a motor, and of the linkage where it was driven alone.
struct Alone {
    /// Friction and inertia that it has to overcome alone, N and kg of a linear motor, N m and kg m^2 of a rotary one.
    friction: Option<f64>,
    inertia: Option<f64>,
    /// How far the other motor goes with this one.
    other_travel: f64,
    /// Lengths of its own column of the Jacobian and of the other's, squared, and their product.
    own_squared: f64,
    other_squared: f64,
    product: f64,
}

impl Alone {
    fn of(kinematics: &Kinematics, motor: usize, found: Findings, alone: DrivenAlone) -> Option<Self> {
        let jacobian = kinematics.reading(alone.at).pose()?.jacobian;
        // A newton on the hand along the force of this motor alone takes so much effort of it.
        let effort_per_n = jacobian.force_of_motor(motor).length().recip();
        let [own, other] = [motor, 1 - motor].map(|motor| jacobian.column(motor));
        Some(Self {
            friction: found.friction_n.map(|friction_n| friction_n * effort_per_n),
            inertia: found.mass_kg.map(|mass_kg| mass_kg * effort_per_n * effort_per_n),
            other_travel: alone.moved[1 - motor] / alone.moved[motor],
            own_squared: own.dot(own),
            other_squared: other.dot(other),
            product: own.dot(other),
        })
    }

    /// What a mass of 1 kg at the hand adds to its inertia.
    fn by_mass(&self) -> f64 {
        self.own_squared + self.other_travel * self.product
    }

    /// The mass at the hand, kg, by how the other motor goes along; `None` where that does not show it. `other` is the
    /// other motor, and `inertia` what it has to overcome.
    fn mass_at_hand_kg(&self, other: &Self, inertia: f64) -> Option<f64> {
        if self.product.abs() < MIN_COSINE * (self.own_squared * self.other_squared).sqrt() {
            return None;
        }
        let of_mass = self.product + self.other_travel * (self.other_squared - other.by_mass());
        // A motor that the other does not take along, or not as a mass would, is held by more than inertia.
        Some((-self.other_travel * inertia / of_mass).max(0.0))
    }
}

/// What is known of the rig as a whole, in the worst direction at the worst place of the workspace, by the findings of
/// both motors; it takes milliseconds.
pub(in crate::control) fn of_both(kinematics: &Kinematics, motors: [(Findings, Option<DrivenAlone>); 2]) -> Findings {
    let [first, second] = [0, 1].map(|motor| {
        let (found, alone) = motors[motor];
        Alone::of(kinematics, motor, found, alone?)
    });
    let Some((first, second)) = first.zip(second) else {
        return Findings::default();
    };
    let friction_n = own_frictions(&first, &second).map(|frictions| kinematics.least_force(frictions));
    let masses_kg = first.inertia.zip(second.inertia).map(|inertias| {
        let (mass_kg, inertias) = at_hand_and_at_motors(&first, &second, inertias.into());
        kinematics.masses_kg(inertias).map(|worst| Worst {
            value: mass_kg + worst.value,
            ..worst
        })
    });
    let [lightest_kg, heaviest_kg] = [0, 1].map(|index| masses_kg.map(|masses| masses[index]));
    Findings {
        range_m: None,
        friction_n: friction_n.map(|worst| worst.value),
        mass_kg: lightest_kg.map(|worst| worst.value),
        worst: WorstPlaces {
            friction_n,
            lightest_kg,
            heaviest_kg,
        },
    }
}

/// Friction of each motor itself, N or N m.
fn own_frictions(first: &Alone, second: &Alone) -> Option<[f64; 2]> {
    let (one, other) = first.friction.zip(second.friction)?;
    let travels = [first.other_travel.abs(), second.other_travel.abs()];
    let rest = 1.0 - travels[0] * travels[1];
    // Of two motors that take each other along wholly nothing is known.
    (rest > 0.0)
        .then(|| [one - travels[0] * other, other - travels[1] * one].map(|friction| (friction / rest).max(0.0)))
}

/// The mass at the hand, kg, and the inertia of each motor itself, kg or kg m^2.
fn at_hand_and_at_motors(first: &Alone, second: &Alone, inertias: [f64; 2]) -> (f64, [f64; 2]) {
    let shown = [
        first.mass_at_hand_kg(second, inertias[1]),
        second.mass_at_hand_kg(first, inertias[0]),
    ];
    let by_mass = [first.by_mass(), second.by_mass()];
    // What is not shown to be at the hand counts as at the motors, where it is less elsewhere.
    let least_kg = shown.into_iter().flatten().reduce(f64::min).unwrap_or(0.0);
    let mass_kg = [0, 1]
        .into_iter()
        .fold(least_kg, |mass_kg, motor| mass_kg.min(inertias[motor] / by_mass[motor]))
        .max(0.0);
    (
        mass_kg,
        [0, 1].map(|motor| (inertias[motor] - mass_kg * by_mass[motor]).max(0.0)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::planar::Plane;
    use proptest::prelude::*;
    use std::sync::LazyLock;

    static FIVE_BAR: LazyLock<Kinematics> = LazyLock::new(|| {
        Kinematics::from_toml(
            "kinematics = 'five-bar'\nbase_m = 0.038\nproximal_m = 0.07\ndistal_m = 0.09\n\
             workspace_m = { x = [-0.06, 0.06], y = [0.06, 0.13] }\n",
        )
        .expect("a linkage")
    });

    /// A rig with a mass at the hand and with friction and inertia at its motors.
    #[derive(Clone, Copy, Debug)]
    struct TestRig {
        mass_kg: f64,
        inertias: [f64; 2],
        frictions: [f64; 2],
    }

    impl TestRig {
        /// Inverse of the motors' inertia matrix: both diagonals, and what is beside them.
        fn mobility(&self, columns: [Plane; 2]) -> ([f64; 2], f64) {
            let [first, second] =
                [0, 1].map(|motor| self.inertias[motor] + self.mass_kg * columns[motor].dot(columns[motor]));
            let beside = self.mass_kg * columns[0].dot(columns[1]);
            let determinant = first * second - beside * beside;
            ([second / determinant, first / determinant], -beside / determinant)
        }

        /// What a commissioning finds of a motor at a place.
        fn found(&self, kinematics: &Kinematics, motor: usize, hand: Plane) -> (Findings, Option<DrivenAlone>) {
            let at = kinematics.motors(hand).expect("within reach");
            let jacobian = kinematics.reading(at).pose().expect("a pose").jacobian;
            let (own, beside) = self.mobility([0, 1].map(|motor| jacobian.column(motor)));
            let other_travel = beside / own[motor];
            let mut moved = [1e-3 * other_travel; 2];
            moved[motor] = 1e-3;
            let n_per_effort = jacobian.force_of_motor(motor).length();
            let friction = self.frictions[motor] + other_travel.abs() * self.frictions[1 - motor];
            let findings = Findings {
                friction_n: Some(friction * n_per_effort),
                mass_kg: Some(n_per_effort * n_per_effort / own[motor]),
                ..Findings::default()
            };
            (findings, Some(DrivenAlone { at, moved }))
        }

        /// Friction against a motion of the hand in a direction, N, and its apparent mass there, kg.
        fn along(&self, kinematics: &Kinematics, hand: Plane, direction: Plane) -> (f64, f64) {
            let motors = kinematics.motors(hand).expect("within reach");
            let jacobian = kinematics.reading(motors).pose().expect("a pose").jacobian;
            // The travels of the motors by that of the hand: power is the same on both sides.
            let travels = [0, 1].map(|motor| jacobian.force_of_motor(motor).dot(direction));
            let friction_n = self.frictions[0] * travels[0].abs() + self.frictions[1] * travels[1].abs();
            let mass_kg =
                self.mass_kg + self.inertias[0] * travels[0] * travels[0] + self.inertias[1] * travels[1] * travels[1];
            (friction_n, mass_kg)
        }
    }

    fn rig() -> impl Strategy<Value = TestRig> {
        let inertia = || 1e-6..1e-3_f64;
        let friction = || 1e-3..0.05_f64;
        (0.0..0.5_f64, (inertia(), inertia()), (friction(), friction())).prop_map(|(mass_kg, inertias, frictions)| {
            TestRig {
                mass_kg,
                inertias: inertias.into(),
                frictions: frictions.into(),
            }
        })
    }

    fn place() -> impl Strategy<Value = Plane> {
        (-0.06..0.06, 0.06..0.13).prop_map(|(x, y)| Plane::new(x, y))
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, cases: 64, ..ProptestConfig::default() })]

        #[test]
        fn no_place_of_a_rig_is_worse_than_the_worst(
            rig in rig(),
            commissioned_at in (place(), place()),
            places in prop::collection::vec((place(), 0.0..3.15_f64), 200),
        ) {
            let kinematics = &*FIVE_BAR;
            let found = [(0, commissioned_at.0), (1, commissioned_at.1)]
                .map(|(motor, hand)| rig.found(kinematics, motor, hand));
            let whole = of_both(kinematics, found);
            let (friction_n, mass_kg) = (whole.friction_n.expect("known"), whole.mass_kg.expect("known"));
            for (hand, angle) in places {
                let (friction, mass) = rig.along(kinematics, hand, Plane::new(angle.cos(), angle.sin()));
                // Between two places of the grid it may be a little less.
                prop_assert!(friction >= 0.99 * friction_n, "{} N at {:?}, below {:?}", friction, hand, whole);
                prop_assert!(mass >= 0.98 * mass_kg, "{} kg at {:?}, below {:?}", mass, hand, whole);
            }
            // And there it is what is reported.
            let worst = whole.worst.friction_n.expect("known");
            let there = rig.along(kinematics, worst.position, worst.direction).0;
            prop_assert!((there / friction_n - 1.0).abs() < 1e-6, "{} N for {:?}", there, worst);
        }

        #[test]
        fn mass_is_parted_between_hand_and_motors(rig in rig(), hand in place()) {
            let kinematics = &*FIVE_BAR;
            let whole = of_both(kinematics, [0, 1].map(|motor| rig.found(kinematics, motor, hand)));
            let lightest = whole.worst.lightest_kg.expect("known");
            let there = rig.along(kinematics, lightest.position, lightest.direction).1;
            let motors = kinematics.motors(hand).expect("within reach");
            let jacobian = kinematics.reading(motors).pose().expect("a pose").jacobian;
            let [own, other] = [0, 1].map(|motor| jacobian.column(motor));
            if own.dot(other).abs() > 1.01 * MIN_COSINE * own.length() * other.length() {
                prop_assert!((there / lightest.value - 1.0).abs() < 1e-6, "{} kg for {:?}", there, lightest);
            } else {
                prop_assert!(lightest.value <= 1.0001 * there, "{} kg for {:?}", there, lightest);
            }
        }
    }

    #[test]
    fn gantry_is_the_least_of_its_axes() {
        let gantry: Kinematics = "xy".parse().expect("kinematics");
        let alone = |motor: usize| DrivenAlone {
            at: [0.0; 2],
            moved: [0, 1].map(|other| if other == motor { 1e-3 } else { 0.0 }),
        };
        let found = |friction_n, mass_kg| Findings {
            friction_n,
            mass_kg,
            ..Findings::default()
        };
        let (x, y) = (found(Some(0.5), Some(0.4)), found(Some(0.3), Some(0.9)));
        let whole = of_both(&gantry, [(x, Some(alone(0))), (y, Some(alone(1)))]);
        let WorstPlaces {
            friction_n: Some(friction),
            lightest_kg: Some(lightest),
            heaviest_kg: Some(heaviest),
        } = whole.worst
        else {
            panic!("{whole:?}");
        };
        for (worst, value, direction) in [
            (friction, 0.3, Plane::new(0.0, 1.0)),
            (lightest, 0.4, Plane::new(1.0, 0.0)),
            (heaviest, 0.9, Plane::new(0.0, 1.0)),
        ] {
            assert!((worst.value - value).abs() < 1e-12, "{worst:?}");
            assert!((worst.direction - direction).length() < 1e-12, "{worst:?}");
        }
        // What one motor does not tell is not known of both, and no motor is like the other.
        let whole = of_both(&gantry, [(x, Some(alone(0))), (found(Some(0.3), None), Some(alone(1)))]);
        assert_eq!((whole.friction_n, whole.mass_kg), (Some(0.3), None));
        assert_eq!(of_both(&gantry, [(x, Some(alone(0))), (y, None)]), Findings::default());
    }
}
