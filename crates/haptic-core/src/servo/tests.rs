//! The servo as a value: stepped through the same inputs it gives the same outputs, to the last bit.

extern crate std;

mod compensation;
mod forces;
mod motion;
mod script;
mod states;

use self::script::Script;
use super::*;
use crate::compensation::Compensation;
use crate::friction::LAWS;
use crate::limiter::Limits;
use crate::passivity::RigLosses;
use crate::sample::{DeviceError, Measurement, Motor};
use crate::snapshot::FieldValue;
use crate::velocity::{self, METHODS};
use crate::{Renderer, Scene, Scheme};
use alloc::boxed::Box;
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::ToString;
use alloc::vec::Vec;
use proptest::prelude::*;

const MS: u64 = 1_000_000;

/// What the tests have in common.
const SETTINGS: Settings = Settings {
    period_s: 1e-3,
    ramp_s: 0.02,
    limits: Limits {
        force_n: 20.0,
        slew_n_per_s: 5000.0,
        speed_mps: 5.0,
        acceleration_mps2: 2000.0,
    },
    losses: RigLosses {
        damping: 0.0,
        friction: 0.0,
    },
    passivity_control_n: 0.0,
    velocity: velocity::Method::AlphaBetaGamma,
    stale_ns: 50 * MS,
    stop_button: None,
    enable_button: None,
    workspace: None,
    compensation: None,
};

/// Numbers that depend on nothing but where they begin.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> u64 {
        // Knuth's MMIX generator; its upper bits are the good ones.
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    fn below(&mut self, end: u64) -> u64 {
        self.roll() % end
    }

    #[expect(clippy::cast_precision_loss, reason = "31 bits")]
    fn share(&mut self) -> f64 {
        self.roll() as f64 / (1_u64 << 31) as f64
    }
}

/// Another of a scene's kind.
type Vary = fn(Scene, &mut Dice) -> Scene;

/// Every law behind a block and on the device, by both schemes.
fn scene_with(dice: &mut Dice, revision: u64, vary: Vary) -> Box<CompiledScene> {
    let mut scene = Scene::paper();
    if dice.below(3) == 0 {
        (scene.block, scene.coupling) = (None, None);
    }
    let law = LAWS[usize::try_from(dice.below(LAWS.len() as u64)).expect("small")];
    let scene = vary(scene.with_law(law).expect("a law").expect("a scene"), dice);
    let scheme = if dice.below(4) == 0 {
        Scheme::LITERAL
    } else {
        Scheme::Exact
    };
    let renderer = Renderer::new(&scene, scheme, 1e-3).expect("a valid scene");
    let transition = match dice.below(4) {
        0 => Transition::Fade { over_s: 0.02 },
        1 => Transition::Steps(Steps::new(alloc::vec![renderer.clone(); 5], 0.02)),
        _ => Transition::AtOnce,
    };
    Box::new(CompiledScene {
        renderer,
        revision,
        transition,
    })
}

