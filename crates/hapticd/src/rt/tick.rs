//! The way of one sample, from the encoder to the motor.
//!
//! ```text
//! stop? new scene? command? -> device read -> velocity -> Renderer::tick -> SafetyLimiter -> device write -> record, answers
//! ```

use crate::rig_state::{Command, Fault, Rig};
use crate::rt::clock::{Wake, now_ns};
use crate::rt::handoff::{CommandWord, CompiledScene, Outcome, Shared};
use crate::rt::lateness::Lateness;
use crate::rt::transition::Transition;
use crate::telemetry::ring::{Producer, TickRecord};
use device_io::{Device, DeviceError, Measurement};
use haptic_core::limiter::SafetyLimiter;
use haptic_core::passivity::PassivityObserver;
use haptic_core::velocity::{Estimator, Method};
use haptic_ipc::RigState;
use std::sync::Arc;

/// What a force that a change of scene would make jump fades away in, s.
const BUMP_FADE_S: f64 = 0.05;

/// What the way of a sample is made of beside the device and the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parts {
    pub(crate) rig: Rig,
    pub(crate) limiter: SafetyLimiter,
    pub(crate) passivity: PassivityObserver,
    pub(crate) lateness: Lateness,
    pub(crate) velocity: Velocity,
    /// How long a device may repeat its last sample before it counts as stale, ns. Until then no time passes for the block.
    pub(crate) stale_ns: u64,
}

/// How velocity is estimated: anew for each device, as one may count more finely than another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Velocity {
    pub(crate) method: Method,
    pub(crate) period_s: f64,
}

impl Velocity {
    fn estimator(self, resolution_m: f64) -> Estimator {
        Estimator::new(self.method, self.period_s, resolution_m)
    }
}

#[cfg(test)]
impl Parts {
    /// What the tests run with: everything is at work.
    pub(crate) fn of_a_test(ramp_s: f64) -> Self {
        use crate::rt::lateness::LatePolicy;
        use haptic_core::limiter::Limits;
        use haptic_core::passivity::RigLosses;
        let limits = Limits {
            force_n: 20.0,
            slew_n_per_s: 50_000.0,
            speed_mps: 5.0,
            acceleration_mps2: 2000.0,
        };
        let losses = RigLosses {
            damping: 0.0,
            friction: 0.8,
        };
        Self {
            rig: Rig::new(ramp_s, 0.005),
            limiter: SafetyLimiter::new(limits),
            passivity: PassivityObserver::new(losses, 1.0),
            lateness: Lateness::new(LatePolicy::Warn),
            velocity: Velocity {
                method: Method::default(),
                period_s: 1e-3,
            },
            stale_ns: 50_000_000,
        }
    }
}

/// The newest sample of the device.
#[derive(Clone, Copy, Debug)]
struct Newest {
    sequence: u32,
    /// When it was taken, on the device's clock, ns.
    device_ns: u64,
    /// When it was first read, on ours, ns.
    read_ns: u64,
}

/// All that the loop owns.
pub(crate) struct Tick<D: Device + ?Sized> {
    shared: Arc<Shared>,
    telemetry: Producer,
    scene: Box<CompiledScene>,
    /// The scene before, while its force fades out.
    leaving: Option<Leaving>,
    scenes_seen: u64,
    rig: Rig,
    /// Whether force flowed in the tick before.
    was_live: bool,
    velocity: Estimator,
    velocity_of: Velocity,
    stale_ns: u64,
    limiter: SafetyLimiter,
    passivity: PassivityObserver,
    lateness: Lateness,
    bump: Bump,
    tick: u64,
    stops_seen: u64,
    /// A stop whose zero force has not reached the device yet, and the state that it brought.
    stop_pending: Option<(u64, RigState)>,
    last_command: u32,
    last_began_ns: u64,
    newest: Option<Newest>,
    device_position: f64,
    device_velocity: f64,
    device: Box<D>,
}

impl<D: Device + ?Sized> Tick<D> {
    pub(crate) fn new(
        device: Box<D>,
        shared: Arc<Shared>,
        telemetry: Producer,
        scene: Box<CompiledScene>,
        parts: Parts,
    ) -> Self {
        let Parts {
            rig,
            limiter,
            passivity,
            lateness,
            velocity,
            stale_ns,
        } = parts;
        shared.answers.scene_applied(scene.revision, 0);
        Self {
            shared,
            telemetry,
            scene,
            leaving: None,
            scenes_seen: 0,
            rig,
            was_live: false,
            velocity: velocity.estimator(device.resolution_m()),
            velocity_of: velocity,
            stale_ns,
            limiter,
            passivity,
            lateness,
            bump: Bump::none(),
            tick: 0,
            stops_seen: 0,
            stop_pending: None,
            last_command: 0,
            last_began_ns: 0,
            newest: None,
            device_position: 0.0,
            device_velocity: 0.0,
            device,
        }
    }

