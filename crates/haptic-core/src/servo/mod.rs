//! The servo: everything between a measurement and a force, as one value.
//!
//! ```text
//! Inputs -> stop, stall, lease -> scene -> command -> sensing -> Renderer::tick -> Compensator -> SafetyLimiter -> Outputs
//! ```
//!
//! A servo has no clock, no device and no shared memory. Two servos with the same [`Settings`] that
//! are stepped through the same scenes and [`Inputs`] give the same [`Outputs`] to the last bit, on
//! any machine and in any build: a recording of the inputs holds every force.

mod fault;
mod force;
mod force_offset;
mod inputs;
mod ramp;
mod rig;
mod sensing;
mod state;
mod transition;

pub use fault::Fault;
pub use inputs::{Event, Events, InputWord, Inputs};
pub use sensing::{DECAY_S, SILENT_PERIODS};
pub use state::{Command, RigState};
pub use transition::{CompiledScene, Steps, Transition};

use crate::compensation::{Compensation, Compensator};
use crate::limiter::{Limits, SafetyLimiter};
use crate::passivity::{PassivityObserver, RigLosses};
use crate::sample::Motor;
use crate::sample_clock::{SampleClock, seconds};
use crate::velocity;
use alloc::boxed::Box;
use force::Forces;
use force_offset::ForceOffset;
use rig::{Refused, Rig};
use sensing::{Sensed, Sensing};
use transition::FadingScene;

/// Longest release that nobody asked for at this moment, s: the client that held a lease is gone.
const LAPSED_RELEASE_S: f64 = 0.2;

/// Longest release after the control thread is lost, s.
const LOST_RELEASE_S: f64 = 0.04;

/// Time within which a device must report its motor off after it was told to, ns: twice the time
/// that its own watchdog may take.
pub const OFF_TIMEOUT_NS: u64 = 100_000_000;

/// Samples that must have come within that time, at least.
const OFF_TIMEOUT_SAMPLES: f64 = 3.0;

/// Along a ramp a step counts for this many periods at most: a stall does not skip the ramp.
const LONGEST_RAMP_STEP_PERIODS: f64 = 5.0;

/// What stays the same from step to step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Settings {
    /// Nominal time between two steps, s (> 0).
    pub period_s: f64,
    /// Time in which force comes and goes, s (> 0).
    pub ramp_s: f64,
    /// Limits of force and motion.
    pub limits: Limits,
    /// What the rig itself takes up.
    pub losses: RigLosses,
    /// Largest force that the passivity controller may add, N (>= 0); zero only observes.
    #[cfg_attr(feature = "serde", serde(rename = "passivity_control_N"))]
    pub passivity_control_n: f64,
    /// How velocity is estimated.
    pub velocity: velocity::Method,
    /// Time for which a device may repeat its last sample, or the loop stand still while force
    /// flows, ns.
    pub stale_ns: u64,
    /// Button of the rig that stops it, by its bit.
    pub stop_button: Option<u8>,
    /// Button of the rig that must be held down for force to flow, by its bit.
    pub enable_button: Option<u8>,
    /// What is compensated of the rig's own friction.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub compensation: Option<Compensation>,
}

/// What a step leads to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs {
    /// Force on the hand, N, to be commanded until the next step.
    pub force_n: f64,
    /// Whether the motor may be driven.
    pub enabled: bool,
    /// Force in the coupling, which drives the block, N.
    pub coupling_force_n: f64,
    /// Position of the hand, m.
    pub device_position_m: f64,
    /// Velocity of the hand, m/s.
    pub device_velocity_mps: f64,
    /// Position of the block, m.
    pub block_position_m: f64,
    /// Velocity of the block, m/s.
    pub block_velocity_mps: f64,
    /// 0 stuck or without force, +1 and -1 sliding.
    pub contact: i8,
    /// Energy that sampling made and the rig did not take up, J.
    pub energy_excess_j: f64,
    /// Whether the command of this step was refused.
    pub refused: bool,
}

/// The whole state between a measurement and a force.
#[derive(Debug)]
pub struct Servo {
    settings: Settings,
    /// Our own clock, from the first step on, ns.
    now_ns: u64,
    scene: Box<CompiledScene>,
    /// The scene before, while its force fades out.
    fading: Option<FadingScene>,
    /// Scenes that are no longer rendered. They are freed elsewhere: a step frees nothing.
    retired: [Option<Box<CompiledScene>>; 2],
    rig: Rig,
    /// Whether force flowed in the step before.
    was_live: bool,
    sensing: Sensing,
    limiter: SafetyLimiter,
    passivity: PassivityObserver,
    compensator: Option<Compensator>,
    offset: ForceOffset,
    /// Since when the device is told to have its motor off, ns.
    off_since_ns: Option<u64>,
}

