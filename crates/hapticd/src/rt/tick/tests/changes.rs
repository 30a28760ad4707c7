//! A change of scene never jerks the hand, whatever the two scenes, the state of the surface, and
//! the path from one to the other.

use super::admission::engage;
use super::*;
use crate::rt::handoff::ANY_CONNECTION;
use haptic_core::friction::{Friction, LAWS};
use haptic_core::scene::{Block, Coupling};
use haptic_core::{Direction, Parameter, ParameterKey};
use proptest::prelude::*;

/// What time the tests' samples are apart, s.
const PERIOD_S: f64 = 1e-3;

fn decades(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low..high).prop_map(|exponent: f64| 10_f64.powf(exponent))
}

prop_compose! {
    /// Scenes of every law, behind a block and on the device, symmetric and not; a few of them are
    /// refused.
    fn any_scene()(
        law in 0..LAWS.len(),
        with_block in any::<bool>(),
        mass in decades(-2.0, 1.0),
        stiffness in decades(2.0, 5.0),
        damping in 0.0..30.0f64,
        dynamic_force in 0.0..8.0f64,
        stiction in 1.0..2.0f64,
        skew in prop_oneof![Just(1.0), 0.5..1.0f64],
        viscous in prop_oneof![Just(0.0), decades(-1.0, 2.0)],
        contact_stiffness in decades(3.0, 5.5),
        velocity in prop_oneof![Just(0.0), 0.001..0.05f64],
        rising_rate in prop_oneof![Just(0.0), 0.1..20.0f64],
    ) -> Scene {
        let scene = Scene {
            name: LAWS[law].to_owned(),
            block: with_block.then_some(Block { mass }),
            coupling: with_block.then_some(Coupling { stiffness, damping }),
            friction: Friction::default_of(LAWS[law]).expect("a law"),
        };
        let changes: Vec<(ParameterKey, f64)> = scene
            .friction
            .vector(!with_block)
            .iter()
            .map(|coordinate| {
                let value = match coordinate.key.parameter {
                    Parameter::StaticForce => stiction * dynamic_force,
                    Parameter::DynamicForce => dynamic_force,
                    Parameter::Viscous => viscous,
                    Parameter::ContactStiffness => contact_stiffness,
                    Parameter::VelocityThreshold => velocity,
                    Parameter::StribeckVelocity => 0.001 + velocity,
                    Parameter::RisingRate => rising_rate,
                    _ => coordinate.value,
                };
                let is_skewed = coordinate.key.direction == Some(Direction::Negative);
                (coordinate.key, if is_skewed { skew * value } else { value })
            })
            .collect();
        scene.with_unvalidated(&changes).expect("in range")
    }
}

fn valid_scene() -> impl Strategy<Value = Scene> {
    any_scene().prop_filter("it can be rendered", |scene| {
        Renderer::new(scene, Scheme::Exact, PERIOD_S).is_ok()
    })
}

impl Bench {
    /// Engaged on a scene, with a hand that has gone at a speed for so many ticks and then, if it
    /// is to, has come to rest.
    fn dragged(scene: &Scene, speed: f64, ticks: usize, at_rest: bool) -> (Self, f64) {
        let settings = Settings {
            ramp_s: 1e-3,
            limits: SLEWED,
            ..SETTINGS
        };
        let mut bench = bench_with(settings, []);
        bench.inbox.post(compiled(scene, 2));
        let mut position = 0.0;
        let mut go = |bench: &mut Self, speed: f64| {
            position += speed * PERIOD_S;
            bench.tick.device.readings.push(Ok(position));
            bench.tick()
        };
        for _ in 0..SETTLE {
            go(&mut bench, 0.0);
        }
        bench.serial += 1;
        bench.inbox.command(bench.serial, Command::Engage, bench.shared.stops());
        for _ in 0..5 {
            go(&mut bench, 0.0);
        }
        for _ in 0..ticks {
            go(&mut bench, speed);
        }
        for _ in 0..if at_rest { 300 } else { 0 } {
            go(&mut bench, 0.0);
        }
        (bench, position)
    }

    /// A tick with another sample after no time at all.
    fn tick_at_once(&mut self, position: f64) -> TickRecord {
        self.tick.device.readings.push(Ok(position));
        self.tick.device.sample_ns = 0;
        self.clock_ns -= 1_000_000;
        let record = self.tick();
        self.tick.device.sample_ns = 1_000_000;
        record
    }
}

/// As the daemon has them by default.
const SLEWED: Limits = Limits {
    slew_n_per_s: 50_000.0,
    ..LIMITS
};

/// What a change may add to the force at once, N: rounding.
const STEP_N: f64 = 1e-6;

