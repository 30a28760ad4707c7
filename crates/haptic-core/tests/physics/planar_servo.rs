//! The servo in the plane: a turned world gives turned forces, a line in it is a line, and limits are limits of length.

use crate::random::Random;
use haptic_core::block::Coupling;
use haptic_core::compensation::Compensation;
use haptic_core::friction::{Friction, Karnopp, Reseat, Viscous};
use haptic_core::limiter::{Limits, SafetyLimiter};
use haptic_core::passivity::RigLosses;
use haptic_core::planar::{PlanarRenderer, Plane, Workspace};
use haptic_core::rig_friction::RigFriction;
use haptic_core::sample::Measurement;
use haptic_core::scene::Block;
use haptic_core::servo::{Command, CompiledScene, Events, Inputs, Outputs, RigState, Servo, Settings};
use haptic_core::{Directional, OwnMotion, PulseShape, Rendering, Scene, Scheme, Vector, velocity};
use std::collections::BTreeMap;

const T: f64 = 1e-3;
const TICK_NS: u64 = 1_000_000;
const TICKS: u32 = 600;

fn settings(random: &mut Random) -> Settings {
    Settings {
        period_s: T,
        ramp_s: 0.05,
        limits: Limits {
            // Now and then within what the scenes make.
            force_n: random.decades(1.0, 20.0),
            slew_n_per_s: random.decades(200.0, 50_000.0),
            ..Limits::default()
        },
        losses: RigLosses::default(),
        passivity_control_n: random.one_of(&[0.0, 2.0]),
        velocity: velocity::Method::FiniteDifference,
        stale_ns: 50 * TICK_NS,
        stop_button: None,
        enable_button: None,
        workspace: None,
        compensation: None,
    }
}

/// A step with a hand at a place, m.
fn inputs<V: Vector>(tick: u32, hand: V, command: Option<Command>) -> Inputs<V> {
    Inputs {
        elapsed_ns: TICK_NS,
        sample: Ok(Measurement::new(tick, u64::from(tick) * TICK_NS, hand)),
        device_resolution_m: 1e-6,
        device_force_limit_n: f64::INFINITY,
        events: Events::default(),
        command,
    }
}

fn scene(random: &mut Random) -> Scene {
    let dynamic = random.decades(0.3, 5.0);
    let friction = if random.one_in(4) {
        Friction::Viscous(Viscous {
            viscous: Directional::both(random.decades(1.0, 30.0)),
        })
    } else {
        Friction::Karnopp(Karnopp {
            viscous: Directional::both(random.one_of(&[0.0, 0.5, 3.0])),
            velocity_threshold: random.one_of(&[0.0, 0.0, 0.01, 0.1]),
            ..Karnopp::new(dynamic * random.one_of(&[1.0, 1.1, 1.5]), dynamic)
        })
    };
    let on_device = random.one_in(2);
    let held = (!on_device).then(|| (random.decades(0.05, 1.0), random.decades(500.0, 10_000.0)));
    Scene {
        name: String::new(),
        block: held.map(|(mass, _)| Block { mass }),
        coupling: held.map(|(_, stiffness)| Coupling {
            stiffness,
            damping: random.between(1.0, 10.0),
        }),
        friction,
    }
}

/// What a servo goes through: scenes that follow each other, and where the hand is.
struct Story {
    settings: Settings,
    scenes: Vec<Scene>,
    ramp_s: f64,
    /// Radius, m, and angular speed, 1/s, of circles that the hand draws at once.
    circles: [(f64, f64, f64); 3],
    /// Ticks whose reading is wrong, and by how much, m.
    glitches: Vec<(u32, Plane)>,
}

impl Story {
    fn new(random: &mut Random) -> Self {
        Self {
            settings: settings(random),
            scenes: (0..4).map(|_| scene(random)).collect(),
            ramp_s: random.one_of(&[0.0, 0.05]),
            circles: [(); 3].map(|()| {
                (
                    random.decades(1e-3, 0.02),
                    random.between(-15.0, 15.0),
                    random.between(0.0, 6.0),
                )
            }),
            glitches: Vec::new(),
        }
    }

