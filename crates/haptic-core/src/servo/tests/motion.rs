//! A pulse or an excitation in the place of a scene.

use super::*;
use crate::compensation::{Compensation, MAX_SHARE};
use crate::rig_friction::RigFriction;
use crate::{Course, Directional, Excitation, PulseShape};

const EXCITATION: Excitation = Excitation {
    course: Course::Sweep {
        travel_m: 0.05,
        speed_mps: 0.2,
        rounds: 1,
    },
    force_limit_n: 2.0,
    slew_limit_n_per_s: 500.0,
    stiffness_n_per_m: 1000.0,
    damping_ns_per_m: 20.0,
    travel_limit_m: 0.1,
    speed_limit_mps: 0.5,
    lag_limit_m: 0.1,
    wrong_way_limit_m: 0.1,
};

fn lent(renderer: Renderer) -> Option<Box<CompiledScene>> {
    Some(Box::new(CompiledScene::at_once(renderer, 1)))
}

// hazard: F20
#[test]
fn nothing_is_added_to_the_force_of_a_motion() {
    let mut bench = Bench::with(Settings {
        passivity_control_n: 5.0,
        losses: RigLosses {
            friction: 0.0,
            damping: 0.0,
        },
        compensation: Some(Compensation {
            share: MAX_SHARE,
            friction: RigFriction {
                mass: 1.0,
                dynamic_force: Directional::both(3.0),
                viscous: Directional::both(5.0),
                cogging: None,
            },
        }),
        ..SETTINGS
    });
    let rest = Renderer::pulse(PulseShape::REST, 1e-3).expect("bounded");
    bench.step(Events::default(), None, lent(rest));
    bench.engage();
    let excitation = Renderer::excitation(EXCITATION, 1e-3).expect("bounded");
    let mut outputs = bench.step(Events::default(), None, lent(excitation));
    let mut largest: f64 = 0.0;
    for step in 0..400 {
        assert_eq!(outputs.force_n, -outputs.coupling_force_n, "in step {step}");
        assert!(outputs.force_n.abs() <= 2.0, "{} N in step {step}", outputs.force_n);
        largest = largest.max(outputs.force_n.abs());
        outputs = bench.step(Events::default(), None, None);
    }
    assert_eq!(largest, 2.0, "the hand goes away from the reference");
    assert_eq!(bench.servo.state(), RigState::Engaged);
}