proptest! {
    #![proptest_config(ProptestConfig { cases: test_run::extent(300, 3000), failure_persistence: None, ..ProptestConfig::default() })]

    /// In the very moment of the change the force stays what it was; from there on it grows by no
    /// more than the slew limit allows. Over a ramp that holds for every step of it.
    #[test]
    fn a_change_of_scene_makes_no_step_of_force(
        from in valid_scene(),
        to in valid_scene(),
        speed in prop_oneof![-0.3..0.3f64, -0.005..0.005f64],
        ticks in 0..150_usize,
        at_rest in any::<bool>(),
        ramp_s in prop_oneof![Just(0.0), 0.002..0.3f64],
        interrupted_by in prop::option::of(valid_scene()),
    ) {
        let (mut bench, mut position) = Bench::dragged(&from, speed, ticks, at_rest);
        let speed = if at_rest { 0.0 } else { speed };
        let mut before = bench.tick_at_once(position);
        prop_assert!(before.state.is_live(), "{before:?}");
        let mut revision = 2;
        let mut scene = from.clone();
        for to in [Some(to), interrupted_by].into_iter().flatten() {
            revision += 1;
            let ramp = CompiledScene::<f64>::ramped(&scene, &to, revision, Scheme::Exact, PERIOD_S, ramp_s);
            bench.inbox.post(ramp.expect("both are valid"));
            let after = bench.tick_at_once(position);
            prop_assert_eq!(after.revision, revision);
            prop_assert_eq!(bench.records.answers().applied(revision), Some(after.tick));
            prop_assert!(
                (after.command_force - before.command_force).abs() <= STEP_N,
                "{} N, then {} N", before.command_force, after.command_force
            );
            before = after;
            for _ in 0..60 {
                position += speed * PERIOD_S;
                bench.tick.device.readings.push(Ok(position));
                let record = bench.tick();
                prop_assert!(record.state.is_live(), "{record:?}");
                let grown = record.command_force.abs() - before.command_force.abs();
                prop_assert!(grown <= SLEWED.slew_n_per_s * PERIOD_S + STEP_N, "{grown} N in one tick");
                before = record;
            }
            before = {
                let still = bench.tick_at_once(position);
                // After no time there is nothing but what the ramp itself does.
                prop_assert!(
                    (still.command_force - before.command_force).abs() <= STEP_N,
                    "{} N, then {} N", before.command_force, still.command_force
                );
                still
            };
            scene = to;
        }
    }
}

#[test]
fn a_ramp_ends_at_once_where_no_force_flows() {
    let mut bench = bench((0..200).map(|_| Ok(0.0)));
    bench.ticks(SETTLE);
    let change = [("M".parse().expect("a parameter"), 2.0)];
    let to = Scene::paper().with(&change).expect("a valid scene");
    let ramp = CompiledScene::<f64>::ramped(&Scene::paper(), &to, 2, Scheme::Exact, PERIOD_S, 5.0);
    bench.inbox.post(ramp.expect("both are valid"));
    bench.tick();
    assert_eq!(bench.tick().ramp_steps, 250);
}

#[test]
fn a_lease_that_lapses_lets_the_force_out_by_the_loop_alone() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(100);
    bench.shared.lease_until(bench.clock_ns + 10_500_000);
    bench.ticks(10);
    assert_eq!(bench.tick.servo.state(), RigState::Engaged);
    assert_eq!(bench.tick().state, RigState::Releasing);
    bench.ticks(30);
    assert_eq!((bench.tick.servo.state(), bench.last_written()), (RigState::Idle, 0.0));
    // A lease that has lapsed, and that nobody has ended, keeps the force out.
    bench.command(Command::Engage);
    bench.ticks(30);
    assert_eq!(bench.tick.servo.state(), RigState::Idle);
}

#[test]
fn a_lease_that_ends_early_lets_the_force_out_as_fast() {
    let ramp_s = 10.0;
    let mut bench = bench_with(Settings { ramp_s, ..SETTINGS }, ramp());
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(300);
    let ToLoop::Command { mut sent, rig } = engage(99, ANY_CONNECTION, None) else {
        panic!("a command");
    };
    (sent.command, sent.is_of_lapse) = (Command::Release, true);
    assert!(bench.inbox.send(ToLoop::Command { sent, rig }));
    bench.ticks(1);
    let outcome = bench.records.answers().command(99).expect("it is answered");
    assert_eq!((outcome.state, outcome.refused), (RigState::Releasing, false));
    bench.ticks(201);
    assert_eq!((bench.tick.servo.state(), bench.last_written()), (RigState::Idle, 0.0));
}

#[test]
fn scene_waits_while_replaced_scenes_have_no_room() {
    let mut bench = bench(ramp());
    let waiting = (2..10_000).find(|revision| {
        bench.inbox.post(compiled(&Scene::paper(), *revision));
        bench.rendered_unread() != *revision
    });
    let waiting = waiting.expect("nobody frees what was replaced, so there is no room at last");
    // A stop is never late, and its answer waits as the scene does.
    let stop = bench.shared.stop();
    assert_eq!(bench.rendered_unread(), waiting - 1);
    assert_eq!(bench.tick.servo.state(), RigState::Stopped);
    while bench.records.pop().is_some() {}
    let answers = bench.records.answers();
    assert_eq!(
        (answers.applied(waiting - 1).is_some(), answers.stop(stop)),
        (true, None)
    );
    assert_eq!(bench.tick().revision, waiting);
    assert!(bench.records.answers().stop(stop).is_some());
}