    /// One tick, from waking up to the answer; returns when it ended.
    pub(crate) fn run(&mut self, wake: Wake, missed_periods: u64) -> u64 {
        let stops = self.shared.stops();
        if stops != self.stops_seen {
            self.stops_seen = stops;
            self.rig.stop();
            self.stop_pending = Some((stops, self.rig.state()));
        }
        if self.rig.is_live() && self.lateness.is_too_late(wake.began_ns, missed_periods) {
            self.rig.fail(Fault::TooLate);
        }
        if self.shared.has_lapsed(wake.began_ns) && self.rig.is_live() {
            // It cannot be refused while force flows, and makes no difference while it already goes.
            self.rig.command(Command::Release).unwrap_or_default();
        }
        let new_scene = self.take_scene();
        let command = self.take_command(stops);

        let measured = self.device.read(wake.began_ns);
        let read_ns = self.link_time_ns();
        let elapsed_s = self.sense(measured, wake.began_ns);
        // Ramps go by our own clock: they must end even if the device's stands still.
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds between two ticks")]
        let our_elapsed_s = wake.began_ns.saturating_sub(self.last_began_ns) as f64 * 1e-9;
        self.last_began_ns = wake.began_ns;
        let (coupling_force, command_force) = self.render(elapsed_s, our_elapsed_s);
        let computed_ns = self.link_time_ns();
        let written = self.device.write(command_force, self.rig.is_live()).is_ok();
        if !written {
            self.rig.device_present(false);
        }
        let ended_ns = now_ns();

        let block = self.scene.renderer.state();
        self.telemetry.push(TickRecord {
            tick: self.tick,
            deadline_ns: wake.deadline_ns,
            began_ns: wake.began_ns,
            ended_ns,
            device_round_trip_ns: match (read_ns, computed_ns) {
                (Some(read), Some(computed)) => read.saturating_sub(wake.began_ns) + ended_ns.saturating_sub(computed),
                _ => 0,
            },
            missed_periods,
            dropped: 0,
            revision: self.scene.revision,
            device_position: self.device_position,
            device_velocity: self.device_velocity,
            block_position: block.position,
            block_velocity: block.velocity,
            coupling_force,
            command_force,
            energy_excess: self.passivity.excess_j(),
            // Without force there is no surface to touch.
            contact: if self.rig.is_live() {
                block.contact.as_number()
            } else {
                0
            },
            state: self.rig.state(),
            fault: self.rig.fault(),
        });
        // The answers come last, so that whoever has one also finds the tick's record.
        let stopped = if written { self.stop_pending.take() } else { None };
        self.answer(stopped, new_scene, command);
        self.tick += 1;
        ended_ns
    }

    /// The time, where it tells what the link takes: a reading of the clock costs more than the physics of a simple scene.
    fn link_time_ns(&self) -> Option<u64> {
        self.device.is_linked().then(now_ns)
    }

    /// Goes on with another device, as if it had been unplugged and another plugged in.
    pub(crate) fn replace_device(&mut self, device: Box<D>) {
        self.device = device;
        self.newest = None;
    }

    /// The scene that it renders.
    pub(crate) fn scene(&self) -> &CompiledScene {
        &self.scene
    }

    /// Zero force, whatever happens after.
    pub(crate) fn zero_force(&mut self) -> Result<(), DeviceError> {
        self.device.write(0.0, false)
    }

    fn take_scene(&mut self) -> bool {
        let Some(mut new) = self.shared.new_scene(&mut self.scenes_seen) else {
            return false;
        };
        let step = new.renderer.take_over(&self.scene.renderer);
        let fade_s = match new.transition {
            Transition::Fade { over_s } => over_s,
            Transition::AtOnce | Transition::Steps(_) => 0.0,
        };
        let old = std::mem::replace(&mut self.scene, new);
        if let Some(gone) = self.leaving.take() {
            // The force of a scene that was still fading goes the way of every step.
            self.bump.add(gone.excess);
            self.shared.retire(gone.scene);
        }
        if fade_s > 0.0 && self.rig.is_live() {
            self.leaving = Some(Leaving {
                scene: old,
                left_s: fade_s,
                over_s: fade_s,
                excess: 0.0,
            });
        } else {
            self.bump.add(step);
            self.shared.retire(old);
        }
        true
    }