/// Steps a servo through a motion and through everything that can happen, all of it decided by a
/// seed; returns the bits of all outputs. After each step another servo may take the place of the one that was
/// stepped. It is given what compiles the scene of a revision again.
fn run_with(
    seed: u64,
    steps: u32,
    vary: Vary,
    compensation: Option<Compensation>,
    mut after: impl FnMut(Servo, &dyn Fn(u64) -> Box<CompiledScene>) -> Servo,
) -> Vec<u64> {
    let mut dice = Dice(seed);
    let settings = Settings {
        losses: RigLosses {
            damping: 0.1,
            friction: 0.2,
        },
        passivity_control_n: 2.0,
        velocity: METHODS[usize::try_from(dice.below(5)).expect("small")],
        stop_button: Some(0),
        compensation,
        ..SETTINGS
    };
    let mut seeds = alloc::vec![0, dice.0];
    let mut servo = Servo::new(settings, scene_with(&mut dice, 1, vary));
    let (mut time_ns, mut phase, mut revision) = (0_u64, 0.0_f64, 1);
    let mut bits = Vec::new();
    for sequence in 0..steps {
        let elapsed_ns = MS + dice.below(200_000) - 100_000;
        time_ns += elapsed_ns;
        phase += 1e-3 * core::f64::consts::TAU * (2.0 + 8.0 * dice.share());
        // A hand that is counted by 10 um.
        let position_m = 1e-5 * libm::round(3e-3 * libm::sin(phase) / 1e-5);
        let happening = dice.below(400);
        let sample = match happening {
            0 => Err(DeviceError::Disconnected),
            1 => Err(DeviceError::MotorOff { watchdog: true }),
            _ => Ok(Measurement {
                buttons: u8::from(happening == 2),
                ..Measurement::new(sequence, time_ns, position_m)
            }),
        };
        let inputs = Inputs {
            elapsed_ns,
            sample,
            device_resolution_m: 1e-5,
            device_force_limit_n: 15.0,
            events: match happening {
                3 => Event::Stop.into(),
                4 => Event::LeaseLapsed.into(),
                5 => Event::ControlLost.into(),
                6 => Event::TooLate.into(),
                7 => Event::Slept.into(),
                _ => Events::default(),
            },
            command: match happening {
                8 => Some(Command::Release),
                9..40 => Some(Command::Reset),
                40..80 => Some(Command::Engage),
                _ => None,
            },
        };
        let new = (80..90).contains(&happening).then(|| {
            revision += 1;
            seeds.push(dice.0);
            scene_with(&mut dice, revision, vary)
        });
        let outputs = servo.step(&inputs, new);
        while servo.take_retired().is_some() {}
        if happening == 90 {
            servo.disconnect();
        }
        bits.extend(
            [
                outputs.force_n,
                outputs.coupling_force_n,
                outputs.device_position_m,
                outputs.device_velocity_mps,
                outputs.block_position_m,
                outputs.block_velocity_mps,
                outputs.energy_excess_j,
            ]
            .map(f64::to_bits),
        );
        bits.push(servo.state() as u64 | u64::from(outputs.refused) << 8 | u64::from(outputs.enabled) << 9);
        bits.push(u64::from(outputs.contact.cast_unsigned()));
        servo = after(servo, &|revision| {
            let seed = seeds[usize::try_from(revision).expect("small")];
            scene_with(&mut Dice(seed), revision, vary)
        });
    }
    bits
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever its scenes, its estimate of velocity, its rig's compensation and its state are.
    #[test]
    fn a_servo_goes_on_from_a_snapshot_to_the_last_bit(seed in any::<u64>(), compensates: bool) {
        let compensation = compensates.then(|| compensation::compensation(0.5));
        // What a law has beside its defaults: a limit that rises at rest, a curve, the other scheme.
        let vary: Vary = |scene, dice| {
            let karnopp = dice.below(2) == 0;
            let law = if karnopp { "karnopp" } else { scene.friction.law() };
            let mut scene = scene.with_law(law).expect("a law").expect("a scene");
            for (name, value) in [("rising_rate", 50.0), ("stribeck_velocity", 0.2), ("Fs+", 5.0)] {
                let key = name.parse().expect("a key");
                scene = match scene.with(&[(key, value)]) {
                    Ok(varied) if dice.below(2) == 0 => varied,
                    _ => scene,
                };
            }
            scene
        };
        let mut dice = Dice(!seed);
        let mut restored = 0;
        let with_others = run_with(seed, 1500, vary, compensation, |mut servo, compiled| {
            if dice.below(5) != 0 {
                return servo;
            }
            restored += 1;
            let snapshot = servo.snapshot().expect("no motion of its own");
            let fields: BTreeMap<_, _> = snapshot.fields().collect();
            let fading = snapshot.fading_revision.map(compiled);
            let scene = compiled(snapshot.revision);
            let other = Servo::restored(*servo.settings(), scene, fading, &|name| fields.get(name).copied());
            let mut other = other.expect("all fields are there");
            let again = other.snapshot().expect("no motion of its own");
            assert_eq!(format!("{again:?}"), format!("{snapshot:?}"));
            other
        });
        prop_assert!(restored > 20);
        prop_assert_eq!(with_others, run_with(seed, 1500, vary, compensation, |servo, _| servo));
    }
}

