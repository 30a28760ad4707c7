//! The force is that of the scene, scaled by the ramp and by how new the sample is, and changes of
//! the scene take their path to it. Each is held against the scene alone.

use super::script::{PLAIN, SPEED_MPS};
use super::*;

const TICK_S: f64 = 1e-3;

/// Time in which a step of force takes effect, in steps of a millisecond.
const OFFSET_STEPS: f64 = 50.0;

fn assert_near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() < 1e-9, "{what}: {found}, expected {expected}");
}

/// The coupling force of a step, which is that of a scene alone under the same hand, N.
fn felt(outputs: &Outputs, alone: &mut Renderer) -> f64 {
    let force = ticked(outputs, alone);
    assert_near(outputs.coupling_force_n, force, "coupling force");
    force
}

/// The coupling force of a scene alone under the hand of a step, N.
fn ticked(outputs: &Outputs, alone: &mut Renderer) -> f64 {
    let rendered = alone.tick(TICK_S, outputs.device_position_m, outputs.device_velocity_mps);
    rendered.coupling_force
}

/// Lets a scene take effect with the next step.
fn bring(script: &mut Script, renderer: Renderer, transition: Transition) {
    while script.servo.take_retired().is_some() {}
    script.once.scene = Some(Box::new(CompiledScene {
        renderer,
        revision: script.servo.scene().revision + 1,
        transition,
    }));
}

#[test]
fn force_is_scene_force_at_hand_times_ramp_gain() {
    let mut script = Script::new(PLAIN);
    let position_m = |k: u32| 0.4 + 3e-3 * libm::sin(0.02 * f64::from(k));
    let mut alone = stiff(25_000.0);
    for k in 0..600 {
        script.once.command = match k {
            50 => Some(Command::Engage),
            500 => Some(Command::Release),
            _ => None,
        };
        let outputs = script.step(position_m(k));
        assert_eq!(outputs.device_position_m, position_m(k), "step {k}");
        let velocity = if k == 0 {
            0.0
        } else {
            (position_m(k) - position_m(k - 1)) / TICK_S
        };
        assert_near(outputs.device_velocity_mps, velocity, "velocity");
        // Of a ramp of 20 steps: the step that engages has no force yet, the one that releases has.
        let gain = match k {
            0..=50 => 0.0,
            51..500 => (f64::from(k - 50) / 20.0).min(1.0),
            500..519 => f64::from(519 - k) / 20.0,
            _ => 0.0,
        };
        let state = match k {
            0..50 => RigState::Idle,
            50..70 => RigState::Engaging,
            70..500 => RigState::Engaged,
            500..519 => RigState::Releasing,
            _ => RigState::Idle,
        };
        assert_eq!((k, script.servo.state()), (k, state));
        assert_eq!((k, outputs.enabled), (k, state.is_live()));
        let block = alone.state();
        let coupling_force = if (51..=519).contains(&k) {
            ticked(&outputs, &mut alone)
        } else {
            alone.start_at(outputs.device_position_m, outputs.device_velocity_mps);
            0.0
        };
        assert_near(outputs.coupling_force_n, coupling_force, "coupling force");
        assert_near(outputs.force_n, -gain * coupling_force, "force");
        assert!(k < 51 || block != alone.state(), "the block goes along");
        assert_eq!(outputs.block_position_m, alone.state().position, "step {k}");
        assert_eq!(outputs.block_velocity_mps, alone.state().velocity, "step {k}");
        let contact = if outputs.enabled {
            alone.state().contact.as_number()
        } else {
            0
        };
        assert_eq!((k, outputs.contact), (k, contact));
    }
}

// hazard: H16
#[test]
fn force_decays_after_three_silent_periods_and_returns() {
    for silent in [0_u32, 3, 4, 10, 22] {
        let mut script = Script::engaged(PLAIN);
        let before = script.next();
        assert!(before.force_n < -3.0, "the hand drags the block: {before:?}");
        let mut share = 1.0;
        for k in 1..=silent {
            share = (1.0 - (f64::from(k) - 3.0) / 20.0).clamp(0.0, 1.0);
            let outputs = script.repeat();
            assert_near(outputs.force_n, share * before.force_n, "force in silence");
            assert_eq!(
                outputs.block_position_m, before.block_position_m,
                "no time passes for it"
            );
        }
        script.once.device_elapsed_ns = u64::from(silent + 1) * MS;
        for _ in 0..60 {
            share = (share + 1.0 / 50.0).min(1.0);
            let outputs = script.next();
            assert_near(outputs.force_n, -share * outputs.coupling_force_n, "returning force");
        }
        assert_near(share, 1.0, "all of it is back");
    }
}

#[test]
fn force_step_of_new_scene_fades_in_over_50_ms() {
    let mut script = Script::engaged(PLAIN);
    let mut alone = stiff(100.0);
    let step = alone.take_over(&script.servo.scene().renderer);
    assert!(step > 1.0, "too soft to hold what the one before held: {step} N");
    bring(&mut script, stiff(100.0), Transition::AtOnce);
    for k in 1..70 {
        let outputs = script.next();
        let coupling_force = felt(&outputs, &mut alone);
        let left = step * (1.0 - f64::from(k) / OFFSET_STEPS).max(0.0);
        assert_near(outputs.force_n, -(coupling_force + left), "force");
    }
}

