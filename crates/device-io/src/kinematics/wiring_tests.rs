//! Which motor carries the hand tells how motors and encoders are wired.

use super::five_bar::FiveBar;
use super::tests::{five_bar, pose};
use super::*;
use crate::fake::{Figure, Path, PlanarProperties, PlanarRig};
use proptest::prelude::*;
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// Travels of both motors by an effort of one of them, of a hand with a mass, kg, on motors with inertias: a column of
/// the inverse of their inertia matrix, whose length says nothing.
fn moved_by(jacobian: &Jacobian, motor: usize, mass_kg: f64, inertias: [f64; 2]) -> [f64; 2] {
    let [own, other] = [motor, 1 - motor].map(|motor| jacobian.column(motor));
    let mut moved = [-mass_kg * own.dot(other); 2];
    moved[motor] = mass_kg * other.dot(other) + inertias[1 - motor];
    let longest = moved[0].abs().max(moved[1].abs());
    moved.map(|by| by / longest)
}

/// The linear kinematics, and five-bars in all of the plane, of which the tests take what a workspace may contain.
static WIDE: LazyLock<[Geometry; 5]> = LazyLock::new(|| {
    let five_bar = |(base_m, distal_m)| {
        Geometry::FiveBar(FiveBar {
            base_m,
            proximal_m: 0.07,
            distal_m,
        })
    };
    let [xy, h_belt] = [Linear::Xy, Linear::HBelt].map(Geometry::Linear);
    let [first, second, third] = [(0.0, 0.09), (0.038, 0.09), (0.1, 0.07)].map(five_bar);
    [xy, h_belt, first, second, third]
});

fn mass_and_inertias() -> impl Strategy<Value = (f64, [f64; 2])> {
    // From motors alone to a hand alone.
    let power = || prop_oneof![Just(f64::NEG_INFINITY), -7.0..0.0_f64];
    (-3.0..0.5_f64, power(), power())
        .prop_map(|(mass, first, second)| (10.0_f64.powf(mass), [first, second].map(|power| 10.0_f64.powf(power))))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 4096, ..ProptestConfig::default() })]

    // hazard: H33
    #[test]
    fn wiring_is_distinguished_wherever_force_may_flow(
        hand in (-0.15..0.15, 0.0..0.16_f64).prop_map(|(x, y)| Plane::new(x, y)),
        motor in 0..2_usize,
        (mass_kg, inertias) in mass_and_inertias(),
    ) {
        for geometry in *WIDE {
            let reading = geometry.motors(hand).map(|motors| geometry.reading(motors));
            let Some(Reading::Position(Pose { jacobian, .. })) = reading else { continue };
            let right = moved_by(&jacobian, motor, mass_kg, inertias);
            let swapped = moved_by(&jacobian, 1 - motor, mass_kg, inertias);
            let longest = jacobian.columns.map(Plane::length).into_iter().fold(0.0, f64::max);
            let lead = |moved: [f64; 2]| jacobian.lead_m(motor, moved) / longest;
            // A tenth of the farther travel is the least, where the condition is 4.
            let clear = |moved: [f64; 2]| {
                let carried = [0, 1].map(|motor| (jacobian.column(motor).length() * moved[motor]).abs());
                0.1 * carried[0].max(carried[1]) / longest
            };
            prop_assert!(lead(right) > clear(right), "{:?} {:?}: {:?}", geometry, hand, right);
            for wrong in [right.map(|by| -by), swapped, swapped.map(|by| -by)] {
                prop_assert!(lead(wrong) < -clear(wrong), "{:?} {:?}: {:?}", geometry, hand, wrong);
            }
        }
    }
}

/// A hand of 0.3 kg with 0.1 N of friction that a motor alone pushes from a place, until it is 5 mm away or rests.
fn pushed(kinematics: &Kinematics, motor: usize, force_n: f64, hand: Plane) -> Option<[[f64; 2]; 2]> {
    let path = Path::Figure {
        figure: Figure::Circle,
        middle: hand,
        amplitude_m: 0.0,
        frequency_hz: 1.0,
    };
    let mut rig = PlanarRig::new(PlanarProperties::of(kinematics), *kinematics, Some(path)).expect("within reach");
    rig.let_go(true);
    let at = kinematics.motors(hand).expect("within reach");
    let mut efforts = [0.0; 2];
    efforts[motor] = force_n / pose(kinematics, at).jacobian.force_of_motor(motor).length();
    rig.drive(efforts);
    for ms in 0..400 {
        if ms == 200 {
            rig.drive([0.0; 2]);
        }
        rig.live_until(ms * 1_000_000);
        if (rig.position() - hand).length() >= 5e-3 {
            break;
        }
    }
    Some([at, kinematics.motors(rig.position())?])
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 512, ..ProptestConfig::default() })]

    // hazard: H33
    #[test]
    fn wiring_is_distinguished_by_the_first_5_mm_of_a_pulse(
        hand in (-0.15..0.15, 0.0..0.16_f64).prop_map(|(x, y)| Plane::new(x, y)),
        base_m in prop_oneof![Just(0.0), Just(0.038), Just(0.1)],
        motor in 0..2_usize,
        force_n in 0.2..5.0_f64,
        is_negative in any::<bool>(),
    ) {
        let text = format!(
            "kinematics = 'five-bar'\nbase_m = {base_m}\nproximal_m = 0.07\ndistal_m = 0.09\n\
             workspace_m = {{ x = [{}, {}], y = [{}, {}] }}\n",
            hand.x - 1e-3, hand.x + 1e-3, hand.y - 1e-3, hand.y + 1e-3,
        );
        let Ok(kinematics) = Kinematics::from_toml(&text) else { return Ok(()) };
        let sign = if is_negative { -1.0 } else { 1.0 };
        for (driven, expected) in [(motor, 1.0), (1 - motor, -1.0)] {
            let Some([at, to]) = pushed(&kinematics, driven, sign * force_n, hand) else { continue };
            // An angle begins anew somewhere.
            let moved = [0, 1].map(|motor| to[motor] - at[motor]).map(|by| by - TAU * (by / TAU).round());
            let middle = [0, 1].map(|motor| at[motor] + 0.5 * moved[motor]);
            let Some(pose) = kinematics.reading(middle).pose() else { continue };
            let lead_m = pose.jacobian.lead_m(motor, moved.map(|by| sign * by));
            let longest_m = [0, 1].map(|motor| (pose.jacobian.column(motor).length() * moved[motor]).abs());
            let clear_m = 0.05 * longest_m[0].max(longest_m[1]);
            prop_assert!(expected * lead_m >= clear_m, "{} m of {} m at {:?} by {}", lead_m, clear_m, hand, driven);
        }
    }
}

// hazard: H33
#[test]
fn swapped_encoders_put_the_hand_outside_the_workspace() {
    for kinematics in [five_bar(0.0), five_bar(38.0)] {
        let home = kinematics.home().expect("a home pose");
        let column = |x| (60..=130).step_by(5).map(move |y| (x, y));
        for (x, y) in (-60..=60).step_by(4).flat_map(column) {
            let hand = Plane::new(f64::from(x), f64::from(y)) * 1e-3;
            let [first, second] = kinematics.motors(hand).expect("within reach");
            // Counted from the home pose, or absolute.
            let relative = [home[0] + second - home[1], home[1] + first - home[0]];
            for seen in [relative, [second, first]] {
                let seen = kinematics.reading(seen).pose();
                let is_out = seen.is_none_or(|pose| !kinematics.inside(pose.position));
                assert!(is_out, "{hand:?}: {seen:?}");
            }
        }
    }
}
