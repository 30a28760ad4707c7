//! A handle that is left alone, on a rig whose friction is lower than what was identified.

use super::script::PLAIN;
use super::*;
use crate::Directional;
use crate::compensation::{Compensation, MAX_SHARE};
use crate::friction::{Friction, Viscous};
use crate::rig_friction::RigFriction;

const IDENTIFIED_N: f64 = 0.8;

const END_STOP_M: f64 = 0.1;

const END_STOP_N_PER_M: f64 = 8000.0;

const STEP_S: f64 = 1e-3;

/// Steps of the handle's motion in one of the servo.
const SUB_STEPS: u32 = 50;

pub(super) fn compensation(share: f64) -> Compensation {
    Compensation {
        share,
        friction: RigFriction {
            mass: 1.4,
            dynamic_force: Directional::both(IDENTIFIED_N),
            viscous: Directional::both(0.0),
            cogging: None,
            uncertainty: None,
        },
    }
}

/// A handle between two end stops, read by an encoder and moved by a motor.
#[derive(Clone, Debug)]
struct Handle {
    mass: f64,
    friction_n: f64,
    position: f64,
    velocity: f64,
}

impl Handle {
    /// Goes on for a step of the servo; friction stops a motion and does not turn it round.
    fn go_on(&mut self, force_n: f64) {
        let h = STEP_S / f64::from(SUB_STEPS);
        for _ in 0..SUB_STEPS {
            // The end stops are springs, which give all of it back.
            let over_m = self.position - self.position.clamp(-END_STOP_M, END_STOP_M);
            let free = self.velocity + h * (force_n - END_STOP_N_PER_M * over_m) / self.mass;
            let stops = h * self.friction_n / self.mass;
            self.velocity = if free.abs() <= stops {
                0.0
            } else {
                free - libm::copysign(stops, free)
            };
            self.position += h * self.velocity;
        }
    }
}

/// A rig and what is compensated of it.
#[derive(Clone, Copy, Debug)]
struct TestRig {
    /// Real friction over the identified one.
    real: f64,
    share: f64,
    resolution: f64,
    /// Steps from a sample to the force that it leads to.
    delay: usize,
    mass: f64,
    /// Whether there is a surface that holds by a spring; otherwise there is none at all.
    surface: bool,
}

/// Runs a rig whose handle is pushed once, from 1 s to 1.02 s; returns its velocities.
fn push(rig: TestRig, force_n: f64, steps: usize) -> Vec<f64> {
    let mut scene = Scene::paper();
    if rig.surface {
        scene.coupling.as_mut().expect("a coupling").stiffness = 1000.0;
    } else {
        let viscous = Directional::both(0.0);
        (scene.block, scene.coupling, scene.friction) = (None, None, Friction::Viscous(Viscous { viscous }));
    }
    let renderer = Renderer::new(&scene, Scheme::Exact, STEP_S).expect("a valid scene");
    let settings = Settings {
        compensation: Some(compensation(rig.share)),
        ..SETTINGS
    };
    let mut servo = Servo::new(settings, Box::new(CompiledScene::at_once(renderer, 1)));
    let mut handle = Handle {
        mass: rig.mass,
        friction_n: rig.real * IDENTIFIED_N,
        position: 0.0,
        velocity: 0.0,
    };
    let mut waiting = alloc::collections::VecDeque::from(alloc::vec![0.0; rig.delay]);
    let mut velocities = Vec::new();
    for step in 0..steps {
        let counted = libm::round(handle.position / rig.resolution) * rig.resolution;
        let sequence = u32::try_from(step).expect("few");
        let outputs = servo.step(
            &Inputs {
                elapsed_ns: MS,
                sample: Ok(Measurement::new(sequence, u64::from(sequence) * MS, counted)),
                device_resolution_m: rig.resolution,
                device_force_limit_n: f64::INFINITY,
                events: Events::default(),
                command: (step == 10).then_some(Command::Engage),
            },
            None,
        );
        waiting.push_back(outputs.force_n);
        let motor_n = waiting.pop_front().expect("one was put in");
        let hand_n = if (1000..1020).contains(&step) { force_n } else { 0.0 };
        handle.go_on(motor_n + hand_n);
        velocities.push(handle.velocity);
    }
    assert_eq!(servo.state(), RigState::Engaged, "{rig:?}");
    velocities
}