/// What is missing or cannot be is named.
#[test]
fn damaged_snapshot_is_refused_by_the_name_of_its_field() {
    let mut script = Script::new(SETTINGS);
    script.next();
    let snapshot = script.servo.snapshot().expect("no motion of its own");
    let restored = |name: &str, value: Option<FieldValue>| {
        let mut fields: BTreeMap<_, _> = snapshot.fields().collect();
        assert!(fields.remove(name).is_some(), "there is no {name}");
        fields.extend(value.map(|value| (name.into(), value)));
        let servo = Servo::restored(SETTINGS, paper(), None, &|name| fields.get(name).copied());
        servo.expect_err("it is damaged").to_string()
    };
    assert_eq!(restored("limiter.last_N", None), "the snapshot lacks limiter.last_N");
    for (value, expected) in [(FieldValue::Count(9), "9"), (FieldValue::Number(0.5), "0.5")] {
        assert_eq!(
            restored("scene.contact", Some(value)),
            format!("the snapshot has no such value of scene.contact as {expected}")
        );
    }
}

/// The number is the same in every build and on every machine: `.ci/full` has it computed with and
/// without optimisation. It changes with the physics, and with nothing else. A law of each kind of contact stands for
/// all: `tests/physics/same_everywhere.rs` pins each.
#[test]
fn every_build_gives_the_same_force_to_the_last_bit() {
    let vary: Vary = |scene, dice| {
        let law = ["karnopp", "lugre", "viscous"][usize::try_from(dice.below(3)).expect("small")];
        let Scene { block, coupling, .. } = scene;
        let plain = Scene {
            block,
            coupling,
            ..Scene::paper()
        };
        plain.with_law(law).expect("a law").expect("a scene")
    };
    let (mut digest, mut live) = (0xcbf2_9ce4_8422_2325_u64, 0);
    for seed in 0..20 {
        let bits = run_with(seed, 3000, vary, None, |servo, _| servo);
        live += bits.chunks(9).filter(|step| f64::from_bits(step[0]) != 0.0).count();
        for word in bits {
            // FNV-1a, a word at a time.
            digest = (digest ^ word).wrapping_mul(0x0100_0000_01b3);
        }
    }
    assert!(live > 20_000, "force flowed in {live} of 60,000 steps");
    assert_eq!(digest, 0xbf5a_6024_3a13_ff1f, "{digest:#018x}");
}

/// The paper's scene.
fn paper() -> Box<CompiledScene> {
    let renderer = Renderer::new(&Scene::paper(), Scheme::Exact, 1e-3).expect("a valid scene");
    Box::new(CompiledScene::at_once(renderer, 1))
}

/// The paper's scene with another stiffness, N/m.
fn stiff(stiffness: f64) -> Renderer {
    let mut scene = Scene::paper();
    scene.coupling.as_mut().expect("a coupling").stiffness = stiffness;
    Renderer::new(&scene, Scheme::Exact, 1e-3).expect("a valid scene")
}

fn soft(revision: u64, transition: Transition) -> Box<CompiledScene> {
    Box::new(CompiledScene {
        renderer: stiff(100.0),
        revision,
        transition,
    })
}

// hazard: P9
#[test]
fn a_step_of_force_that_was_fading_is_gone_after_a_stop() {
    let mut script = Script::engaged(SETTINGS);
    // Too soft to hold within 20 mm what the one before held.
    script.once.scene = Some(soft(2, Transition::AtOnce));
    script.go_on(6);
    assert!(script.servo.offset.fade(0.0) != 0.0, "a step of force is fading");
    script.once.events = Event::Stop.into();
    let outputs = script.next();
    assert_eq!((outputs.coupling_force_n, outputs.force_n), (0.0, 0.0));
    assert_eq!(
        outputs.block_position_m, outputs.device_position_m,
        "the block is at the hand at once"
    );
    assert_eq!(script.servo.offset.fade(0.0), 0.0);
}