    /// The same with wrong readings, some too near for the limits of a rig to tell, and now and then a hand that is too
    /// fast.
    fn doubtful(random: &mut Random) -> Self {
        let mut story = Self::new(random);
        story.glitches = (1..7)
            .map(|index| {
                let (size, angle) = (random.decades(2e-4, 1e-2), random.between(0.0, 6.3));
                (80 * index, Plane::new(angle.cos(), angle.sin()) * size)
            })
            .collect();
        if random.one_in(4) {
            story.settings.limits.speed_mps = random.between(0.05, 0.3);
        }
        // In the plane it is not compensated.
        let friction = RigFriction {
            mass: 1.0,
            dynamic_force: Directional::both(1.0),
            viscous: Directional::both(0.0),
            cogging: None,
            uncertainty: None,
        };
        story.settings.compensation = Some(Compensation { share: 0.8, friction });
        story
    }

    fn hand(&self, tick: u32) -> Plane {
        let time_s = f64::from(tick) * T;
        let glitch = self.glitches.iter().find(|(at, _)| *at == tick);
        let start = glitch.map_or(Plane::ZERO, |(_, by)| *by);
        self.circles.iter().fold(start, |sum, (radius, omega, phase)| {
            let angle = omega * time_s + phase;
            sum + Plane::new(angle.cos(), angle.sin()) * *radius
        })
    }

    /// The outputs of a servo whose hand is at `place` of that.
    fn outputs<V: Vector>(&self, place: impl Fn(Plane) -> V) -> Vec<Outputs<V>> {
        let compiled = |from: usize, to: usize| {
            CompiledScene::ramped(
                &self.scenes[from],
                &self.scenes[to],
                to as u64,
                Scheme::Exact,
                T,
                self.ramp_s,
            )
            .map(Box::new)
            .expect("it can be rendered")
        };
        let mut servo = Servo::<V>::new(self.settings, compiled(0, 0));
        (0..TICKS)
            .map(|tick| {
                let command = match tick {
                    20 => Some(Command::Engage),
                    550 => Some(Command::Release),
                    _ => None,
                };
                let mut inputs = inputs(tick, place(self.hand(tick)), command);
                if tick == 10 {
                    // By the device's clock it has not: nothing is known of the velocity.
                    inputs.elapsed_ns = 60 * TICK_NS;
                }
                let index = tick as usize / 150;
                let scene = (tick > 0 && tick % 150 == 0).then(|| compiled(index - 1, index));
                let outputs = servo.step(&inputs, scene);
                while servo.take_retired().is_some() {}
                outputs
            })
            .collect()
    }
}

#[test]
fn turned_hand_feels_turned_forces() {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let (mut worst, mut forceful) = (0.0_f64, 0);
    for _ in 0..60 {
        let story = Story::doubtful(&mut random);
        let (sin, cos) = random.between(0.0, 6.3).sin_cos();
        let turned = |place: Plane| Plane::new(cos * place.x - sin * place.y, sin * place.x + cos * place.y);
        for (plain, other) in story.outputs(|place| place).iter().zip(story.outputs(turned)) {
            assert_eq!((plain.enabled, plain.contact), (other.enabled, other.contact));
            worst = worst.max((turned(plain.force_n) - other.force_n).length());
            let apart_m = turned(plain.device_position_m) - other.device_position_m;
            assert!(apart_m.length() < 1e-12, "one was believed and the other was not");
            forceful += u32::from(plain.force_n.length() > 0.1);
        }
    }
    println!("largest difference {worst:.1e} N, {forceful} ticks with force");
    assert!(forceful > 10_000 && worst < 1e-9, "{worst} N");
}