impl Servo {
    /// A servo without force, of a device that is there.
    #[must_use]
    pub fn new(settings: Settings, scene: Box<CompiledScene>) -> Self {
        Self {
            settings,
            now_ns: 0,
            scene,
            fading: None,
            retired: [None, None],
            rig: Rig::new(settings.ramp_s, LONGEST_RAMP_STEP_PERIODS * settings.period_s),
            was_live: false,
            sensing: Sensing::new(settings.velocity, settings.period_s, settings.stale_ns),
            limiter: SafetyLimiter::new(settings.limits),
            passivity: PassivityObserver::new(settings.losses, settings.passivity_control_n),
            compensator: settings.compensation.map(Compensator::new),
            offset: ForceOffset::default(),
            off_since_ns: None,
        }
    }

    /// One step: what the device said leads to a force. A scene that arrives is rendered from this
    /// step on; take what is [`retired`](Self::take_retired) before another one arrives.
    // A loop steps its servo in one place: this and what every step passes through is compiled into it, and
    // its inputs and outputs stay in registers.
    #[inline(always)]
    pub fn step(&mut self, inputs: &Inputs, scene: Option<Box<CompiledScene>>) -> Outputs {
        self.now_ns = self.now_ns.saturating_add(inputs.elapsed_ns);
        self.check_events(inputs);
        if let Some(scene) = scene {
            self.change_scene(scene);
        }
        let refused = inputs.command.is_some_and(|command| self.command(command).is_err());
        // Ramps and the slew limit go by our own clock: they end even if the device's stands still.
        let our_elapsed_s = self.rig.step_s(seconds(inputs.elapsed_ns));
        if self.limiter.is_moving() {
            self.limiter.advance(our_elapsed_s);
        }
        self.limiter.set_device_force(inputs.device_force_limit_n);
        let elapsed_s = self.sense(inputs);
        self.check_device();
        let Forces {
            coupling,
            on_hand,
            enabled,
        } = self.render(elapsed_s, our_elapsed_s, inputs.device_resolution_m);
        let block = self.scene.renderer.shown();
        Outputs {
            force_n: on_hand,
            enabled,
            coupling_force_n: coupling,
            device_position_m: self.sensing.position_m(),
            device_velocity_mps: self.sensing.velocity_mps(),
            block_position_m: block.position,
            block_velocity_mps: block.velocity,
            // Without force there is no surface to touch.
            contact: if enabled { block.contact.as_number() } else { 0 },
            energy_excess_j: self.passivity.excess_j(),
            refused,
        }
    }

    /// The device cannot be written, or is yet to be found.
    pub fn disconnect(&mut self) {
        self.rig.device_present(false);
    }

    /// The next sample is the first of another device.
    pub fn forget_device(&mut self) {
        self.sensing.forget();
    }

    /// Another rig is there, or more is known of it. While force flows nothing changes.
    pub fn set_rig(&mut self, losses: RigLosses, compensation: Option<Compensation>) {
        if self.rig.is_live() {
            return;
        }
        self.settings.losses = losses;
        self.settings.compensation = compensation;
        self.passivity = PassivityObserver::new(losses, self.settings.passivity_control_n);
        self.compensator = compensation.map(Compensator::new);
    }

    /// Goes on with other limits, also while force flows: [`SafetyLimiter::set_limits`], over the ramp of engaging.
    pub fn set_limits(&mut self, limits: Limits) {
        self.settings.limits = limits;
        self.limiter.set_limits(limits, self.settings.ramp_s);
    }

    /// However long the loop stands still, that is not a fault from now on.
    pub fn disregard_stalls(&mut self) {
        self.settings.stale_ns = u64::MAX;
    }

    /// What stays the same from step to step.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The estimate of velocity, for a servo that goes on where another one was.
    pub fn estimator_mut(&mut self) -> &mut velocity::Estimator {
        self.sensing.estimator_mut()
    }

    /// What is known of the device's clock, for a servo that goes on where another one was.
    pub fn clock_mut(&mut self) -> &mut SampleClock {
        self.sensing.clock_mut()
    }

    /// Sets our own clock, ns, by which samples are timed, for a servo that goes on where another one was.
    pub fn set_now_ns(&mut self, now_ns: u64) {
        self.now_ns = now_ns;
    }

    /// State of the rig.
    #[must_use]
    pub fn state(&self) -> RigState {
        self.rig.state()
    }

