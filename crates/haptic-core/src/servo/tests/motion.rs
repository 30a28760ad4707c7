//! A motion of the rig's own in the place of the scene.

use super::compensation::compensation;
use super::*;
use crate::compensation::MAX_SHARE;
use crate::{Course, Excitation, MotionEnd, OwnMotion};

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

fn excitation() -> OwnMotion {
    OwnMotion::excitation(EXCITATION, 1e-3).expect("bounded")
}

// hazard: F20
#[test]
fn nothing_is_added_to_the_force_of_a_motion() {
    let mut script = Script::new(Settings {
        passivity_control_n: 5.0,
        compensation: Some(compensation(MAX_SHARE)),
        ..SETTINGS
    });
    script.go_on(10);
    script.servo.begin_own_motion(OwnMotion::REST, 1.0);
    script.command(Command::Engage);
    script.go_on(100);
    script.servo.begin_own_motion(excitation(), 1.0);
    let mut largest: f64 = 0.0;
    for step in 0..400 {
        let outputs = script.next();
        assert_eq!(outputs.force_n, -outputs.coupling_force_n, "in step {step}");
        assert!(outputs.force_n.abs() <= 2.0, "{} N in step {step}", outputs.force_n);
        assert!(outputs.contact != 0 && script.servo.snapshot().is_none());
        largest = largest.max(outputs.force_n.abs());
    }
    assert_eq!(largest, 2.0, "the hand goes away from the reference");
    assert_eq!(script.servo.state(), RigState::Engaged);
    assert_eq!(script.servo.own_motion().and_then(OwnMotion::end), None);
}

#[test]
fn own_motion_replaces_a_scene_and_is_replaced_without_force() {
    let mut script = Script::engaged(SETTINGS);
    // In the middle of a change of scene, which it ends.
    script.once.scene = Some(soft(2, Transition::Fade { over_s: 0.1 }));
    assert!(script.next().force_n.abs() > 3.0, "the hand drags the block");
    script.servo.begin_own_motion(OwnMotion::REST, 1.0);
    let outputs = script.next();
    assert_eq!((outputs.coupling_force_n, outputs.force_n), (0.0, 0.0));
    assert_eq!(outputs.block_position_m, outputs.device_position_m);
    script.servo.begin_own_motion(excitation(), 1.0);
    script.go_on(100);
    assert!(script.next().force_n.abs() > 0.5, "the handle is drawn");
    script.once.scene = Some(soft(3, Transition::AtOnce));
    let outputs = script.next();
    // What the step of the hand within the first tick makes.
    assert!(outputs.coupling_force_n.abs() < 0.1, "{outputs:?}");
    assert!(script.servo.own_motion().is_none() && script.servo.snapshot().is_some());
}

#[test]
fn own_motion_without_force_never_begins_and_a_stop_ends_it() {
    let mut script = Script::new(SETTINGS);
    script.go_on(10);
    let end = |script: &Script| script.servo.own_motion().and_then(OwnMotion::end);
    script.servo.begin_own_motion(excitation(), 1.0);
    script.next();
    assert_eq!(end(&script), Some(MotionEnd::Interrupted));
    let mut script = Script::engaged(SETTINGS);
    script.servo.begin_own_motion(excitation(), 1.0);
    script.go_on(50);
    assert_eq!(end(&script), None);
    script.once.events = Event::Stop.into();
    assert_eq!(script.next().force_n, 0.0);
    assert_eq!(end(&script), Some(MotionEnd::Interrupted));
}