    /// Moves a change of scene on that takes its time; at once to its end while no force flows.
    fn go_on_changing(&mut self, elapsed_s: f64) {
        let CompiledScene {
            renderer, transition, ..
        } = &mut *self.scene;
        if let Transition::Steps(steps) = transition {
            if self.was_live {
                if let Some(step) = steps.advance(elapsed_s, renderer) {
                    self.bump.add(step);
                }
            } else {
                steps.finish(renderer);
            }
            self.shared.answers.came_in(steps.taken());
        }
        if let Some(leaving) = &mut self.leaving {
            leaving.left_s = if self.was_live { leaving.left_s - elapsed_s } else { 0.0 };
            if leaving.left_s <= 0.0
                && self.shared.can_retire()
                && let Some(gone) = self.leaving.take()
            {
                self.shared.retire(gone.scene);
            }
        }
    }

    fn take_command(&mut self, stops: u64) -> Option<(CommandWord, bool)> {
        let word = self.shared.command()?;
        if word.serial == self.last_command {
            return None;
        }
        self.last_command = word.serial;
        // A stop that came after the command was sent wins over it.
        let refused = word.overtaken_by(stops) || self.rig.command(word.command).is_err();
        Some((word, refused))
    }

    /// Takes in a measurement; returns the time since the one before, s. A failed or stale read is never rendered as a position.
    fn sense(&mut self, measured: Result<Measurement, DeviceError>, now_ns: u64) -> f64 {
        let sample = match measured {
            Ok(sample) => sample,
            Err(error) => {
                match error {
                    DeviceError::MotorOff { watchdog } => self.rig.fail(Fault::MotorOff { watchdog }),
                    DeviceError::Failed(code) => self.rig.fail(Fault::Device(code)),
                    _ => self.rig.device_present(false),
                }
                self.newest = None;
                self.velocity.reset();
                return 0.0;
            }
        };
        if let Some(newest) = self.newest.filter(|newest| newest.sequence == sample.sequence) {
            if now_ns.saturating_sub(newest.read_ns) > self.stale_ns {
                if self.rig.is_live() {
                    self.rig.fail(Fault::Stale);
                }
                self.rig.device_present(false);
                self.velocity.reset();
            }
            return 0.0;
        }
        self.rig.device_present(true);
        if !sample.position_m.is_finite() {
            self.rig.fail(Fault::NonFinitePosition);
            return 0.0;
        }
        if self.newest.is_none() {
            // It may be another device than the last one.
            self.velocity = self.velocity_of.estimator(self.device.resolution_m());
        }
        let last = self.newest.replace(Newest {
            sequence: sample.sequence,
            device_ns: sample.time_ns,
            read_ns: now_ns,
        });
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds between two samples")]
        let elapsed_s = last.map_or(0.0, |last| sample.time_ns.saturating_sub(last.device_ns) as f64 * 1e-9);
        let moved = sample.position_m - self.device_position;
        // Only with force on the hand is it of any concern: without, the block goes wherever the device says.
        if self.rig.is_live()
            && self.was_live
            && last.is_some()
            && !self
                .limiter
                .allows_step(moved, self.device_velocity, elapsed_s, self.device.resolution_m())
        {
            self.rig.fail(Fault::Jump);
        }
        self.device_position = sample.position_m;
        self.device_velocity = self.velocity.update(elapsed_s, sample.position_m);
        elapsed_s
    }

    /// The force in the coupling and the force on the hand, N.
    fn render(&mut self, elapsed_s: f64, our_elapsed_s: f64) -> (f64, f64) {
        self.go_on_changing(our_elapsed_s);
        let renderer = &mut self.scene.renderer;
        if !self.was_live || !self.rig.is_live() {
            // Without force the block goes with the hand, and from there force begins: wherever the hand has come to meanwhile,
            // and at the very bottom of the ramp.
            renderer.start_at(self.device_position, self.device_velocity);
            self.bump = Bump::none();
            self.limiter.zero();
            self.passivity.rest();
            self.was_live = self.rig.is_live();
            return (0.0, 0.0);
        }
        if !self.limiter.allows_speed(self.device_velocity) {
            self.rig.fail(Fault::TooFast);
            return (0.0, 0.0);
        }
        let gain = self.rig.advance(our_elapsed_s);
        self.was_live = self.rig.is_live();
        let (position, velocity) = (self.device_position, self.device_velocity);
        let mut coupling_force = renderer.tick(elapsed_s, position, velocity).coupling_force;
        if let Some(leaving) = &mut self.leaving {
            coupling_force += leaving.tick(elapsed_s, position, velocity, coupling_force);
        }
        if !self.was_live {
            // The ramp has come to its end in this tick.
            self.limiter.zero();
            self.passivity.rest();
            return (coupling_force, 0.0);
        }
        let on_hand = -(coupling_force + self.bump.fade(elapsed_s));
        match self.limiter.limit(on_hand, gain, our_elapsed_s) {
            Ok(force) => {
                let added = self
                    .passivity
                    .observe(elapsed_s, self.device_position, self.device_velocity, force);
                (coupling_force, self.limiter.within(force + added))
            }
            Err(_) => {
                self.rig.fail(Fault::NonFiniteForce);
                (0.0, 0.0)
            }
        }
    }

