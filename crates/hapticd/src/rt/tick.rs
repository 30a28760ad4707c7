//! The way of one sample, from the encoder to the motor.
//!
//! ```text
//! stop? new scene? command? -> device read -> velocity -> Renderer::tick -> SafetyLimiter -> device write -> record, answers
//! ```

use crate::rig_state::{Command, Fault, Rig};
use crate::rt::clock::{Wake, now_ns};
use crate::rt::handoff::{CommandWord, CompiledScene, Heard, Outcome, Shared, Stopped};
use crate::rt::lateness::Lateness;
use crate::rt::sensing::{Sensed, Sensing};
use crate::rt::transition::Transition;
use crate::telemetry::ring::{Producer, TickRecord};
use device_io::{Device, DeviceError, Measurement, Motor, Written};
use haptic_core::limiter::{NonFiniteForce, SafetyLimiter};
use haptic_core::passivity::PassivityObserver;
use haptic_ipc::RigState;
use std::sync::Arc;

pub(crate) use crate::rt::sensing::Velocity;

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
    pub(crate) watches: Watches,
}

/// What must go on for force to flow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watches {
    /// How long a device may repeat its last sample, or the loop stand still while force flows, ns.
    pub(crate) stale_ns: u64,
    /// How long the control thread may give no sign of life, ns.
    pub(crate) control_timeout_ns: u64,
    /// A button of the rig that stops it, by its bit.
    pub(crate) stop_button: Option<u8>,
    /// A button of the rig that must be held down for force to flow, by its bit.
    pub(crate) enable_button: Option<u8>,
}

/// The longest that a release takes which nobody asked for at this moment, s: the client that held a lease is gone.
const LAPSED_RELEASE_S: f64 = 0.2;

/// The longest that the release takes where the control thread is lost, s.
const LOST_RELEASE_S: f64 = 0.04;

/// A device must have its motor off, and have said so, so long after it was told to, ns. That is twice what its own watchdog takes.
const OFF_TIMEOUT_NS: u64 = 100_000_000;

/// Samples that must have come meanwhile, at least.
const OFF_TIMEOUT_SAMPLES: f64 = 3.0;

#[cfg(test)]
impl Parts {
    /// What the tests run with: everything is at work.
    pub(crate) fn of_a_test(ramp_s: f64) -> Self {
        use crate::rt::lateness::LatePolicy;
        use haptic_core::limiter::Limits;
        use haptic_core::passivity::RigLosses;
        use haptic_core::velocity::Method;
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
            watches: Watches {
                stale_ns: 50_000_000,
                control_timeout_ns: 250_000_000,
                stop_button: None,
                enable_button: None,
            },
        }
    }
}

