//! Bounds of the literal scheme: what its Euler step does to a block at rest, and to a light one.
//!
//! At rest the block goes to and fro by `V` a step. A step that begins at `+V` brakes by the
//! friction of `+V`, the next one by that of `-V`; the two steps subtracted are
//!
//! ```text
//! V (4 M - K T^2 - 2 (B + b) T) = 2 F T
//! ```
//!
//! with `F` and `b` the means of both directions, and `F` the friction at the speed `V`, where it
//! falls with speed. Added, they say where the block trembles: off the hand by the difference of
//! the two frictions over `2 K`. No step ends between the two speeds: a velocity threshold above
//! `V` ends the cycle, and one below it does not.
//!
//! Where friction falls with speed faster than `B + b` rises, the cycle can swing open: then the
//! block goes to and fro irregularly, up to some 2.5 times as fast as in the cycle of its greatest
//! friction. That is not a formula: the scheme itself is run, and what counts is the greatest speed,
//! and half the span of the force.

use super::finding::{About, Check, Finding, at_least, at_most};
use super::{UNFELT_RIPPLE_N, UNSEEN_LIMIT_CYCLE_MPS};
use crate::block::{Block, BlockState, Coupling};
use crate::directional::{Direction, Directional};
use crate::parameters::Parameter;
use crate::renderer::{Renderer, Rendering};
use crate::scene::Scene;
use crate::scheme::Scheme;
use alloc::vec::Vec;
use core::num::NonZeroU32;

/// Ticks of a run of the scheme: it swings open within the first half.
const TICKS: u32 = 20_000;

/// Speeds at which runs begin, over that of the cycle: one swing may have another beside it. From
/// twice the cycle on, a block may creep through its motion for a minute.
const STARTS: [f64; 2] = [1.01, 1.9];

/// Most that a cycle which swings open is faster than that of the greatest friction.
const SWINGS_OPEN_BY: f64 = 3.0;

/// Places of friction's curve that are looked at for a fall.
const PLACES: u32 = 48;

/// A block under the scheme.
struct Literal<'a> {
    scene: &'a Scene,
    block: Block,
    coupling: Coupling,
    period_s: f64,
    substeps: NonZeroU32,
    least_mass: f64,
}

/// How a block at rest trembles.
#[derive(Clone, Copy, Debug, Default)]
struct Trembling {
    /// Amplitude of its velocity, m/s.
    speed: f64,
    /// Amplitude of the coupling force at the ticks, N.
    ripple: f64,
}

pub(super) fn check(scene: &Scene, substeps: NonZeroU32, period_s: f64, findings: &mut Vec<Finding>) {
    let (Some(block), Some(coupling)) = (scene.block, scene.coupling) else {
        return;
    };
    let t = period_s / f64::from(substeps.get());
    let mean = |parameter| scene.value(parameter).map_or(0.0, Directional::mean);
    let damping = coupling.damping + mean(Parameter::Viscous) + mean(Parameter::ContactDamping);
    let stiffness = coupling.stiffness + scene.friction.contact_stiffness(false);
    let least_mass = stiffness * t * t / 4.0 + damping * t / 2.0;
    let heavier = |check, unit, mass: f64| About {
        check,
        parameter: Parameter::Mass,
        unit,
        fixed_by: Some(mass),
    };
    findings.push(at_least(
        heavier(Check::LeastMass, "kg", least_mass),
        block.mass,
        least_mass,
    ));
    let Some(kinetic) = scene.friction.as_law().rigid_friction() else {
        // A contact that gives way comes to rest.
        return;
    };
    let literal = Literal {
        scene,
        block,
        coupling,
        period_s,
        substeps,
        least_mass,
    };
    let Trembling { speed, ripple } = literal.trembling(kinetic);
    let mass = literal.mass_for(kinetic, UNSEEN_LIMIT_CYCLE_MPS);
    findings.push(at_most(
        heavier(Check::LimitCycle, "m/s", mass),
        speed,
        UNSEEN_LIMIT_CYCLE_MPS,
    ));
    let mass = literal.mass_for(kinetic, UNFELT_RIPPLE_N / literal.force_per_speed());
    findings.push(at_most(heavier(Check::Ripple, "N", mass), ripple, UNFELT_RIPPLE_N));
}

