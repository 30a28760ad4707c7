//! What a hand feels on the fake rig, whose guide has friction of its own, with and without the
//! compensation of it.

use device_io::Device;
use device_io::fake::{FakeRig, Hand, HandMotion, RigProperties};
use haptic_core::compensation::Compensation;
use haptic_core::friction::{Friction, Viscous};
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::rig_friction::RigFriction;
use haptic_core::servo::{Command, CompiledScene, Events, Inputs, Servo, Settings};
use haptic_core::{Directional, Renderer, Scene, Scheme, velocity};

const MS: u64 = 1_000_000;

/// What was identified of the fake rig, N.
const IDENTIFIED_N: f64 = 0.8;

fn settings(share: Option<f64>) -> Settings {
    Settings {
        period_s: 1e-3,
        ramp_s: 0.2,
        limits: Limits {
            force_n: 20.0,
            slew_n_per_s: 5000.0,
            speed_mps: 5.0,
            acceleration_mps2: 2000.0,
        },
        losses: RigLosses {
            damping: 0.0,
            friction: IDENTIFIED_N,
        },
        passivity_control_n: 0.0,
        velocity: velocity::Method::AlphaBetaGamma,
        stale_ns: 20 * MS,
        stop_button: None,
        enable_button: None,
        workspace: None,
        compensation: share.map(|share| Compensation {
            share,
            friction: RigFriction {
                mass: 1.4,
                dynamic_force: Directional::both(IDENTIFIED_N),
                viscous: Directional::both(0.0),
                cogging: None,
                uncertainty: None,
            },
        }),
    }
}

/// The hand moves to and fro for 20 s; what it feels beyond the mass of the handle, less the scene:
/// the root of the mean square, N.
fn error_n(scene: &Scene, friction_n: f64, share: Option<f64>) -> f64 {
    let motion = HandMotion::Sine {
        amplitude_m: 0.03,
        frequency_hz: 0.5,
    };
    let properties = RigProperties {
        friction_n,
        ..RigProperties::default()
    };
    let mut rig = FakeRig::new(properties, Hand::Prescribed(motion));
    let renderer = Renderer::new(scene, Scheme::Exact, 1e-3).expect("a valid scene");
    let mut servo = Servo::new(settings(share), Box::new(CompiledScene::at_once(renderer, 1)));
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for tick in 0..21_000_u64 {
        let outputs = servo.step(
            &Inputs {
                elapsed_ns: MS,
                sample: rig.read(tick * MS),
                device_resolution_m: rig.bounds().resolution_m,
                device_force_limit_n: rig.bounds().force_limit_n,
                events: Events::default(),
                command: (tick == 10).then_some(Command::Engage),
            },
            None,
        );
        rig.write(outputs.force_n, outputs.enabled).expect("it is there");
        if tick >= 1000 {
            let felt_n = friction_n * rig.plant().velocity_mps().signum() - outputs.force_n;
            sum += (felt_n - outputs.coupling_force_n).powi(2);
            count += 1.0;
        }
    }
    (sum / count).sqrt()
}

#[test]
fn friction_compensation_brings_felt_force_nearer_scene() {
    let nothing = Scene {
        block: None,
        coupling: None,
        friction: Friction::Viscous(Viscous {
            viscous: Directional::both(0.0),
        }),
        ..Scene::paper()
    };
    let mut light = Scene::paper();
    light = light
        .with(&[("Fs", 1.2), ("Fd", 1.0)].map(|(name, value)| (name.parse().expect("a parameter"), value)))
        .expect("a valid scene");
    println!("rms of felt force less scene, N; a hand at 0.5 Hz and 30 mm; 0.8 N identified");
    println!("| scene | true friction | without | share 0.4 | share 0.8 |\n|---|---|---|---|---|");
    for (name, scene) in [
        ("paper, 3.5 N", &Scene::paper()),
        ("1 N", &light),
        ("no surface", &nothing),
    ] {
        for friction_n in [0.8, 0.6, 0.4] {
            let [without, half, most] = [None, Some(0.4), Some(0.8)].map(|share| error_n(scene, friction_n, share));
            println!("| {name} | {friction_n} N | {without:.3} | {half:.3} | {most:.3} |");
            assert!((without - friction_n).abs() < 0.01, "all of it is felt: {without} N");
            // What was identified too high is overcompensated by as much, and never by more.
            assert!(half < without && half < 0.6 * 0.8 + 0.05, "{half} N");
            if friction_n == 0.8 {
                assert!(most <= half + 0.01, "{most} N, {half} N");
            }
        }
    }
    let best = error_n(&Scene::paper(), 0.8, Some(0.8));
    assert!(best < 0.3 * 0.8, "{best} N");
}
