//! One step: stop, stall and lease, the scene, the command, what was measured, and the force that follows.
//!
//! From where the hand is to the force on it: scene, compensation, limits, passivity.

use super::inputs::{Event, Inputs};
use super::rig::Refused;
use super::sensing::Sensed;
use super::servo::Servo;
use super::state::{Command, Fault};
use super::transition::CompiledScene;
use crate::compensation::SampledMotion;
use crate::limiter::NonFiniteForce;
use crate::renderer::Rendering;
use crate::sample::Motor;
use crate::sample_clock::seconds;
use crate::servo::transition::ForceOffset;
use crate::vector::Vector;
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

impl<V: Vector> Servo<V> {
    /// One step: what the device reported leads to a force. A scene that arrives is rendered from this
    /// step on; take what is [`retired`](Self::take_retired) before another one arrives.
    // A loop steps its servo in one place: this and what every step passes through is compiled into it, and
    // its inputs and outputs stay in registers.
    #[inline(always)]
    pub fn step(&mut self, inputs: &Inputs<V>, scene: Option<Box<CompiledScene<V>>>) -> Outputs<V> {
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
        let forces = self.render(elapsed_s, our_elapsed_s, inputs.device_resolution_m);
        let block = match &self.own_motion {
            None => self.scene.renderer.shown(),
            Some(motion) => motion.shown().along(self.motion_along),
        };
        Outputs {
            force_n: forces.on_hand,
            enabled: forces.enabled,
            coupling_force_n: forces.coupling,
            device_position_m: self.sensing.position_m,
            device_velocity_mps: self.sensing.velocity_mps,
            block_position_m: block.position,
            block_velocity_mps: block.velocity,
            // Without force there is no surface to touch.
            contact: if forces.enabled { block.contact.as_number() } else { 0 },
            energy_excess_j: self.passivity.excess_j(),
            refused,
        }
    }

    /// Checks that everything still holds that must for force to flow.
    fn check_events(&mut self, inputs: &Inputs<V>) {
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

    /// Takes in what the device reported; returns the time since the last sample, s. A failed or stale
    /// read is never rendered as a position.
    #[inline(always)]
    fn sense(&mut self, inputs: &Inputs<V>) -> f64 {
        // Only with force on the hand does it matter whether a hand can move so.
        let live = self.rig.is_live() && self.was_live;
        // A motion of the rig's own makes no step of force of a step of the device.
        let stiffness = match &self.own_motion {
            None => self.scene.renderer.stiffness(),
            Some(_) => 0.0,
        };
        let sensed = self.sensing.sense(
            &inputs.sample,
            self.now_ns,
            inputs.device_resolution_m,
            live,
            stiffness,
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
        let off_for_ns = self.now_ns.saturating_sub(since_ns);
        if self.sensing.motor == Motor::Enabled && off_for_ns > OFF_TIMEOUT_NS.max(samples_ns) {
            self.rig.alarm(Fault::StillEnabled);
        }
    }
}

/// What a step leads to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs<V = f64> {
    /// Force on the hand, N, to be commanded until the next step.
    pub force_n: V,
    /// Whether the motor may be driven.
    pub enabled: bool,
    /// Force in the coupling, which drives the block, N.
    pub coupling_force_n: V,
    /// Position of the hand, m.
    pub device_position_m: V,
    /// Velocity of the hand, m/s.
    pub device_velocity_mps: V,
    /// Position of the block, m.
    pub block_position_m: V,
    /// Velocity of the block, m/s.
    pub block_velocity_mps: V,
    /// 0 stuck or without force, +1 and -1 sliding.
    pub contact: i8,
    /// Energy that sampling made and the rig did not take up, J.
    pub energy_excess_j: f64,
    /// Whether the command of this step was refused.
    pub refused: bool,
}

/// What a step renders.
#[derive(Clone, Copy, Debug)]
pub(super) struct Forces<V> {
    /// Force in the coupling, N.
    pub(super) coupling: V,
    /// Force on the hand, N.
    pub(super) on_hand: V,
    /// Whether the motor may be driven: the rig is live after the step.
    pub(super) enabled: bool,
}

impl<V: Vector> Forces<V> {
    const NONE: Self = Self {
        coupling: V::ZERO,
        on_hand: V::ZERO,
        enabled: false,
    };
}

impl<V: Vector> Servo<V> {
    /// The forces of a step.
    #[inline(always)]
    pub(super) fn render(&mut self, elapsed_s: f64, our_elapsed_s: f64, resolution: f64) -> Forces<V> {
        if self.is_changing() {
            self.carry_on_change(our_elapsed_s);
        }
        let (position, velocity) = (self.sensing.position_m, self.sensing.velocity_mps);
        let is_outside = !position.is_in(self.settings.workspace.as_ref());
        if !self.was_live || !self.rig.is_live() {
            // Without force the block goes with the hand. So force begins wherever the hand has
            // come to meanwhile, and at the very bottom of the ramp.
            self.start_at(position, velocity);
            self.offset = ForceOffset::default();
            self.sensing.rest(is_outside);
            self.rest();
            return Forces {
                enabled: self.rig.is_live(),
                ..Forces::NONE
            };
        }
        if !self.limiter.allows_speed(velocity) {
            self.rig.fail(Fault::TooFast);
            return Forces::NONE;
        }
        let mut gain = self.rig.advance(our_elapsed_s);
        let mut elapsed_s = elapsed_s;
        if is_outside || !self.sensing.is_steady(self.now_ns) {
            if elapsed_s > 0.0 && self.sensing.is_silent() {
                // All force had decayed: the surface grips the hand again where it is, without the force
                // that the path there would have built up.
                self.start_at(position, velocity);
                elapsed_s = 0.0;
            }
            gain *= self.sensing.share(self.now_ns, our_elapsed_s, is_outside);
        }
        let mut coupling_force = match &mut self.own_motion {
            None => self.scene.renderer.render(elapsed_s, position, velocity),
            Some(motion) => {
                let along = self.motion_along;
                if V::AXES > 1 {
                    motion.bound((position - self.motion_from).length(), velocity.length());
                }
                along * motion.tick(elapsed_s, position.dot(along), velocity.dot(along))
            }
        };
        if let Some(fading) = &mut self.fading {
            coupling_force = coupling_force + fading.tick(elapsed_s, position, velocity, coupling_force);
        }
        if !self.rig.is_live() {
            // The ramp has come to its end in this step.
            self.rest();
            return Forces {
                coupling: coupling_force,
                ..Forces::NONE
            };
        }
        let on_hand = -(coupling_force + self.offset.fade(elapsed_s));
        let limited = if self.own_motion.is_some() {
            self.limit_motion(on_hand, gain, our_elapsed_s)
        } else {
            let compensation = if self.compensator.is_some() {
                self.compensate(elapsed_s, resolution)
            } else {
                V::ZERO
            };
            self.apply_limits(on_hand, compensation, gain, elapsed_s, our_elapsed_s)
        };
        match limited {
            Ok(on_hand) => Forces {
                coupling: coupling_force,
                on_hand,
                enabled: true,
            },
            Err(_) => {
                self.rig.fail(Fault::NonFiniteForce);
                Forces::NONE
            }
        }
    }