/// A stop whose zero force the device has not confirmed yet.
#[derive(Clone, Copy, Debug)]
struct PendingStop {
    stops: u64,
    /// The state that it brought.
    state: RigState,
    began_ns: u64,
    /// When the zero force was taken by the link, ns.
    written_ns: Option<u64>,
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
    sensing: Sensing,
    watches: Watches,
    limiter: SafetyLimiter,
    passivity: PassivityObserver,
    lateness: Lateness,
    bump: Bump,
    tick: u64,
    stops_seen: u64,
    stop_pending: Option<PendingStop>,
    /// Since when the device is told to have its motor off, ns.
    off_since_ns: Option<u64>,
    last_command: u32,
    last_began_ns: Option<u64>,
    /// How long the machine had slept in all when the tick before began, ns.
    asleep_ns: u64,
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
            watches,
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
            sensing: Sensing::new(velocity, device.resolution_m(), watches.stale_ns),
            watches,
            limiter,
            passivity,
            lateness,
            bump: Bump::none(),
            tick: 0,
            stops_seen: 0,
            stop_pending: None,
            off_since_ns: None,
            last_command: 0,
            last_began_ns: None,
            asleep_ns: 0,
            device,
        }
    }

    /// One tick, from waking up to the answer; returns when it ended.
    pub(crate) fn run(&mut self, wake: Wake, missed_periods: u64) -> u64 {
        let stops = self.shared.stops();
        if stops != self.stops_seen {
            self.stops_seen = stops;
            self.rig.stop();
            self.stop_pending = Some(PendingStop {
                stops,
                state: self.rig.state(),
                began_ns: wake.began_ns,
                written_ns: None,
            });
        }
        let since_last_ns = self.watch(wake, missed_periods);
        let new_scene = self.take_scene();
        let command = self.take_command(stops);

        let measured = self.device.read(wake.began_ns);
        let read_ns = self.link_time_ns();
        if self.sensing.is_new_device() && measured.is_ok() {
            self.limiter.set_device_force(self.device.force_limit_n());
        }
        let elapsed_s = self.sense(measured, wake.began_ns);
        self.watch_device(wake.began_ns);
        // Ramps and the slew limit go by our own clock: they must end even if the device's stands still.
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds between two ticks")]
        let our_elapsed_s = self.rig.step_s(since_last_ns as f64 * 1e-9);
        let (coupling_force, command_force) = self.render(wake.began_ns, elapsed_s, our_elapsed_s);
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
            device_position: self.sensing.position_m(),
            device_velocity: self.sensing.velocity_mps(),
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
        self.answer_stop(written, wake.began_ns, ended_ns);
        self.tick += 1;
        ended_ns
    }

    /// Whether all goes on that must for force to flow: the loop itself, the machine, the leases, the control thread. Returns the time since the tick before, ns.
    fn watch(&mut self, wake: Wake, missed_periods: u64) -> u64 {
        let Watches {
            stale_ns,
            control_timeout_ns,
            ..
        } = self.watches;
        let now_ns = wake.began_ns;
        let since_last_ns = self
            .last_began_ns
            .replace(now_ns)
            .map_or(0, |last_ns| now_ns.saturating_sub(last_ns));
        let slept_ns = wake.asleep_ns.saturating_sub(self.asleep_ns);
        self.asleep_ns = wake.asleep_ns;
        if !self.rig.is_live() {
            self.lateness.rest(missed_periods);
            return since_last_ns;
        }
        if since_last_ns > stale_ns || slept_ns > stale_ns {
            self.rig.fail(Fault::Stalled);
        } else if self.lateness.is_too_late(now_ns, missed_periods) {
            self.rig.fail(Fault::TooLate);
        }
        if self.shared.has_lapsed(now_ns) {
            self.rig.release_within(LAPSED_RELEASE_S);
        }
        if self.shared.silent_ns(now_ns) > control_timeout_ns {
            self.rig.release_into(Fault::ControlLost, LOST_RELEASE_S);
        }
        since_last_ns
    }

    /// The rig's own buttons, and whether its motor is off where it was told to be.
    fn watch_device(&mut self, now_ns: u64) {
        if self.is_pressed(self.watches.stop_button) {
            self.rig.press_stop();
        }
        if self.watches.enable_button.is_some() && !self.is_pressed(self.watches.enable_button) {
            self.rig.let_go();
        }
        if self.rig.is_live() || self.sensing.is_new_device() {
            self.off_since_ns = None;
            return;
        }
        let since_ns = *self.off_since_ns.get_or_insert(now_ns);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few periods of at most a second, ns"
        )]
        let samples_ns = (OFF_TIMEOUT_SAMPLES * self.sensing.period_s() * 1e9) as u64;
        if self.sensing.motor() == Motor::Enabled && now_ns.saturating_sub(since_ns) > OFF_TIMEOUT_NS.max(samples_ns) {
            self.rig.alarm(Fault::StillEnabled);
        }
    }

    fn is_pressed(&self, button: Option<u8>) -> bool {
        button.is_some_and(|button| self.sensing.is_pressed(button))
    }

    /// The time, where it tells what the link takes: a reading of the clock costs more than the physics of a simple scene.
    fn link_time_ns(&self) -> Option<u64> {
        self.device.is_linked().then(now_ns)
    }

    /// Goes on with another device, as if it had been unplugged and another plugged in.
    pub(crate) fn replace_device(&mut self, device: Box<D>) {
        self.device = device;
        self.sensing.forget();
    }

    /// However long it stands still, that is no fault from now on.
    pub(crate) fn disregard_stalls(&mut self) {
        self.watches.stale_ns = u64::MAX;
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
        // A stop that came after the command was sent wins over it. Nobody engages before the device has confirmed the zero force of the last stop, without the enable button, or a motor without force.
        let must_wait = word.command == Command::Engage
            && (self.stop_pending.is_some()
                || self.is_pressed(self.watches.stop_button)
                || (self.watches.enable_button.is_some() && !self.is_pressed(self.watches.enable_button))
                || self.limiter.force_n() == 0.0
                // What was checked before an engagement was checked of one device.
                || !self.shared.is_admitted(self.device.connection()));
        let refused = must_wait || word.overtaken_by(stops) || self.rig.command(word.command).is_err();
        if word.command == Command::Reset && !refused {
            // Its motor may have been switched off meanwhile: the next samples tell.
            self.off_since_ns = None;
        }
        Some((word, refused))
    }

    /// Takes in a measurement; returns the time since the one before, s. A failed or stale read is never rendered as a position.
    fn sense(&mut self, measured: Result<Measurement, DeviceError>, now_ns: u64) -> f64 {
        // Only with force on the hand is it of any concern whether a hand can move so.
        let live = self.rig.is_live() && self.was_live;
        let resolution_m = self.device.resolution_m();
        let forgotten = self.sensing.forgotten();
        let sensed = self.sensing.sense(measured, now_ns, resolution_m, live, &self.limiter);
        if self.sensing.forgotten() != forgotten {
            self.shared.answers.forgotten(self.sensing.forgotten());
        }
        match sensed {
            Sensed::Moved { elapsed_s } => {
                self.rig.device_present(true);
                return elapsed_s;
            }
            Sensed::Unchanged => {}
            Sensed::Faulty(fault) => self.rig.fail(fault),
            Sensed::Gone => self.rig.device_present(false),
            Sensed::Stale => {
                if self.rig.is_live() {
                    self.rig.fail(Fault::Stale);
                }
                self.rig.device_present(false);
            }
        }
        0.0
    }

    /// The force in the coupling and the force on the hand, N.
    fn render(&mut self, now_ns: u64, elapsed_s: f64, our_elapsed_s: f64) -> (f64, f64) {
        self.go_on_changing(our_elapsed_s);
        let renderer = &mut self.scene.renderer;
        if !self.was_live || !self.rig.is_live() {
            // Without force the block goes with the hand, and from there force begins: wherever the hand has come to meanwhile,
            // and at the very bottom of the ramp.
            renderer.start_at(self.sensing.position_m(), self.sensing.velocity_mps());
            self.bump = Bump::none();
            self.limiter.zero();
            self.passivity.rest();
            self.sensing.rest();
            self.was_live = self.rig.is_live();
            return (0.0, 0.0);
        }
        if !self.limiter.allows_speed(self.sensing.velocity_mps()) {
            self.rig.fail(Fault::TooFast);
            return (0.0, 0.0);
        }
        let elapsed_s = if elapsed_s > 0.0 && self.sensing.is_silent() {
            // All force had decayed: it begins anew from where the hand has come to, rather than with what the way there would have built up.
            renderer.start_at(self.sensing.position_m(), self.sensing.velocity_mps());
            0.0
        } else {
            elapsed_s
        };
        let gain = self.rig.advance(our_elapsed_s) * self.sensing.share(now_ns, our_elapsed_s);
        self.was_live = self.rig.is_live();
        let (position, velocity) = (self.sensing.position_m(), self.sensing.velocity_mps());
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
        let wanted = self.passivity.observe(
            elapsed_s,
            self.sensing.position_m(),
            self.sensing.velocity_mps(),
            surface,
        );
        if wanted == 0.0 {
            self.limiter = limiter;
            return Ok(surface);
        }
        let force = self.limiter.limit(on_hand + wanted, gain, our_elapsed_s)?;
        self.passivity.applied(force);
        Ok(force)
    }

    /// Confirms a stop once the device has said that its motor is off; one that says nothing of its motor, once it has taken the zero force. Where there is no device, nobody
    /// shall wait for that, and nobody waits for ever.
    fn answer_stop(&mut self, written: Result<Written, DeviceError>, began_ns: u64, now_ns: u64) {
        let Some(pending) = &mut self.stop_pending else {
            return;
        };
        if written == Ok(Written::Taken) {
            pending.written_ns.get_or_insert(now_ns);
        }
        let heard = match (written, self.sensing.motor()) {
            (Err(_), _) => Heard::NoDevice,
            (Ok(Written::Taken), Motor::Unreported | Motor::Off) => Heard::Confirmed,
            _ if began_ns.saturating_sub(pending.began_ns) >= OFF_TIMEOUT_NS => Heard::Unconfirmed,
            _ => return,
        };
        let stopped = Stopped {
            tick: self.tick,
            state: pending.state,
            heard,
            written_ns: pending.written_ns.unwrap_or(now_ns),
            confirmed_ns: now_ns,
        };
        self.shared.answers.stopped(pending.stops, stopped);
        self.stop_pending = None;
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
