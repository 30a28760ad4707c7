//! The way of one sample, from the encoder to the motor.
//!
//! ```text
//! stop? new scene? command? -> device read -> velocity -> Renderer::tick -> SafetyLimiter -> device write -> record, answers
//! ```

use crate::rig_state::{Fault, Rig};
use crate::rt::clock::{Wake, now_ns};
use crate::rt::handoff::{CommandWord, CompiledScene, Outcome, Shared};
use crate::telemetry::ring::{Producer, TickRecord};
use device_io::{Device, DeviceError, Measurement};
use haptic_core::limiter::SafetyLimiter;
use haptic_core::velocity::Estimator;
use haptic_ipc::RigState;
use std::sync::Arc;

/// What a force that a change of scene would make jump fades away in, s.
const BUMP_FADE_S: f64 = 0.05;

/// How long a device may repeat its last sample before it counts as gone, ns. Until then no time passes for the block.
const STALE_AFTER_NS: u64 = 50_000_000;

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
    scenes_seen: u64,
    rig: Rig,
    /// Whether force flowed in the tick before.
    was_live: bool,
    velocity: Estimator,
    limiter: SafetyLimiter,
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
        rig: Rig,
        limiter: SafetyLimiter,
        velocity: Estimator,
    ) -> Self {
        shared.answers.scene_applied(scene.revision, 0);
        Self {
            shared,
            telemetry,
            scene,
            scenes_seen: 0,
            rig,
            was_live: false,
            velocity,
            limiter,
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
        let new_scene = self.take_scene();
        let command = self.take_command(stops);

        let measured = self.device.read(wake.began_ns);
        let read_ns = now_ns();
        let elapsed_s = self.sense(measured, wake.began_ns);
        // Ramps go by our own clock: they must end even if the device's stands still.
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds between two ticks")]
        let our_elapsed_s = wake.began_ns.saturating_sub(self.last_began_ns) as f64 * 1e-9;
        self.last_began_ns = wake.began_ns;
        let (coupling_force, command_force) = self.render(elapsed_s, our_elapsed_s);
        let computed_ns = now_ns();
        let written = self.device.write(command_force).is_ok();
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
            device_round_trip_ns: read_ns.saturating_sub(wake.began_ns) + ended_ns.saturating_sub(computed_ns),
            missed_periods,
            dropped: 0,
            revision: self.scene.revision,
            device_position: self.device_position,
            device_velocity: self.device_velocity,
            block_position: block.position,
            block_velocity: block.velocity,
            coupling_force,
            command_force,
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

    /// Zero force, whatever happens after.
    pub(crate) fn zero_force(&mut self) -> Result<(), DeviceError> {
        self.device.write(0.0)
    }

    fn take_scene(&mut self) -> bool {
        let Some(mut new) = self.shared.new_scene(&mut self.scenes_seen) else {
            return false;
        };
        let step = new.renderer.take_over(&self.scene.renderer);
        self.bump.add(step);
        let old = std::mem::replace(&mut self.scene, new);
        self.shared.retire(old);
        true
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
        let Ok(sample) = measured else {
            self.rig.device_present(false);
            self.newest = None;
            self.velocity.reset();
            return 0.0;
        };
        if let Some(newest) = self.newest.filter(|newest| newest.sequence == sample.sequence) {
            if now_ns.saturating_sub(newest.read_ns) > STALE_AFTER_NS {
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
        let last = self.newest.replace(Newest {
            sequence: sample.sequence,
            device_ns: sample.time_ns,
            read_ns: now_ns,
        });
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds between two samples")]
        let elapsed_s = last.map_or(0.0, |last| sample.time_ns.saturating_sub(last.device_ns) as f64 * 1e-9);
        self.device_position = sample.position_m;
        self.device_velocity = self.velocity.update(elapsed_s, sample.position_m);
        elapsed_s
    }

    /// The force in the coupling and the force on the hand, N.
    fn render(&mut self, elapsed_s: f64, our_elapsed_s: f64) -> (f64, f64) {
        let renderer = &mut self.scene.renderer;
        if !self.was_live || !self.rig.is_live() {
            // Without force the block goes with the hand, and from there force begins: wherever the hand has come to meanwhile,
            // and at the very bottom of the ramp.
            renderer.start_at(self.device_position, self.device_velocity);
            self.bump = Bump::none();
            self.was_live = self.rig.is_live();
            return (0.0, 0.0);
        }
        let gain = self.rig.advance(our_elapsed_s);
        self.was_live = self.rig.is_live();
        let coupling_force = renderer
            .tick(elapsed_s, self.device_position, self.device_velocity)
            .coupling_force;
        let on_hand = -(coupling_force + self.bump.fade(elapsed_s));
        match self.limiter.limit(on_hand, gain) {
            Ok(force) => (coupling_force, force),
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
    use crate::rig_state::Command;
    use crate::telemetry::ring;
    use haptic_core::velocity::Method;
    use haptic_core::{Renderer, Scene, Scheme};

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

        fn write(&mut self, force_n: f64) -> Result<(), DeviceError> {
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
            Rig::new(0.02, 0.005),
            SafetyLimiter::new(MAX_FORCE),
            Estimator::new(Method::default(), 1e-3, 0.0),
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
        CompiledScene {
            renderer: Renderer::new(scene, Scheme::Exact, 1e-3).expect("a valid scene"),
            revision,
        }
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
    fn a_device_that_repeats_itself_is_given_up_and_comes_back_idle() {
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
        assert_eq!((lost.state, lost.command_force), (RigState::Disconnected, 0.0));
        bench.tick.device.repeats = false;
        bench.ticks(10);
        assert_eq!(bench.tick().state, RigState::Idle);
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
}