    fn answer(&self, stopped: Option<(u64, RigState)>, new_scene: bool, command: Option<(CommandWord, bool)>) {
        let answers = &self.shared.answers;
        if new_scene {
            answers.scene_applied(self.scene.revision, self.tick);
        }
        if let Some((word, refused)) = command {
            let outcome = Outcome {
                tick: self.tick,
                state: self.rig.state(),
                refused,
            };
            answers.command_done(word.serial, outcome);
        }
        if let Some((stops, state)) = stopped {
            answers.stopped(stops, self.tick, state);
        }
    }
}

/// A scene whose force fades out.
#[derive(Debug)]
struct Leaving {
    scene: Box<CompiledScene>,
    left_s: f64,
    over_s: f64,
    /// What it last added to the force of the scene that comes, N.
    excess: f64,
}

impl Leaving {
    /// What is left of its force, beyond that of the scene that comes, N.
    fn tick(&mut self, elapsed_s: f64, position: f64, velocity: f64, coming_force: f64) -> f64 {
        let force = self.scene.renderer.tick(elapsed_s, position, velocity).coupling_force;
        self.excess = (force - coming_force) * (self.left_s / self.over_s).max(0.0);
        self.excess
    }
}

/// A step of force that a new scene would have caused, taken back and then let in slowly.
#[derive(Clone, Copy, Debug)]
struct Bump {
    force: f64,
    left_s: f64,
}

impl Bump {
    const fn none() -> Self {
        Self {
            force: 0.0,
            left_s: 0.0,
        }
    }

    fn add(&mut self, step: f64) {
        if step != 0.0 {
            self.force = self.now() + step;
            self.left_s = BUMP_FADE_S;
        }
    }

    fn now(&self) -> f64 {
        self.force * (self.left_s / BUMP_FADE_S)
    }

