//! The way of one sample, from the encoder to the motor.
//!
//! ```text
//! stop? new scene? command? -> device read -> velocity -> Renderer::tick -> SafetyLimiter -> device write -> record, answers
//! ```

use crate::rig_state::{Command, Fault, Rig};
use crate::rt::clock::{Wake, now_ns};
use crate::rt::handoff::{CommandWord, CompiledScene, Outcome, Shared, Stopped};
use crate::rt::lateness::Lateness;
use crate::rt::transition::Transition;
use crate::telemetry::ring::{Producer, TickRecord};
use device_io::{Device, DeviceError, Measurement, Written};
use haptic_core::limiter::{NonFiniteForce, SafetyLimiter};
use haptic_core::passivity::PassivityObserver;
use haptic_core::velocity::{Estimator, Method};
use haptic_ipc::RigState;
use std::sync::Arc;

/// What a force that a change of scene would make jump fades away in, s.
const BUMP_FADE_S: f64 = 0.05;

/// What the way of a sample is made of beside the device and the scene.
#[derive(Clone, Debug)]
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
    /// A stop whose zero force the device has not taken yet, and the state that it brought.
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
        if !self.rig.is_live() {
            self.lateness.rest(missed_periods);
        } else if self.lateness.is_too_late(wake.began_ns, missed_periods) {
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
        // Ramps and the slew limit go by our own clock: they must end even if the device's stands still.
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds between two ticks")]
        let our_elapsed_s = self
            .rig
            .step_s(wake.began_ns.saturating_sub(self.last_began_ns) as f64 * 1e-9);
        self.last_began_ns = wake.began_ns;
        let (coupling_force, command_force) = self.render(elapsed_s, our_elapsed_s);
        let computed_ns = self.link_time_ns();
        let written = self.device.write(command_force, self.rig.is_live());
        if written.is_err() {
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
        self.answer(new_scene, command);
        self.answer_stop(written);
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
    ///
    /// # Errors
    /// The device could not be written.
    pub(crate) fn zero_force(&mut self) -> Result<Written, DeviceError> {
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
        // A stop that came after the command was sent wins over it; and until the device has taken its zero force, no other may follow.
        let early = word.command == Command::Engage && self.stop_pending.is_some();
        // What was checked before an engagement was checked of one device.
        let elsewhere = word.command == Command::Engage && !self.shared.is_admitted(self.device.connection());
        let refused = early || elsewhere || word.overtaken_by(stops) || self.rig.command(word.command).is_err();
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
        match self.pass_limits(on_hand, gain, elapsed_s, our_elapsed_s) {
            Ok(force) => (coupling_force, force),
            Err(_) => {
                self.rig.fail(Fault::NonFiniteForce);
                (0.0, 0.0)
            }
        }
    }

    /// The force that the limits let through, with what the passivity controller adds, N.
    fn pass_limits(
        &mut self,
        on_hand: f64,
        gain: f64,
        elapsed_s: f64,
        our_elapsed_s: f64,
    ) -> Result<f64, NonFiniteForce> {
        let mut limiter = self.limiter;
        let surface = limiter.limit(on_hand, gain, our_elapsed_s)?;
        let wanted = self
            .passivity
            .observe(elapsed_s, self.device_position, self.device_velocity, surface);
        if wanted == 0.0 {
            self.limiter = limiter;
            return Ok(surface);
        }
        let force = self.limiter.limit(on_hand + wanted, gain, our_elapsed_s)?;
        self.passivity.applied(force);
        Ok(force)
    }

    /// Confirms a stop once the device has taken the zero force. Where there is no device, nobody shall wait for that.
    fn answer_stop(&mut self, written: Result<Written, DeviceError>) {
        let heard = match written {
            Ok(Written::Taken) => true,
            Ok(Written::Later) => return,
            Err(_) => false,
        };
        if let Some((stops, state)) = self.stop_pending.take() {
            let stopped = Stopped {
                tick: self.tick,
                state,
                heard,
            };
            self.shared.answers.stopped(stops, stopped);
        }
    }

    fn answer(&self, new_scene: bool, command: Option<(CommandWord, bool)>) {
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
        self.left_s = (self.left_s - elapsed_s).max(0.0);
        self.now()
    }
}

#[cfg(test)]
mod tests;