#[test]
fn hand_on_a_line_of_the_plane_feels_the_line() {
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    for _ in 0..40 {
        let story = Story::new(&mut random);
        let (sin, cos) = random.between(0.0, 6.3).sin_cos();
        let along = Plane::new(cos, sin);
        let line = story.outputs(|place| place.x);
        for (line, plane) in line.iter().zip(story.outputs(|place| along * place.x)) {
            let apart_n = (along * line.force_n - plane.force_n).length();
            assert!(apart_n < 1e-9 && line.enabled == plane.enabled, "{apart_n} N");
            let apart_mps = (along * line.device_velocity_mps - plane.device_velocity_mps).length();
            assert!(apart_mps < 1e-9, "{apart_mps} m/s");
        }
    }
}

/// Forces within a limit whose steps are within another, of which zero at once.
// hazard: H31
#[test]
fn limits_of_force_and_slew_are_limits_of_length() {
    let mut random = Random(0x0dd0_b175_c0ff_ee11);
    let force = |random: &mut Random| Plane::new(random.between(-15.0, 15.0), random.between(-15.0, 15.0));
    for _ in 0..100_000 {
        let limits = Limits {
            force_n: random.decades(0.5, 12.0),
            slew_n_per_s: random.decades(10.0, 30_000.0),
            ..Limits::default()
        };
        let mut limiter = SafetyLimiter::new(limits);
        // Without a limit on the time it goes to the first force at once.
        let last = limiter.limit(force(&mut random), 1.0, 1e6).expect("a number");
        let wanted = force(&mut random);
        let reached = limiter.limit(wanted, 1.0, T).expect("a number");
        let (step, size) = (limits.slew_n_per_s * T, last.length());
        assert!(reached.length() <= limits.force_n && size <= limits.force_n);
        // A place between zero and a disk about the last force is in the disk of a part of both.
        let square = size * size - step * step;
        let part = if square > 0.0 {
            (reached.dot(last) / square).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let beyond = (reached - last * part).length() - part * step;
        assert!(
            beyond < 1e-12,
            "{beyond} N beyond: {last:?} {wanted:?} {reached:?} {step}"
        );
        // No other force that may be reached is nearer to what is wanted.
        let aim = wanted.within(limits.force_n);
        let (angle, share) = (random.between(0.0, 6.3), random.share());
        let other = (last + Plane::new(angle.cos(), angle.sin()) * step) * share;
        let nearness = (reached - aim).length() - (other - aim).length();
        assert!(
            nearness < 1e-9,
            "{nearness} N farther: {last:?} {wanted:?} {reached:?} {step}"
        );
        let along = last * (1.0 / size);
        let line = (aim.dot(along)).reached_from(size, step);
        let of_line = (along * aim.dot(along)).reached_from(last, step);
        assert!((along * line - of_line).length() < 1e-12, "{line} {of_line:?}");
    }
}

/// An encoder of one axis that errs for a sample makes nothing of either.
// hazard: H32
#[test]
fn one_bad_encoder_holds_the_sample_of_both_axes() {
    let mut random = Random(7);
    let story = Story::new(&mut random);
    let bad = story.hand(300);
    let honest = story.outputs(|place| place);
    let seen = story.outputs(|place| {
        if place == bad {
            place + Plane::new(0.0, 5e-3)
        } else {
            place
        }
    });
    assert_eq!(seen[300].device_position_m, seen[299].device_position_m, "held whole");
    assert_eq!(seen[299], honest[299]);
    assert_eq!(
        seen[301].device_position_m, honest[301].device_position_m,
        "and forgotten"
    );
}

#[test]
fn restored_planar_servo_goes_on_to_the_last_bit() {
    let mut random = Random(11);
    let story = Story::new(&mut random);
    let paper = Scene::paper();
    let drag = Scene {
        block: None,
        coupling: None,
        friction: Friction::Viscous(Viscous {
            viscous: Directional::both(10.0),
        }),
        ..paper.clone()
    };
    let compiled = |scene: &Scene, revision, ramp_s| {
        let compiled = CompiledScene::<Plane>::ramped(&paper, scene, revision, Scheme::Exact, T, ramp_s);
        Box::new(compiled.expect("it can be rendered"))
    };
    let (block, fading_in) = (|| compiled(&paper, 1, 0.0), || compiled(&drag, 2, 0.05));
    let inputs = |tick| inputs(tick, story.hand(tick), (tick == 20).then_some(Command::Engage));
    for method in velocity::METHODS {
        let settings = Settings {
            velocity: method,
            ..story.settings
        };
        let mut servo = Servo::<Plane>::new(settings, block());
        for tick in 0..300 {
            // The longest snapshot: one scene fades into the other.
            servo.step(&inputs(tick), (tick == 280).then(fading_in));
        }
        assert_eq!(servo.state(), RigState::Engaged);
        let snapshot = servo.snapshot().expect("no motion");
        assert_eq!((snapshot.revision, snapshot.fading_revision), (2, Some(1)));
        let fields: BTreeMap<_, _> = snapshot.fields().collect();
        let find = |name: &str| fields.get(name).copied();
        let mut other = Servo::restored(settings, fading_in(), Some(block()), &find).expect("its own fields");
        for tick in 300..TICKS {
            assert_eq!(servo.step(&inputs(tick), None), other.step(&inputs(tick), None));
        }
    }
}

#[test]
fn what_a_plane_has_not_is_refused_by_name_and_reason() {
    let refused = |scene: &Scene, scheme: Scheme| -> String {
        let compiled = CompiledScene::<Plane>::ramped(scene, scene, 1, scheme, T, 0.0);
        compiled.expect_err("a plane has it not").to_string()
    };
    let paper = Scene::paper();
    let with = |change: fn(&mut Karnopp)| {
        let mut scene = paper.clone();
        if let Friction::Karnopp(law) = &mut scene.friction {
            change(law);
        }
        refused(&scene, Scheme::Exact)
    };
    assert_eq!(
        with(|law| law.static_force = Directional {
            positive: 4.0,
            negative: 5.0
        }),
        "static_force differs by direction, and in the plane there is none: set `static_force` alone"
    );
    assert_eq!(
        with(|law| law.stribeck_velocity = 0.01),
        "stribeck_velocity = 0.01 m/s is for a rig of one axis: in the plane it must be 0"
    );
    let on_device = Scene {
        block: None,
        coupling: None,
        friction: Friction::Karnopp(Karnopp {
            reseat: Some(Reseat::Slides),
            ..Karnopp::new(4.0, 3.5)
        }),
        ..paper.clone()
    };
    assert_eq!(
        refused(&on_device, Scheme::Exact),
        "reseat = slides is for a rig of one axis: in the plane it must be continuous"
    );
    let dahl = paper.with_law("dahl").expect("a law").expect("a scene");
    assert_eq!(
        refused(&dahl, Scheme::Exact),
        "the law `dahl` is for a rig of one axis: in the plane there are karnopp and viscous"
    );
    assert!(refused(&paper, Scheme::Implicit).starts_with("the scheme `implicit` is for a rig of one axis"));
    let compiled = CompiledScene::<Plane>::ramped(&dahl, &paper, 1, Scheme::Exact, T, 0.0);
    assert!(compiled.is_ok(), "where it comes from is not rendered");
}

/// The anchor of the hand's spring, followed in steps so small that each is straight for it.
fn dragged_in_steps(path: &[Plane], stiffness: f64, limit: f64) -> Plane {
    const STEPS: u32 = 20_000;
    let mut anchor = path[0];
    for pair in path.windows(2) {
        for step in 1..=STEPS {
            let hand = pair[0] + (pair[1] - pair[0]) * (f64::from(step) / f64::from(STEPS));
            let stretch = hand - anchor;
            let beyond = stretch.length() - limit / stiffness;
            if beyond > 0.0 {
                anchor += stretch.pointing(beyond);
            }
        }
    }
    (path[path.len() - 1] - anchor) * stiffness
}

/// With `Fs = Fd` the friction on the device is the pull of an anchor at the end of a string.
#[test]
fn dragged_spring_follows_its_tractrix() {
    let mut random = Random(0x5eed);
    let (stiffness, limit) = (5000.0, 2.0);
    for _ in 0..20 {
        let mut scene = Scene::paper();
        (scene.block, scene.coupling) = (None, None);
        scene.friction = Friction::Karnopp(Karnopp {
            contact_stiffness: Some(stiffness),
            ..Karnopp::new(limit, limit)
        });
        let mut path = vec![Plane::ZERO];
        for _ in 0..6 {
            let by = Plane::new(random.between(-1e-3, 1e-3), random.between(-1e-3, 1e-3));
            path.push(path[path.len() - 1] + by);
        }
        let mut renderer = PlanarRenderer::new(&scene, Scheme::Exact, T).expect("it can be rendered");
        renderer.start_at(Plane::ZERO, Plane::ZERO);
        let mut force = Plane::ZERO;
        for pair in path.windows(2) {
            force = renderer.render(T, pair[1], (pair[1] - pair[0]) * (1.0 / T));
        }
        let expected = dragged_in_steps(&path, stiffness, limit);
        assert!((force - expected).length() < 1e-3, "{force:?} for {expected:?}");
    }
}

/// A servo of one scene, which its limits hardly hold back.
fn servo_of(scene: &Scene, workspace: Option<Workspace>) -> Servo<Plane> {
    let settings = Settings {
        workspace,
        limits: Limits::default(),
        passivity_control_n: 0.0,
        ..settings(&mut Random(3))
    };
    Servo::new(settings, compiled(scene))
}

fn compiled(scene: &Scene) -> Box<CompiledScene<Plane>> {
    let compiled = CompiledScene::ramped(scene, scene, 1, Scheme::Exact, T, 0.0);
    Box::new(compiled.expect("it can be rendered"))
}

/// A servo with a workspace from -10 to 10 mm, whose hand goes out of it along an axis and comes back; forces by tick,
/// along that axis and along the other. Where `is_restored`, every seventh tick another servo goes on from a snapshot.
fn forces_out_and_back(scene: &Scene, along_y: bool, is_restored: bool) -> Vec<(Plane, Plane)> {
    let placed = |place: Plane| if along_y { Plane::new(place.y, place.x) } else { place };
    let ends_m = [-0.01, 0.01];
    let workspace = Workspace {
        x_m: ends_m,
        y_m: ends_m,
    };
    let mut servo = servo_of(scene, Some(workspace));
    (0..1000_u32)
        .map(|tick| {
            // 15 mm there and back, within half a second each way.
            let phase = f64::from(tick) * T * std::f64::consts::TAU;
            let hand = Plane::new(0.0075 * (1.0 - phase.cos()), 0.003);
            if is_restored && tick % 7 == 6 {
                let fields: BTreeMap<_, _> = servo.snapshot().expect("no motion").fields().collect();
                let restored = Servo::restored(*servo.settings(), compiled(scene), None, &|name| {
                    fields.get(name).copied()
                });
                servo = restored.expect("its own fields");
            }
            let outputs = servo.step(
                &inputs(tick, placed(hand), (tick == 5).then_some(Command::Engage)),
                None,
            );
            assert!(outputs.enabled || tick < 5, "outside is no fault");
            (hand, placed(outputs.force_n))
        })
        .collect()
}

// hazard: H34
#[test]
fn force_ends_outside_the_workspace_and_returns_without_a_step() {
    let paper = Scene {
        coupling: Some(Coupling {
            stiffness: 5000.0,
            damping: 10.0,
        }),
        ..Scene::paper()
    };
    let stuck = Scene {
        // Held for the whole path.
        friction: Friction::Karnopp(Karnopp::new(50.0, 40.0)),
        ..paper.clone()
    };
    for scene in [paper, stuck] {
        let forces = forces_out_and_back(&scene, false, false);
        assert_eq!(
            forces,
            forces_out_and_back(&scene, true, false),
            "each axis has its ends"
        );
        assert_eq!(
            forces,
            forces_out_and_back(&scene, false, true),
            "a snapshot has it all"
        );
        let outside = |tick: usize| forces[tick].0.x > 0.01;
        let (left, back) = (
            (0..1000).find(|tick| outside(*tick)).expect("it goes out"),
            (0..1000).rfind(|tick| outside(*tick)).expect("it goes out") + 1,
        );
        assert!(forces[left - 1].1.length() > 3.0, "force flows inside");
        for (_, force) in &forces[left + 22..back] {
            assert_eq!(*force, Plane::ZERO, "outside it has gone within 20 ms");
        }
        let slew_n = Limits::default().slew_n_per_s * T;
        for tick in 1..1000 {
            let (before, now) = (forces[tick - 1].1, forces[tick].1);
            let grown = now.length() - before.length();
            assert!(grown <= slew_n + 1e-9, "{tick}: {grown} N in a tick");
            if tick >= back && tick < back + 10 {
                assert!(now.length() < 1.5, "{tick}: it comes back over 50 ms, {now:?}");
            }
        }
        assert!(forces[999].1.length() > 1.0, "force flows again");
    }
}

/// A pulse on a handle that goes aside, as one on swapped motors does, ends within the bounds of every pulse.
// hazard: H33
#[test]
fn pulse_on_a_handle_that_goes_aside_ends_within_20_mm() {
    let mut random = Random(5);
    let shape = PulseShape {
        force_n: 1.0,
        rise_s: 0.05,
        hold_s: 0.2,
        fall_s: 0.05,
        travel_limit_m: 0.02,
        speed_limit_mps: 0.3,
        wrong_way_limit_m: 1e-3,
    };
    for aside in [Plane::new(0.0, 1.0), Plane::new(0.5, -1.0)] {
        let story = Story::new(&mut random);
        let mut servo = Servo::new(story.settings, compiled(&story.scenes[0]));
        let start = Plane::new(0.05, -0.03);
        let mut hand = start;
        let mut last_force = 0;
        for tick in 0..600_u32 {
            if tick == 100 {
                servo.begin_own_motion(OwnMotion::pulse(shape, T).expect("within bounds"), Plane::new(1.0, 0.0));
            }
            // It accelerates aside for as long as force flows.
            let outputs = servo.step(&inputs(tick, hand, (tick == 5).then_some(Command::Engage)), None);
            if tick > 100 && outputs.force_n != Plane::ZERO {
                last_force = tick;
                hand += aside * 2e-4;
                assert!((hand - start).length() < 0.0205, "{hand:?}");
            }
        }
        assert!(last_force > 120 && last_force < 260, "{last_force}");
        assert!(servo.own_motion().and_then(OwnMotion::end).is_some());
    }
}

/// An encoder that stands still is not seen: what the hand feels then is the surface's own friction, and no more.
// hazard: H39
#[test]
fn frozen_encoder_makes_no_more_force_than_the_surface() {
    let mut servo = servo_of(&Scene::light_block(), None);
    let mut most = 0.0_f64;
    for tick in 0..4000_u32 {
        let angle = 3.0 * f64::from(tick) * T;
        let hand = Plane::new(angle.cos(), angle.min(3.0).sin()) * 0.03;
        let outputs = servo.step(&inputs(tick, hand, (tick == 5).then_some(Command::Engage)), None);
        most = most.max(outputs.force_n.length());
    }
    // 4 N hold a block of 0.1 kg, which the hand accelerates by 0.3 m/s^2.
    assert!((3.5..4.1).contains(&most), "{most} N");
}