#[test]
fn fade_blends_evenly_from_old_scene_force_to_new() {
    let mut script = Script::engaged(PLAIN);
    let mut old = script.servo.scene().renderer.clone();
    let mut new = stiff(100.0);
    new.take_over(&old);
    bring(&mut script, stiff(100.0), Transition::Fade { over_s: 0.0105 });
    for k in 1..20 {
        let outputs = script.next();
        let [new, old] = [&mut new, &mut old].map(|renderer| ticked(&outputs, renderer));
        assert!(old - new > 0.5, "{old} N, {new} N");
        let left = (1.0 - f64::from(k) / 10.5).max(0.0);
        assert_near(outputs.coupling_force_n, new + left * (old - new), "coupling force");
        assert_near(outputs.force_n, -outputs.coupling_force_n, "force");
        assert_eq!((k, script.servo.take_retired().is_some()), (k, k == 11));
    }
}

#[test]
fn a_scene_that_comes_in_amid_a_fade_takes_the_rest_of_it_back() {
    let mut script = Script::engaged(PLAIN);
    bring(&mut script, stiff(100.0), Transition::Fade { over_s: 0.04 });
    for _ in 0..9 {
        script.next();
    }
    let mut alone = script.servo.scene().renderer.clone();
    let faded = script.next();
    let excess = faded.coupling_force_n - ticked(&faded, &mut alone);
    assert!(excess > 0.5, "{excess} N");
    let mut next = stiff(90.0);
    let taken_back = excess + next.take_over(&alone);
    bring(&mut script, stiff(90.0), Transition::AtOnce);
    for k in 1..60 {
        let outputs = script.next();
        let coupling_force = felt(&outputs, &mut next);
        let left = taken_back * (1.0 - f64::from(k) / OFFSET_STEPS).max(0.0);
        assert_near(outputs.force_n, -(coupling_force + left), "force");
    }
}

fn taken(script: &Script) -> usize {
    match &script.servo.scene().transition {
        Transition::Steps(steps) => steps.taken(),
        _ => panic!("it takes effect by steps"),
    }
}

#[test]
fn scene_ramp_steps_are_even_and_offset_in_force() {
    let mut script = Script::engaged(PLAIN);
    let path = [90.0, 80.0, 70.0, 60.0, 50.0];
    let mut alone = stiff(100.0);
    // What was taken back when its fade began, and the steps that are left of it.
    let (mut taken_back, mut left) = (alone.take_over(&script.servo.scene().renderer), OFFSET_STEPS);
    bring(
        &mut script,
        stiff(100.0),
        Transition::Steps(Steps::new(path.map(stiff).to_vec(), 0.023)),
    );
    let mut came = 0;
    for k in 1..90_u32 {
        let outputs = script.next();
        // One every 4.6 ms.
        let due = (k * 10 / 46).min(5) as usize;
        assert_eq!((k, taken(&script)), (k, due));
        if due > came {
            came = due;
            let mut next = stiff(path[due - 1]);
            let step = next.take_over(&alone);
            assert!(step > 0.05, "{step} N");
            alone = next;
            (taken_back, left) = (taken_back * left / OFFSET_STEPS + step, OFFSET_STEPS);
        }
        let coupling_force = felt(&outputs, &mut alone);
        left = (left - 1.0).max(0.0);
        assert_near(
            outputs.force_n,
            -(coupling_force + taken_back * left / OFFSET_STEPS),
            "force",
        );
    }
    assert_eq!((came, left), (5, 0.0));
}

#[test]
fn without_force_a_scene_on_its_way_is_there_at_once() {
    let mut script = Script::new(PLAIN);
    script.go_on(10);
    bring(
        &mut script,
        stiff(100.0),
        Transition::Steps(Steps::new([500.0, 50.0].map(stiff).to_vec(), 1.0)),
    );
    script.next();
    assert_eq!(taken(&script), 2);
    script.command(Command::Engage);
    script.go_on(100);
    let outputs = script.next();
    let deflection = outputs.device_position_m - outputs.block_position_m;
    let damped = 10.0 * (SPEED_MPS - outputs.block_velocity_mps);
    assert_near(
        outputs.coupling_force_n,
        50.0 * deflection + damped,
        "the last one's stiffness",
    );
}

#[test]
fn the_passivity_controller_opposes_the_motion_within_its_limit() {
    let run = |control_n: f64| {
        let mut script = Script::new(Settings {
            passivity_control_n: control_n,
            ..PLAIN
        });
        let tremble = |k: u32| 1e-4 * libm::sin(0.8 * f64::from(k));
        for k in 0..50 {
            script.step(tremble(k));
        }
        script.once.command = Some(Command::Engage);
        let outputs: Vec<Outputs> = (50..200).map(|k| script.step(tremble(k))).collect();
        outputs
    };
    let control_n = 0.5;
    let mut added = 0;
    for (watched, controlled) in run(0.0).iter().zip(&run(control_n)) {
        let difference_n = controlled.force_n - watched.force_n;
        assert!(difference_n.abs() <= control_n + 1e-9, "{watched:?} {controlled:?}");
        // From then on the two are another motion.
        let is_first = added == 0 && difference_n != 0.0;
        let opposes = difference_n * controlled.device_velocity_mps < 0.0;
        assert!(!is_first || opposes, "{watched:?} {controlled:?}");
        added += u32::from(difference_n != 0.0);
    }
    assert!(added > 20, "it added something in {added} steps");
}