prop_compose! {
    fn rig()(
        real in 0.5..1.3f64, share in 0.0..=MAX_SHARE, resolution in prop::sample::select(&[1e-6, 1e-5, 4e-5][..]),
        delay in 0..3_usize, mass in 0.3..3.0f64, surface in any::<bool>(),
    ) -> TestRig {
        TestRig { real, share, resolution, delay, mass, surface }
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: test_run::extent(24, 200),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Pushed to up to 1 m/s between end stops that throw it back, with a force that comes up to two
    /// steps late, and friction that is down to half of the identified one.
    // hazard: F21
    #[test]
    fn pushed_handle_left_alone_comes_to_rest(
        rig in rig(), speed in 0.05..1.0f64,
    ) {
        // A lighter push than the friction moves nothing.
        let push_n = rig.real * IDENTIFIED_N + speed * rig.mass / 0.02;
        let velocities = push(rig, push_n, 80_000);
        prop_assert!(velocities[1000..1100].iter().any(|velocity| *velocity != 0.0), "it was pushed");
        // All that the push, a full account and the end stops leave to the friction beyond the assured share.
        let rests = |velocities: &[f64]| velocities.iter().all(|velocity| *velocity == 0.0);
        prop_assert!(rests(&velocities[..1000]), "it starts by itself");
        prop_assert!(rests(&velocities[75_000..]), "it goes on, {} m/s", velocities[79_999]);
    }
}

// hazard: F21
#[test]
fn a_stop_and_a_ramp_hold_for_the_compensation_too() {
    let mut without = Script::new(PLAIN);
    let mut with = Script::new(Settings {
        compensation: Some(compensation(0.5)),
        ..PLAIN
    });
    let mut both = |event: Option<Event>, command| {
        for script in [&mut without, &mut with] {
            script.once.events = event.map_or(Events::default(), Events::from);
            script.once.command = command;
        }
        let (without, with) = (without.next(), with.next());
        assert_eq!(
            without.coupling_force_n.to_bits(),
            with.coupling_force_n.to_bits(),
            "the scene is the same"
        );
        (with.force_n - without.force_n, with.force_n)
    };
    for _ in 0..50 {
        assert_eq!(both(None, None), (0.0, 0.0), "without force there is none");
    }
    both(None, Some(Command::Engage));
    let mut gain = 0.0;
    for _ in 0..20 {
        gain = f64::min(gain + 0.05, 1.0);
        let (added, _) = both(None, None);
        assert!(
            (0.0..=gain * 0.5 * IDENTIFIED_N + 1e-9).contains(&added),
            "{added} N at {gain}"
        );
    }
    let added = (0..100).map(|_| both(None, None).0).last().expect("a hundred");
    assert!((added - 0.5 * IDENTIFIED_N).abs() < 1e-9, "{added} N");
    assert_eq!(both(Some(Event::Stop), None), (0.0, 0.0));
    both(None, Some(Command::Reset));
    let (added, _) = both(None, Some(Command::Engage));
    assert_eq!(added, 0.0, "it begins again");
}

#[test]
fn rig_settings_change_only_while_no_force_flows() {
    let mut script = Script::engaged(PLAIN);
    let losses = RigLosses {
        damping: 0.0,
        friction: 0.1,
    };
    let added = |outputs: Outputs| outputs.force_n + outputs.coupling_force_n;
    script.servo.set_rig(losses, Some(compensation(0.8)));
    script.go_on(50);
    assert_eq!(added(script.next()), 0.0, "not now");
    script.command(Command::Release);
    script.until_released();
    script.servo.set_rig(losses, Some(compensation(0.8)));
    assert_eq!(script.servo.settings().losses, losses);
    script.command(Command::Engage);
    script.go_on(200);
    assert!((added(script.next()) - 0.8 * IDENTIFIED_N).abs() < 1e-9);
    // It gives more than this rig is set to take up: 0.64 N against 0.1 N, over a tenth of a millimetre a step.
    let before_j = script.next().energy_excess_j;
    script.go_on(99);
    let grown_j = script.next().energy_excess_j - before_j;
    assert!((grown_j - 0.54 * 1e-4 * 100.0).abs() < 5e-5, "{grown_j} J");
}
