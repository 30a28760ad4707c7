//! One step: stop, stall and lease, the scene, the command, what was measured, and the force that follows.

use super::fault::Fault;
use super::force::Forces;
use super::inputs::{Event, Inputs};
use super::rig::Refused;
use super::sensing::Sensed;
use super::servo::Servo;
use super::state::Command;
use super::transition::CompiledScene;
use crate::sample::Motor;
use crate::sample_clock::seconds;
use alloc::boxed::Box;

/// Longest release that nobody asked for at this moment, s: the client that held a lease is gone.
const LAPSED_RELEASE_S: f64 = 0.2;

/// Longest release after the control thread is lost, s.
const LOST_RELEASE_S: f64 = 0.04;

/// Time within which a device must report its motor off after the command, ns: twice the time
/// that its own watchdog may take.
pub const OFF_TIMEOUT_NS: u64 = 100_000_000;

/// Samples that must have come within that time, at least.
const OFF_TIMEOUT_SAMPLES: f64 = 3.0;

impl Servo {
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

    /// Checks that everything still holds that must for force to flow.
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
            // The motor may have been switched off meanwhile: the next samples show it.
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
            self.scene.renderer.stiffness(),
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

    /// The rig's own buttons, and whether its motor is off after the command.
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