impl Literal<'_> {
    fn step_s(&self) -> f64 {
        self.period_s / f64::from(self.substeps.get())
    }

    /// Friction at a speed without its viscous part, in the mean of both directions, N.
    fn friction(&self, speed: f64) -> f64 {
        let law = self.scene.friction.as_law();
        let viscous = self.scene.value(Parameter::Viscous).unwrap_or_default();
        let of = |direction| law.steady_friction(direction, speed) - viscous.get(direction) * speed;
        0.5 * (of(Direction::Positive) + of(Direction::Negative))
    }

    /// The least and the greatest friction, N.
    fn extremes(&self, kinetic: Directional) -> (f64, f64) {
        let (kinetic, held) = (kinetic.mean(), self.scene.friction.as_law().holding_force().mean());
        (kinetic.min(held), kinetic.max(held))
    }

    /// Amplitude of the cycle, m/s; `kinetic` is the friction of a fast slide, N.
    fn amplitude(&self, kinetic: Directional) -> f64 {
        let room = 4.0 * (self.block.mass - self.least_mass);
        if room <= 0.0 {
            return f64::INFINITY;
        }
        let under = |friction: f64| 2.0 * friction * self.step_s() / room;
        let (least, greatest) = self.extremes(kinetic);
        let (mut low, mut high) = (under(least), under(greatest));
        // What friction asks of the speed falls with it, or rises by less than the speed itself.
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return high;
            }
            if under(self.friction(middle)) > middle {
                low = middle;
            } else {
                high = middle;
            }
        }
    }

    /// Whether the block stays in the cycle of such a speed, and comes to it: friction and damping
    /// together rise at every speed of a swing.
    fn is_steady(&self, speed: f64) -> bool {
        let viscous = self.scene.value(Parameter::Viscous).unwrap_or_default();
        let damping = self.coupling.damping + viscous.mean();
        let friction = |k: u32| self.friction(speed * f64::from(k) * SWINGS_OPEN_BY / f64::from(PLACES));
        let step = speed * SWINGS_OPEN_BY / f64::from(PLACES);
        (0..PLACES).all(|k| friction(k + 1) - friction(k) + damping * step >= 0.0)
    }

    /// Force at a tick by the speed of the cycle, N s/m. After an even number of steps a tick finds
    /// the block where the tick before did, and nothing is felt.
    fn force_per_speed(&self) -> f64 {
        if self.substeps.get().is_multiple_of(2) {
            return 0.0;
        }
        self.coupling.stiffness * self.step_s() / 2.0 + self.coupling.damping
    }

    fn trembling(&self, kinetic: Directional) -> Trembling {
        let speed = self.amplitude(kinetic);
        let threshold = self.scene.value(Parameter::VelocityThreshold).unwrap_or_default();
        if speed < threshold.greatest() || speed == 0.0 {
            return Trembling::default();
        }
        if speed.is_finite() && !self.is_steady(speed) {
            return self.run(speed);
        }
        let per_speed = self.force_per_speed();
        Trembling {
            speed,
            ripple: if per_speed > 0.0 { speed * per_speed } else { 0.0 },
        }
    }

    /// Runs the scheme against a hand that rests.
    fn run(&self, speed: f64) -> Trembling {
        let scheme = Scheme::Literal {
            substeps: self.substeps,
        };
        let Ok(at_rest) = Renderer::new(self.scene, scheme, self.period_s) else {
            return Trembling::default();
        };
        // Off the hand by as much as one direction rubs more than the other.
        let law = &self.scene.friction;
        let place = -0.5 * (law.steady_force(speed) + law.steady_force(-speed)) / self.coupling.stiffness;
        let place = if place.is_finite() { place } else { 0.0 };
        let mut greatest = Trembling::default();
        for start in STARTS {
            let mut renderer = at_rest.clone();
            renderer.set_state(BlockState::new(place, start * speed, 0.0, 0.0));
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for tick in 0..TICKS {
                let force = renderer.tick(self.period_s, 0.0, 0.0).coupling_force;
                if tick >= TICKS / 2 {
                    greatest.speed = greatest.speed.max(renderer.shown().velocity.abs());
                    (least, most) = (least.min(force), most.max(force));
                }
            }
            greatest.ripple = greatest.ripple.max(0.5 * (most - least));
        }
        greatest
    }

    /// The mass from which on the block trembles by no more than such a speed, kg.
    fn mass_for(&self, kinetic: Directional, speed: f64) -> f64 {
        let at = |friction: f64, speed: f64| self.least_mass + friction * self.step_s() / (2.0 * speed);
        if speed.is_infinite() {
            self.least_mass
        } else if self.is_steady(speed) {
            at(self.friction(speed), speed)
        } else {
            at(self.extremes(kinetic).1, speed / SWINGS_OPEN_BY)
        }
    }
}