#[test]
fn every_scene_that_goes_is_handed_back_once() {
    let mut script = Script::engaged(SETTINGS);
    let fade = || Transition::Fade { over_s: 0.01 };
    let mut back = Vec::new();
    let bring = |script: &mut Script, scene| {
        script.once.scene = Some(scene);
        script.next();
    };
    bring(&mut script, soft(2, fade()));
    assert!(script.servo.take_retired().is_none(), "the first one still fades out");
    bring(&mut script, soft(3, fade()));
    back.extend(script.servo.take_retired().map(|scene| scene.revision));
    bring(&mut script, soft(4, Transition::AtOnce));
    assert!(script.servo.has_retired());
    while let Some(scene) = script.servo.take_retired() {
        back.push(scene.revision);
    }
    bring(&mut script, soft(5, fade()));
    script.go_on(13);
    back.extend(script.servo.take_retired().map(|scene| scene.revision));
    assert_eq!(back, [1, 2, 3, 4]);
    assert_eq!(script.servo.scene().revision, 5);
    assert!(!script.servo.has_retired());
}

// hazard: H16
#[test]
fn after_silence_decays_force_scene_restarts_at_hand() {
    let mut script = Script::engaged(SETTINGS);
    assert!(script.next().coupling_force_n.abs() > 3.0, "the hand drags the block");
    let last = (0..41).map(|_| script.repeat().force_n).last();
    assert_eq!(last, Some(0.0), "all force has decayed");
    // The hand has moved on by 4 mm meanwhile.
    script.once.device_elapsed_ns = 41 * MS;
    let outputs = script.next();
    assert_eq!((outputs.coupling_force_n, outputs.force_n), (0.0, 0.0), "{outputs:?}");
    assert_eq!(script.servo.state(), RigState::Engaged);
    script.go_on(5);
    let next = script.next();
    assert!(
        next.force_n != 0.0 && next.force_n.abs() < 1.0,
        "it comes back slowly: {next:?}"
    );
}

#[test]
fn an_engagement_after_a_silence_is_as_any_other() {
    let force = |silent: u64| {
        let mut script = Script::engaged(SETTINGS);
        for _ in 0..silent {
            script.repeat();
        }
        script.once.device_elapsed_ns = (silent + 1) * MS;
        script.command(Command::Release);
        script.go_on(100);
        assert_eq!(script.servo.state(), RigState::Idle);
        script.command(Command::Engage);
        script.go_on(21);
        script.next().force_n
    };
    let (usual, after_silence) = (force(0), force(30));
    assert!(
        (usual / after_silence - 1.0).abs() < 1e-6,
        "{usual} N, {after_silence} N"
    );
}

// hazard: H16
#[test]
fn a_device_may_repeat_itself_for_the_stale_time_and_no_longer() {
    let repeated = |script: &mut Script, longer_ns: u64| {
        script.once.elapsed_ns = 49 * MS;
        script.repeat();
        script.once.elapsed_ns = MS + longer_ns;
        let force_n = script.repeat().force_n;
        (script.servo.state(), script.servo.fault(), force_n)
    };
    let mut script = Script::engaged(SETTINGS);
    assert_eq!(repeated(&mut script, 0), (RigState::Engaged, None, 0.0));
    let mut script = Script::engaged(SETTINGS);
    assert_eq!(repeated(&mut script, 1), (RigState::Faulted, Some(Fault::Stale), 0.0));
    script.command(Command::Reset);
    assert_eq!(script.servo.state(), RigState::Idle);
    assert_eq!(repeated(&mut script, 1), (RigState::Disconnected, None, 0.0));
}

// hazard: H9
#[test]
fn motor_still_on_after_timeout_raises_alarm() {
    for (longer_ns, fault) in [
        (0, None),
        (1, Some(Fault::StillEnabled)),
        (7 * MS, Some(Fault::StillEnabled)),
    ] {
        let mut script = Script::new(SETTINGS);
        for _ in 0..300 {
            script.fail(DeviceError::Disconnected);
        }
        script.sample.motor = Motor::Enabled;
        // The time begins with the first sample.
        script.go_on(91);
        // A release is not a reset: the time goes on.
        script.command(Command::Release);
        script.go_on(8);
        assert_eq!(script.servo.fault(), None);
        script.once.elapsed_ns = MS + longer_ns;
        script.next();
        assert_eq!(script.servo.fault(), fault, "{longer_ns} ns longer");
    }
}