    /// The block begins anew at the hand, m and m/s, and a motion of the rig's own ends.
    fn start_at(&mut self, position: V, velocity: V) {
        self.scene.renderer.start_at(position, velocity);
        if let Some(motion) = &mut self.own_motion {
            motion.interrupt(position.dot(self.motion_along), velocity.dot(self.motion_along));
        }
    }

    /// The force of a pulse or an excitation, N. It is bounded by itself and gives energy on purpose:
    /// nothing is added to it.
    #[inline(never)]
    fn limit_motion(&mut self, on_hand: V, gain: f64, our_elapsed_s: f64) -> Result<V, NonFiniteForce> {
        self.passivity.rest();
        if let Some(compensator) = &mut self.compensator {
            compensator.rest();
        }
        self.limiter.limit(on_hand, gain, our_elapsed_s)
    }

    /// The force that compensates the rig's own friction, N.
    #[inline(never)]
    fn compensate(&mut self, elapsed_s: f64, resolution: f64) -> V {
        let motion = SampledMotion {
            elapsed_s,
            position: self.sensing.position_m.first(),
            velocity: self.sensing.velocity_mps.first(),
            resolution,
            // Not the device's own, which is measured: a replay does not know what was before it.
            period_s: self.settings.period_s,
        };
        let force = self
            .compensator
            .as_mut()
            .map_or(0.0, |compensator| compensator.force(motion));
        V::of_axes(force, 0.0)
    }

    /// No force flows from this step on, or none did.
    fn rest(&mut self) {
        self.limiter.zero();
        self.passivity.rest();
        if let Some(compensator) = &mut self.compensator {
            compensator.rest();
        }
        self.was_live = self.rig.is_live();
    }

    /// The force that passes the limits, with the compensation and what the passivity controller
    /// adds, N.
    #[inline(always)]
    fn apply_limits(
        &mut self,
        on_hand: V,
        compensation: V,
        gain: f64,
        elapsed_s: f64,
        our_elapsed_s: f64,
    ) -> Result<V, NonFiniteForce> {
        let surface = self.limiter.limited(on_hand, gain, our_elapsed_s)?;
        let (position, velocity) = (self.sensing.position_m, self.sensing.velocity_mps);
        // The energy of the compensation counts as made: it is not a part of the surface.
        let added = compensation + self.passivity.observe(elapsed_s, position, velocity, surface);
        let force = if added == V::ZERO {
            surface
        } else {
            let force = self.limiter.limited(on_hand + added, gain, our_elapsed_s)?;
            self.passivity.applied(force);
            force
        };
        self.limiter.passed(force);
        if let Some(compensator) = &mut self.compensator {
            compensator.applied(force.first());
        }
        Ok(force)
    }
}