    fn fade(&mut self, elapsed_s: f64) -> f64 {
        if self.left_s <= 0.0 {
            return 0.0;
        }
        let force = self.now();
        self.left_s = (self.left_s - elapsed_s).max(0.0);
        force
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rt::lateness::LatePolicy;
    use crate::telemetry::ring;
    use device_io::protocol::message::ErrorCode;
    use haptic_core::limiter::Limits;
    use haptic_core::passivity::RigLosses;
    use haptic_core::velocity::Method;
    use haptic_core::{Renderer, Scene, Scheme};
    use proptest::prelude::*;

    /// A rig of which the test decides every reading.
    struct Scripted {
        readings: Vec<Result<f64, DeviceError>>,
        written: Arc<std::sync::Mutex<Vec<f64>>>,
        next: u32,
        refuses_writes: bool,
        repeats: bool,
    }

    impl Device for Scripted {
        fn description(&self) -> String {
            "scripted".to_owned()
        }

        fn resolution_m(&self) -> f64 {
            0.0
        }

        fn read(&mut self, _now_ns: u64) -> Result<Measurement, DeviceError> {
            if !self.repeats {
                self.next += 1;
            }
            let index = self.next - 1;
            self.readings[index as usize].map(|position_m| Measurement {
                sequence: index,
                time_ns: u64::from(index) * 1_000_000,
                position_m,
            })
        }

        fn write(&mut self, force_n: f64, _enabled: bool) -> Result<(), DeviceError> {
            if self.refuses_writes {
                return Err(DeviceError::Disconnected);
            }
            self.written.lock().expect("one thread").push(force_n);
            Ok(())
        }
    }

    struct Bench {
        tick: Tick<Scripted>,
        shared: Arc<Shared>,
        records: ring::Consumer,
        written: Arc<std::sync::Mutex<Vec<f64>>>,
        serial: u32,
        clock_ns: u64,
    }

    const MAX_FORCE: f64 = 20.0;

    const LIMITS: Limits = Limits {
        force_n: MAX_FORCE,
        slew_n_per_s: 1e6,
        speed_mps: 5.0,
        // The tests' hands move roughly; the one test of this limit sets it.
        acceleration_mps2: 1e6,
    };

    const NO_LOSSES: RigLosses = RigLosses {
        damping: 0.0,
        friction: 0.0,
    };

    /// Ticks until the velocity estimate has settled on the ramp.
    const SETTLE: usize = 50;

    fn bench(readings: impl IntoIterator<Item = Result<f64, DeviceError>>) -> Bench {
        let shared = Arc::new(Shared::new());
        let (producer, records) = ring::ring();
        let written = Arc::default();
        let device = Scripted {
            readings: readings.into_iter().collect(),
            written: Arc::clone(&written),
            next: 0,
            refuses_writes: false,
            repeats: false,
        };
        let tick = Tick::new(
            Box::new(device),
            Arc::clone(&shared),
            producer,
            Box::new(compiled(&Scene::paper(), 1)),
            Parts {
                rig: Rig::new(0.02, 0.005),
                limiter: SafetyLimiter::new(LIMITS),
                passivity: PassivityObserver::new(NO_LOSSES, 0.0),
                lateness: Lateness::new(LatePolicy::Fault { most_in_a_second: 5 }),
                velocity: Velocity {
                    method: Method::default(),
                    period_s: 1e-3,
                },
                stale_ns: 50_000_000,
            },
        );
        Bench {
            tick,
            shared,
            records,
            written,
            serial: 0,
            clock_ns: 1_000_000_000,
        }
    }

    fn compiled(scene: &Scene, revision: u64) -> CompiledScene {
        CompiledScene::at_once(
            Renderer::new(scene, Scheme::Exact, 1e-3).expect("a valid scene"),
            revision,
        )
    }

    impl Bench {
        fn tick(&mut self) -> TickRecord {
            self.clock_ns += 1_000_000;
            let wake = Wake {
                deadline_ns: self.clock_ns,
                began_ns: self.clock_ns,
            };
            self.tick.run(wake, 0);
            self.records.pop().expect("every tick leaves a record")
        }

        fn ticks(&mut self, count: usize) {
            for _ in 0..count {
                self.tick();
            }
        }

        fn command(&mut self, command: Command) -> Outcome {
            self.serial += 1;
            self.shared.send(self.serial, command, self.shared.stops());
            self.tick();
            self.shared.answers.command(self.serial).expect("answered in the tick")
        }

        fn last_written(&self) -> f64 {
            *self
                .written
                .lock()
                .expect("one thread")
                .last()
                .expect("something was written")
        }
    }

    /// A ramp of 0.2 m/s: in the paper scene the friction is soon at its limit.
    fn ramp() -> impl Iterator<Item = Result<f64, DeviceError>> {
        (0..10_000).map(|k| Ok(2e-4 * f64::from(k)))
    }

    #[test]
    fn force_comes_with_engaging_opposes_the_motion_and_goes_with_a_stop() {
        let mut bench = bench(ramp());
        bench.ticks(SETTLE);
        assert_eq!(bench.last_written(), 0.0);
        assert_eq!(bench.command(Command::Engage).state, RigState::Engaging);
        bench.ticks(300);
        let record = bench.tick();
        assert_eq!(record.state, RigState::Engaged);
        assert!((record.command_force + 3.5).abs() < 0.05, "{record:?}");
        assert_eq!(record.contact, 1);
        let stop = bench.shared.stop();
        assert_eq!(bench.tick().command_force, 0.0);
        assert_eq!(
            bench.shared.answers.stop(stop).map(|(_, state)| state),
            Some(RigState::Stopped)
        );
        assert!(bench.command(Command::Engage).refused, "a stop holds until a reset");
        assert_eq!(bench.command(Command::Reset).state, RigState::Idle);
        assert_eq!(bench.last_written(), 0.0, "a reset does not engage");
    }

    #[test]
    fn engaging_begins_without_force_wherever_and_whenever_it_comes() {
        // In the very first tick, far from the origin; and after a device that was gone has come back elsewhere.
        let away = || std::iter::repeat_n(Err(DeviceError::Disconnected), 1);
        let readings = std::iter::repeat_n(Ok(-0.03), 50)
            .chain(away())
            .chain(std::iter::repeat_n(Ok(0.4), 50));
        let mut bench = bench(readings);
        let still = |bench: &mut Bench| {
            bench.serial += 1;
            bench.shared.send(bench.serial, Command::Engage, bench.shared.stops());
            for _ in 0..30 {
                let record = bench.tick();
                assert_eq!((record.coupling_force, record.command_force), (0.0, 0.0), "{record:?}");
            }
            assert_eq!(bench.tick().state, RigState::Engaged);
        };
        still(&mut bench);
        bench.ticks(50 - 31);
        assert_eq!(bench.tick().state, RigState::Disconnected);
        assert_eq!(bench.tick().state, RigState::Idle);
        still(&mut bench);
    }

    #[test]
    fn engaging_on_a_moving_hand_begins_without_force_and_then_opposes_it() {
        let mut bench = bench(ramp());
        bench.ticks(SETTLE);
        bench.serial += 1;
        bench.shared.send(bench.serial, Command::Engage, bench.shared.stops());
        let first = bench.tick();
        assert_eq!(
            (first.state, first.coupling_force, first.command_force),
            (RigState::Engaging, 0.0, 0.0)
        );
        for _ in 0..10 {
            let record = bench.tick();
            assert!(record.command_force <= 0.0, "against the motion: {record:?}");
        }
    }

    #[test]
    fn a_stall_does_not_skip_the_ramp() {
        let mut bench = bench(ramp());
        bench.ticks(SETTLE);
        bench.clock_ns += 3_000_000_000;
        assert_eq!(bench.command(Command::Engage).state, RigState::Engaging);
        bench.clock_ns += 3_000_000_000;
        assert_eq!(bench.tick().state, RigState::Engaging);
    }

    #[test]
    fn a_stop_is_confirmed_only_when_zero_force_was_written() {
        let mut bench = bench(ramp());
        bench.ticks(SETTLE);
        bench.tick.device.refuses_writes = true;
        let stop = bench.shared.stop();
        bench.tick();
        assert_eq!(bench.shared.answers.stop(stop), None);
        bench.tick.device.refuses_writes = false;
        bench.tick();
        assert!(bench.shared.answers.stop(stop).is_some());
    }

    #[test]
    fn a_device_that_repeats_itself_faults_and_comes_back_idle_after_a_reset() {
        let mut bench = bench(ramp());
        bench.ticks(SETTLE);
        bench.command(Command::Engage);
        bench.ticks(60);
        bench.tick.device.repeats = true;
        let before = bench.tick();
        assert!(
            before.command_force != 0.0,
            "a late sample is no reason yet: {before:?}"
        );
        bench.ticks(50);
        let lost = bench.tick();
        assert_eq!((lost.state, lost.command_force), (RigState::Faulted, 0.0));
        assert_eq!(lost.fault, Some(Fault::Stale));
        bench.command(Command::Reset);
        bench.ticks(2);
        assert_eq!(bench.tick().state, RigState::Disconnected, "there is still nothing new");
        bench.tick.device.repeats = false;
        bench.ticks(10);
        assert_eq!(bench.tick().state, RigState::Idle);
    }

    #[test]
    fn a_device_that_has_its_motor_off_faults_and_is_told_apart_from_one_that_is_gone() {
        for (error, state, fault) in [
            (
                DeviceError::MotorOff { watchdog: true },
                RigState::Faulted,
                Some(Fault::MotorOff { watchdog: true }),
            ),
            (
                DeviceError::Failed(ErrorCode::Sensor),
                RigState::Faulted,
                Some(Fault::Device(ErrorCode::Sensor)),
            ),
            (DeviceError::Disconnected, RigState::Disconnected, None),
        ] {
            let mut bench = bench(ramp().take(100).chain([Err(error)]).chain(ramp()));
            bench.tick();
            bench.command(Command::Engage);
            bench.ticks(98);
            let told = bench.tick();
            assert_eq!((told.state, told.fault, told.command_force), (state, fault, 0.0));
            assert_eq!(bench.last_written(), 0.0);
        }
    }

    #[test]
    fn a_reset_that_a_stop_has_overtaken_clears_nothing() {
        let mut bench = bench(ramp());
        bench.shared.stop();
        bench.tick();
        bench.shared.send(7, Command::Reset, bench.shared.stops());
        bench.shared.stop();
        bench.tick();
        let outcome = bench.shared.answers.command(7).expect("answered");
        assert!(outcome.refused);
        assert_eq!(outcome.state, RigState::Stopped);
    }

    #[test]
    fn a_failed_read_is_zero_force_and_never_engages_by_itself() {
        let readings = ramp()
            .take(100)
            .chain(std::iter::repeat_n(Err(DeviceError::Disconnected), 5))
            .chain(ramp());
        let mut bench = bench(readings);
        bench.ticks(SETTLE);
        bench.command(Command::Engage);
        bench.ticks(99 - SETTLE);
        assert!(bench.last_written() < -0.1);
        let lost = bench.tick();
        assert_eq!((lost.state, lost.command_force), (RigState::Disconnected, 0.0));
        bench.ticks(4);
        for _ in 0..50 {
            let back = bench.tick();
            assert_eq!((back.state, back.command_force), (RigState::Idle, 0.0));
        }
    }

    #[test]
    fn a_position_that_is_no_number_faults_at_zero_force() {
        let mut bench = bench(ramp().take(100).chain([Ok(f64::NAN)]).chain(ramp()));
        bench.ticks(SETTLE);
        bench.command(Command::Engage);
        bench.ticks(99 - SETTLE);
        let record = bench.tick();
        assert_eq!(
            (record.state, record.fault),
            (RigState::Faulted, Some(Fault::NonFinitePosition))
        );
        assert_eq!(record.command_force, 0.0);
        assert_eq!(bench.tick().command_force, 0.0, "until a reset");
    }

    #[test]
    fn a_jump_of_the_encoder_faults_before_it_is_rendered() {
        // 2 mm within a millisecond, from a hand at 0.1 m/s: slower than the speed limit, and no motion.
        let jumped = (0..50).map(|k| Ok(0.01 + 2e-3 + 1e-4 * f64::from(k)));
        let mut bench = bench(ramp().take(100).chain(jumped));
        bench.tick.limiter = SafetyLimiter::new(Limits {
            acceleration_mps2: 2000.0,
            ..LIMITS
        });
        bench.ticks(SETTLE);
        bench.command(Command::Engage);
        let mut before = bench.tick();
        while before.state.is_live() {
            let record = bench.tick();
            let step = record.command_force - before.command_force;
            assert!(record.command_force == 0.0 || step.abs() < 1.0, "{before:?} {record:?}");
            before = record;
        }
        assert_eq!(bench.tick.rig.fault(), Some(Fault::Jump));
        assert_eq!(bench.last_written(), 0.0);
    }

    #[test]
    fn a_jump_of_the_encoder_is_cut_to_the_force_limit() {
        let mut bench = bench(ramp().take(100).chain(std::iter::repeat_n(Ok(5.0), 50)));
        bench.tick();
        bench.command(Command::Engage);
        for _ in 2..150 {
            let record = bench.tick();
            assert!(record.command_force.abs() <= MAX_FORCE, "{record:?}");
        }
    }

    #[test]
    fn a_new_scene_lands_between_two_ticks_without_a_step_of_force() {
        for changes in [
            vec![("K", 3000.0)],
            vec![("B", 0.0), ("M", 2.0)],
            vec![("K", 0.0), ("B", 30.0)],
        ] {
            let mut bench = bench(ramp());
            bench.ticks(SETTLE);
            bench.command(Command::Engage);
            bench.ticks(200);
            let before = bench.tick();
            let changes: Vec<_> = changes
                .iter()
                .map(|(name, value)| (name.parse().expect("a parameter"), *value))
                .collect();
            let scene = Scene::paper().with(&changes).expect("a valid scene");
            bench.shared.scenes.post(compiled(&scene, 2));
            let after = bench.tick();
            assert_eq!((before.revision, after.revision), (1, 2));
            assert_eq!(bench.shared.answers.applied(2), Some(after.tick));
            let step = (after.command_force - before.command_force).abs();
            assert!(step < 1.0, "{changes:?}: {step} N");
            bench.shared.drop_retired();
        }
    }

    #[test]
    fn a_device_that_goes_too_fast_faults_at_zero_force() {
        // 8 m/s, from rest, while it is engaged.
        let fast = (0..200).map(|k| Ok(0.2 * 0.1 + 8e-3 * f64::from(k)));
        let mut bench = bench(ramp().take(100).chain(fast));
        bench.ticks(SETTLE);
        bench.command(Command::Engage);
        bench.ticks(100);
        assert_eq!(bench.tick.rig.fault(), Some(Fault::TooFast));
        assert_eq!(bench.last_written(), 0.0);
    }

    #[test]
    fn a_loop_that_is_too_late_faults_where_the_policy_says_so() {
        let mut bench = bench(ramp());
        bench.ticks(SETTLE);
        bench.command(Command::Engage);
        bench.ticks(50);
        let mut run = |missed: u64| {
            bench.clock_ns += 1_000_000;
            let wake = Wake {
                deadline_ns: bench.clock_ns,
                began_ns: bench.clock_ns,
            };
            bench.tick.run(wake, missed);
            (bench.tick.rig.fault(), bench.last_written())
        };
        assert_eq!(run(4).0, None);
        assert_eq!(run(5), (Some(Fault::TooLate), 0.0));
    }

    /// Something that can happen to the loop between two ticks, or in one.
    #[derive(Clone, Debug)]
    enum Happening {
        Command(Command),
        Stop,
        Scene(usize),
        /// A reading, or none; and time that goes by, ns.
        Tick(Option<f64>, u64),
        Repeat,
        RefusedWrite,
    }

    fn scenes() -> Vec<Scene> {
        let mut scenes = vec![Scene::paper()];
        for (name, value) in [("K", 3e5), ("M", 100.0), ("b", 1e4), ("DV", 0.5)] {
            let key = name.parse().expect("a parameter");
            scenes.push(Scene::paper().with(&[(key, value)]).expect("a valid scene"));
        }
        // On the device itself, with a stiff spring and with drag.
        for law in [
            r#"{"law":"karnopp","static_force":40,"dynamic_force":30,"contact_stiffness":10000000}"#,
            r#"{"law":"viscous","viscous":10000}"#,
            r#"{"law":"lugre","static_force":40,"dynamic_force":30,"stribeck_velocity":0.001,"contact_stiffness":1000000,"contact_damping":1000}"#,
        ] {
            scenes.push(Scene {
                block: None,
                coupling: None,
                friction: serde_json::from_str(law).expect("a law"),
                ..Scene::paper()
            });
        }
        scenes
    }

    fn happening() -> impl Strategy<Value = Happening> {
        let position = prop_oneof![
            20 => (-0.1..0.1f64).prop_map(Some),
            1 => Just(None),
            1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(1e300), Just(-1e9), Just(f64::MIN_POSITIVE)].prop_map(Some),
        ];
        let tick = (
            position,
            prop_oneof![8 => Just(1_000_000_u64), 1 => 0..2_000_000_u64, 1 => 0..100_000_000_u64],
        );
        prop_oneof![
            2 => Just(Happening::Command(Command::Engage)),
            1 => Just(Happening::Command(Command::Release)),
            2 => Just(Happening::Command(Command::Reset)),
            1 => Just(Happening::Stop),
            2 => (0..8_usize).prop_map(Happening::Scene),
            30 => tick.prop_map(|(position, after_ns)| Happening::Tick(position, after_ns)),
            1 => Just(Happening::Repeat),
            1 => Just(Happening::RefusedWrite),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

        /// Whatever is measured, commanded and changed: the force is a number within the limits, and zero where none may flow.
        #[test]
        fn force_stays_within_its_limits_and_where_it_belongs(
            happenings in prop::collection::vec(happening(), 1..150),
            steps in prop::collection::vec(-2e-3..2e-3f64, 150),
        ) {
            let scenes = scenes();
            let mut bench = bench([]);
            let slew_n_per_s = 5000.0;
            bench.tick.limiter = SafetyLimiter::new(Limits { slew_n_per_s, ..LIMITS });
            bench.tick.passivity = PassivityObserver::new(NO_LOSSES, 3.0);
            let (mut position, mut revision, mut last) = (0.0, 1, 0.0_f64);
            for (happening, step) in happenings.into_iter().zip(steps) {
                let (mut reading, mut after_ns) = (Some(position), 1_000_000);
                bench.tick.device.repeats = false;
                bench.tick.device.refuses_writes = false;
                match happening {
                    Happening::Command(command) => {
                        bench.serial += 1;
                        bench.shared.send(bench.serial, command, bench.shared.stops());
                    }
                    Happening::Stop => {
                        bench.shared.stop();
                    }
                    Happening::Scene(which) => {
                        revision += 1;
                        bench.shared.scenes.post(compiled(&scenes[which], revision));
                    }
                    // Mostly a hand that goes on, and now and then a leap to anywhere.
                    Happening::Tick(Some(anywhere), ns) if !anywhere.is_finite() || anywhere.abs() > 0.09 => {
                        (reading, after_ns) = (Some(anywhere), ns);
                    }
                    Happening::Tick(None, ns) => (reading, after_ns) = (None, ns),
                    Happening::Tick(Some(_), ns) => {
                        position += step;
                        (reading, after_ns) = (Some(position), ns);
                    }
                    Happening::Repeat => bench.tick.device.repeats = bench.tick.device.next > 0,
                    Happening::RefusedWrite => bench.tick.device.refuses_writes = true,
                }
                if !bench.tick.device.repeats {
                    bench.tick.device.readings.push(reading.ok_or(DeviceError::Disconnected));
                }
                let wrote_before = bench.written.lock().expect("one thread").len();
                bench.clock_ns += after_ns;
                let wake = Wake { deadline_ns: bench.clock_ns, began_ns: bench.clock_ns };
                bench.tick.run(wake, 0);
                let record = bench.records.pop().expect("a record");
                bench.shared.drop_retired();
                let force = record.command_force;
                prop_assert!(force.is_finite() && force.abs() <= MAX_FORCE, "{record:?}");
                // The controller's own few newtons come on top of the slew limit.
                let most = slew_n_per_s * after_ns as f64 * 1e-9 + 2.0 * 3.0 + 1e-9;
                prop_assert!(force.abs() - last.abs() <= most, "from {last} N to {force} N in {after_ns} ns");
                let written = bench.written.lock().expect("one thread").clone();
                if written.len() > wrote_before {
                    prop_assert_eq!(*written.last().expect("a force"), force);
                    let live = record.state.is_live() || force == 0.0;
                    prop_assert!(live, "force without a live rig: {:?}", record);
                }
                last = force;
            }
        }
    }
}
