//! From where the hand is to the force on it: scene, compensation, limits, passivity.

use super::fault::Fault;
use super::force_offset::ForceOffset;
use super::servo::Servo;
use crate::compensation::Motion;
use crate::limiter::NonFiniteForce;

/// What a step renders.
#[derive(Clone, Copy, Debug)]
pub(super) struct Forces {
    /// Force in the coupling, N.
    pub(super) coupling: f64,
    /// Force on the hand, N.
    pub(super) on_hand: f64,
    /// Whether the motor may be driven: the rig is live after the step.
    pub(super) enabled: bool,
}

impl Forces {
    const NONE: Self = Self {
        coupling: 0.0,
        on_hand: 0.0,
        enabled: false,
    };
}

impl Servo {
    /// The forces of a step.
    #[inline(always)]
    pub(super) fn render(&mut self, elapsed_s: f64, our_elapsed_s: f64, resolution: f64) -> Forces {
        if self.is_changing() {
            self.carry_on_change(our_elapsed_s);
        }
        let (position, velocity) = (self.sensing.position_m(), self.sensing.velocity_mps());
        if !self.was_live || !self.rig.is_live() {
            // Without force the block goes with the hand. So force begins wherever the hand has
            // come to meanwhile, and at the very bottom of the ramp.
            self.scene.renderer.start_at(position, velocity);
            self.offset = ForceOffset::default();
            self.sensing.rest();
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
        if !self.sensing.is_steady(self.now_ns) {
            if elapsed_s > 0.0 && self.sensing.is_silent() {
                // All force had decayed: the surface grips the hand again where it is, without the force
                // that the way there would have built up.
                self.scene.renderer.start_at(position, velocity);
                elapsed_s = 0.0;
            }
            gain *= self.sensing.share(self.now_ns, our_elapsed_s);
        }
        let mut coupling_force = self.scene.renderer.tick(elapsed_s, position, velocity).coupling_force;
        if let Some(fading) = &mut self.fading {
            coupling_force += fading.tick(elapsed_s, position, velocity, coupling_force);
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
        let limited = if self.scene.renderer.is_motion() {
            self.limit_motion(on_hand, gain, our_elapsed_s)
        } else {
            let compensation = if self.compensator.is_some() {
                self.compensate(elapsed_s, resolution)
            } else {
                0.0
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

    /// The force of a pulse or an excitation, N. It is bounded by itself and gives energy on purpose:
    /// nothing is added to it.
    #[inline(never)]
    fn limit_motion(&mut self, on_hand: f64, gain: f64, our_elapsed_s: f64) -> Result<f64, NonFiniteForce> {
        self.passivity.rest();
        if let Some(compensator) = &mut self.compensator {
            compensator.rest();
        }
        self.limiter.limit(on_hand, gain, our_elapsed_s)
    }

    /// The force that compensates the rig's own friction, N.
    #[inline(never)]
    fn compensate(&mut self, elapsed_s: f64, resolution: f64) -> f64 {
        let motion = Motion {
            elapsed_s,
            position: self.sensing.position_m(),
            velocity: self.sensing.velocity_mps(),
            resolution,
            // Not the device's own, which is measured: a replay does not know what was before it.
            period_s: self.settings.period_s,
        };
        self.compensator
            .as_mut()
            .map_or(0.0, |compensator| compensator.force(motion))
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
        on_hand: f64,
        compensation: f64,
        gain: f64,
        elapsed_s: f64,
        our_elapsed_s: f64,
    ) -> Result<f64, NonFiniteForce> {
        let surface = self.limiter.limited(on_hand, gain, our_elapsed_s)?;
        let (position, velocity) = (self.sensing.position_m(), self.sensing.velocity_mps());
        // The energy of the compensation counts as made: it is not a part of the surface.
        let added = compensation + self.passivity.observe(elapsed_s, position, velocity, surface);
        let force = if added == 0.0 {
            surface
        } else {
            let force = self.limiter.limited(on_hand + added, gain, our_elapsed_s)?;
            self.passivity.applied(force);
            force
        };
        self.limiter.passed(force);
        if let Some(compensator) = &mut self.compensator {
            compensator.applied(force);
        }
        Ok(force)
    }
}