    /// Why the rig is faulted, or stopped by its own button.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.rig.fault()
    }

    /// What the device says of its motor.
    #[must_use]
    pub fn motor(&self) -> Motor {
        self.sensing.motor()
    }

    /// Samples so far that no hand can have made, and that were not rendered.
    #[must_use]
    pub fn samples_forgotten(&self) -> u64 {
        self.sensing.forgotten()
    }

    /// The scene that is rendered.
    #[must_use]
    pub fn scene(&self) -> &CompiledScene {
        &self.scene
    }

    /// Whether there is a scene that is no longer rendered.
    #[must_use]
    pub fn has_retired(&self) -> bool {
        self.retired.iter().any(Option::is_some)
    }

    /// A scene that is no longer rendered, for whoever may free it.
    pub fn take_retired(&mut self) -> Option<Box<CompiledScene>> {
        self.retired.iter_mut().find_map(Option::take)
    }

    fn retire(&mut self, scene: Box<CompiledScene>) {
        match self.retired.iter_mut().find(|slot| slot.is_none()) {
            Some(slot) => *slot = Some(scene),
            // The caller did not take what was retired: a leak is better than freeing here.
            None => core::mem::forget(scene),
        }
    }

    /// Whether everything goes on that must for force to flow.
    fn check_events(&mut self, inputs: &Inputs) {
        let events = inputs.events;
        let stood_still = inputs.elapsed_ns > self.settings.stale_ns;
        if events.is_empty() && !stood_still {
            return;
        }
        if events.has(Event::Stop) {
            self.rig.stop();
        }
        if !self.rig.is_live() {
            return;
        }
        if stood_still || events.has(Event::Slept) {
            self.rig.fail(Fault::Stalled);
        } else if events.has(Event::TooLate) {
            self.rig.fail(Fault::TooLate);
        }
        if events.has(Event::LeaseLapsed) {
            self.rig.release_within(LAPSED_RELEASE_S);
        }
        if events.has(Event::ControlLost) {
            self.rig.release_into(Fault::ControlLost, LOST_RELEASE_S);
        }
    }

    fn change_scene(&mut self, mut new: Box<CompiledScene>) {
        let step = new.renderer.take_over(&self.scene.renderer);
        let fade_s = match new.transition {
            Transition::Fade { over_s } => over_s,
            Transition::AtOnce | Transition::Steps(_) => 0.0,
        };
        let old = core::mem::replace(&mut self.scene, new);
        if let Some(before) = self.fading.take() {
            // The force of a scene that was still fading fades on as every step of force does.
            self.offset.add(before.excess());
            self.retire(before.into_scene());
        }
        if fade_s > 0.0 && self.rig.is_live() {
            self.fading = Some(FadingScene::new(old, fade_s));
        } else {
            self.offset.add(step);
            self.retire(old);
        }
    }

    /// Whether the scene comes in step by step, or another one fades out.
    #[inline(always)]
    fn is_changing(&self) -> bool {
        matches!(self.scene.transition, Transition::Steps(_)) || self.fading.is_some()
    }

    /// Carries on with a change of scene that takes its time; ends it at once while no force flows.
    #[inline(never)]
    fn carry_on_change(&mut self, elapsed_s: f64) {
        let CompiledScene {
            renderer, transition, ..
        } = &mut *self.scene;
        if let Transition::Steps(steps) = transition {
            if self.was_live {
                if let Some(step) = steps.advance(elapsed_s, renderer) {
                    self.offset.add(step);
                }
            } else {
                steps.finish(renderer);
            }
        }
        let elapsed_s = if self.was_live { elapsed_s } else { f64::INFINITY };
        if let Some(faded) = self.fading.take_if(|fading| fading.is_over_after(elapsed_s)) {
            self.retire(faded.into_scene());
        }
    }

    fn command(&mut self, command: Command) -> Result<(), Refused> {
        // Nobody engages without the enable button, against the stop button, or a motor without
        // force.
        if command == Command::Engage
            && (self.is_pressed(self.settings.stop_button)
                || self.is_enable_button_open()
                || self.limiter.force_n() == 0.0)
        {
            return Err(Refused);
        }
        self.rig.command(command)?;
        if command == Command::Reset {
            // The motor may have been switched off meanwhile: the next samples tell.
            self.off_since_ns = None;
        }
        Ok(())
    }

    fn is_pressed(&self, button: Option<u8>) -> bool {
        button.is_some_and(|button| self.sensing.is_pressed(button))
    }

    fn is_enable_button_open(&self) -> bool {
        let button = self.settings.enable_button;
        button.is_some() && !self.is_pressed(button)
    }

    /// Takes in what the device said; returns the time since the last sample, s. A failed or stale
    /// read is never rendered as a position.
    #[inline(always)]
    fn sense(&mut self, inputs: &Inputs) -> f64 {
        // Only with force on the hand does it matter whether a hand can move so.
        let live = self.rig.is_live() && self.was_live;
        let sensed = self.sensing.sense(
            inputs.sample,
            self.now_ns,
            inputs.device_resolution_m,
            live,
            &self.limiter,
        );
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

    /// The rig's own buttons, and whether its motor is off after it was told to be.
    #[inline(always)]
    fn check_device(&mut self) {
        if self.is_pressed(self.settings.stop_button) {
            self.rig.press_stop();
        }
        if self.is_enable_button_open() {
            self.rig.open_enable_button();
        }
        if self.rig.is_live() || self.sensing.is_new_device() {
            self.off_since_ns = None;
            return;
        }
        let since_ns = *self.off_since_ns.get_or_insert(self.now_ns);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few periods of at most a second, ns"
        )]
        let samples_ns = (OFF_TIMEOUT_SAMPLES * self.sensing.period_s() * 1e9) as u64;
        let told_for_ns = self.now_ns.saturating_sub(since_ns);
        if self.sensing.motor() == Motor::Enabled && told_for_ns > OFF_TIMEOUT_NS.max(samples_ns) {
            self.rig.alarm(Fault::StillEnabled);
        }
    }
}

#[cfg(test)]
mod tests;
