//! Karnopp's stick-slip friction (Karnopp 1985, "Computer simulation of stick-slip friction in
//! mechanical dynamic systems"), with limits that may differ by direction as Richard and Cutkosky
//! fitted them to measured surfaces.
//!
//! ```text
//!  friction            stuck: whatever holds the block, up to Fs
//!     Fs |*
//!     Fd |  .--------''''  Fd + b w
//!        |
//! -------+--------------- w
//! ```
//!
//! Behind a block the stuck state is rigid. On the device itself, where there is no mass to hold
//! still, it is a spring `Kp` that is anchored where the slide ended.
//!
//! Two options: with a [`stribeck_velocity`](Karnopp::stribeck_velocity) friction falls gently from
//! `Fs` to `Fd` as the slide picks up speed, and with a [`rising_rate`](Karnopp::rising_rate) the
//! static limit is `Fd` just after a slide and grows to `Fs` while the block rests.

use super::forces::{check_static_not_below, raise};
use super::law::{self, DEFAULT_CONTACT_STIFFNESS, Law, LawKind};
use crate::block::{CoupledMass, Coupling, ExactBlock, FallingSlide, LinearSlide, RigidLaw, Slides};
use crate::contact::{
    ConstantLimit, Level, Reseat, RisingLimit, SUDDEN_FALL_MPS, SpringContact, SpringState, StaticLimit, Stribeck,
};
use crate::directional::{Direction, Directional};
use crate::parameters::{NotApplicable, Note, NoteKind, Parameter, SceneError, Slot};
use crate::render::{BlockSetup, DeviceSurface, Surface};
use alloc::boxed::Box;
use alloc::vec::Vec;

/// Karnopp friction: limits in newtons, all positive numbers for either direction.
///
/// A block at rest stays at rest while the force on it is within the larger of the static and the
/// dynamic limit. With `static_force >= dynamic_force`, the common case, that is the static limit.
/// With a static limit below the dynamic one a block set loose between the two would be stopped at
/// once by the kinetic friction, so the law's own solution in the sense of Filippov is to stay at
/// rest up to the dynamic limit: see [`Karnopp::breakaway_force`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Karnopp {
    /// `Fs`, N: the force that a block at rest withstands.
    #[cfg_attr(feature = "serde", serde(alias = "Fs"))]
    pub static_force: Directional,
    /// `Fd`, N: kinetic (Coulomb) friction while sliding.
    #[cfg_attr(feature = "serde", serde(alias = "Fd"))]
    pub dynamic_force: Directional,
    /// `b`, N s/m: viscous friction while sliding.
    #[cfg_attr(feature = "serde", serde(alias = "b", alias = "sigma2", default))]
    pub viscous: Directional,
    /// `DV`, m/s: a slide that has been faster than this re-sticks when it falls back to it.
    #[cfg_attr(feature = "serde", serde(alias = "DV", default))]
    pub velocity_threshold: f64,
    /// `ws`, m/s: the velocity over which friction falls from `Fs` to `Fd` (Stribeck's curve). 0,
    /// or less than a micrometer a second: it falls at once.
    #[cfg_attr(
        feature = "serde",
        serde(alias = "ws", alias = "vs", default, skip_serializing_if = "is_zero")
    )]
    pub stribeck_velocity: f64,
    /// `gamma`, 1/s: the rate at which the static limit grows from `Fd` to `Fs` while the block
    /// rests. 0: it is there at once.
    #[cfg_attr(feature = "serde", serde(alias = "gamma", default, skip_serializing_if = "is_zero"))]
    pub rising_rate: f64,
    /// `Kp`, N/m: the stuck spring, on the device itself only, where it is
    /// [`DEFAULT_CONTACT_STIFFNESS`] unless it is given.
    #[cfg_attr(
        feature = "serde",
        serde(
            alias = "Kp",
            alias = "sigma",
            alias = "sigma0",
            default,
            skip_serializing_if = "Option::is_none"
        )
    )]
    pub contact_stiffness: Option<f64>,
    /// What the stuck spring is anchored to, on the device itself only.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub reseat: Option<Reseat>,
}

#[cfg(feature = "serde")]
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks with a reference")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Karnopp {
    /// Plain Karnopp friction with a static and a dynamic limit, N.
    #[must_use]
    pub fn new(static_force: impl Into<Directional>, dynamic_force: impl Into<Directional>) -> Self {
        Self {
            static_force: static_force.into(),
            dynamic_force: dynamic_force.into(),
            viscous: Directional::both(0.0),
            velocity_threshold: 0.0,
            stribeck_velocity: 0.0,
            rising_rate: 0.0,
            contact_stiffness: None,
            reseat: None,
        }
    }

    /// The force, N, at which a block that has rested starts to slide, by direction.
    #[must_use]
    pub fn breakaway_force(&self) -> Directional {
        self.static_force.zip(self.dynamic_force, f64::max)
    }

    /// Stribeck's curve, where there is one.
    fn curve(&self) -> Option<Stribeck> {
        let falls = self.stribeck_velocity >= SUDDEN_FALL_MPS && self.static_force != self.dynamic_force;
        falls.then(|| Stribeck::new(self.static_force, self.dynamic_force, self.stribeck_velocity))
    }

    /// Whether the static limit depends on the time at rest.
    fn rises(&self) -> bool {
        let above = |held: f64, sliding: f64| held > sliding;
        self.rising_rate > 0.0
            && (above(self.static_force.positive, self.dynamic_force.positive)
                || above(self.static_force.negative, self.dynamic_force.negative))
    }

    /// The law as Euler's step sees it.
    pub(super) fn stepped<L: Level, R: StaticLimit>(&self, level: L, static_limit: R) -> RigidLaw<L, R> {
        RigidLaw {
            static_force: self.breakaway_force(),
            static_limit,
            level,
            viscous: self.viscous,
            velocity_threshold: self.velocity_threshold,
            stuck: true,
        }
    }

    fn linear_slide(&self, mass: f64, coupling: &Coupling, direction: Direction) -> LinearSlide {
        LinearSlide::new(
            mass,
            coupling.damping + self.viscous.get(direction),
            coupling.stiffness,
            self.breakaway_force().get(direction),
            self.dynamic_force.get(direction),
        )
    }

    fn falling_slide(&self, mass: f64, coupling: &Coupling, direction: Direction) -> FallingSlide {
        let holds = self.static_force.get(direction).max(self.dynamic_force.get(direction));
        FallingSlide::new(
            self.linear_slide(mass, coupling, direction),
            CoupledMass::new(mass, *coupling, holds),
            self.viscous.get(direction),
            self.stribeck_velocity,
        )
    }

    /// The law under a block. Its slides are compiled for the options that they have.
    fn rigid<R: StaticLimit>(&self, block: &BlockSetup, level: impl Level, limit: R) -> Box<dyn Surface> {
        let &BlockSetup { mass, coupling, .. } = block;
        let threshold = self.velocity_threshold;
        let literal = self.stepped(level, limit);
        let symmetric =
            self.static_force.is_symmetric() && self.dynamic_force.is_symmetric() && self.viscous.is_symmetric();
        if self.curve().is_some() {
            let slides = Slides::<_, 2>::new(|direction| self.falling_slide(mass, &coupling, direction));
            block.by_scheme(ExactBlock::new(mass, coupling, threshold, slides, limit), literal)
        } else if symmetric {
            let slides = Slides::<_, 1>::new(|direction| self.linear_slide(mass, &coupling, direction));
            block.by_scheme(ExactBlock::new(mass, coupling, threshold, slides, limit), literal)
        } else {
            let slides = Slides::<_, 2>::new(|direction| self.linear_slide(mass, &coupling, direction));
            block.by_scheme(ExactBlock::new(mass, coupling, threshold, slides, limit), literal)
        }
    }

    /// The law on the device itself.
    fn contact<L: Level, R: StaticLimit>(&self, level: L, static_limit: R) -> SpringContact<L, R> {
        SpringContact {
            stiffness: Directional::both(self.contact_stiffness.unwrap_or(DEFAULT_CONTACT_STIFFNESS)),
            damping: 0.0,
            static_force: self.static_force,
            static_limit,
            level,
            viscous: self.viscous,
            velocity_threshold: self.velocity_threshold,
            reseat: self.reseat.unwrap_or_default(),
            state: SpringState::AT_REST,
        }
    }
}

impl LawKind for Karnopp {
    const NAME: &'static str = "karnopp";
    const SUMMARY: &'static str =
        "Holds rigidly up to the static force, then slides at the dynamic force (Karnopp 1985)";

    fn defaults() -> Self {
        Self::new(law::STATIC_FORCE, law::DYNAMIC_FORCE)
    }
}

impl Law for Karnopp {
    fn slot(&mut self, parameter: Parameter, on_device: bool) -> Option<Slot<'_>> {
        match parameter {
            Parameter::StaticForce => Some(Slot::Two(&mut self.static_force)),
            Parameter::DynamicForce => Some(Slot::Two(&mut self.dynamic_force)),
            Parameter::Viscous => Some(Slot::Two(&mut self.viscous)),
            Parameter::VelocityThreshold => Some(Slot::One(&mut self.velocity_threshold)),
            Parameter::StribeckVelocity => Some(Slot::One(&mut self.stribeck_velocity)),
            Parameter::RisingRate => Some(Slot::One(&mut self.rising_rate)),
            Parameter::ContactStiffness if on_device => Some(Slot::One(
                self.contact_stiffness.get_or_insert(DEFAULT_CONTACT_STIFFNESS),
            )),
            _ => None,
        }
    }

    fn why_lacking(&self, parameter: Parameter) -> Option<NotApplicable> {
        (parameter == Parameter::ContactStiffness).then_some(NotApplicable::RigidBehindBlock)
    }

    fn misplaced(&self, on_device: bool) -> Option<Parameter> {
        (!on_device && self.contact_stiffness.is_some()).then_some(Parameter::ContactStiffness)
    }

    fn validate(&self, on_device: bool) -> Result<(), SceneError> {
        if !on_device && self.reseat.is_some() {
            return Err(SceneError::ReseatBehindBlock);
        }
        if self.stribeck_velocity >= SUDDEN_FALL_MPS {
            // What rises with speed is no Stribeck curve, and over a velocity as small as one may be it
            // would be stiffer than a tick can follow.
            check_static_not_below(Self::NAME, self.static_force, self.dynamic_force)?;
        }
        Ok(())
    }

    fn comply(&mut self) {
        if self.stribeck_velocity >= SUDDEN_FALL_MPS {
            raise(&mut self.static_force, self.dynamic_force);
        }
    }

    fn notes(&self) -> Vec<Note> {
        if self.curve().is_some() {
            return Vec::new();
        }
        let below = |direction| {
            let (static_force, dynamic_force) = (self.static_force.get(direction), self.dynamic_force.get(direction));
            (static_force < dynamic_force).then_some(Note {
                param: Parameter::StaticForce.in_direction(direction),
                kind: NoteKind::BreakawayAtDynamicForce {
                    static_force,
                    dynamic_force,
                },
            })
        };
        Direction::BOTH.into_iter().filter_map(below).collect()
    }

    fn holding_force(&self) -> Directional {
        self.breakaway_force()
    }

    fn steady_friction(&self, direction: Direction, speed: f64) -> f64 {
        let level = self
            .curve()
            .map_or(self.dynamic_force.get(direction), |curve| curve.at(direction, speed));
        level + self.viscous.get(direction) * speed
    }

    fn contact_stiffness(&self, on_device: bool) -> f64 {
        if on_device {
            self.contact_stiffness.unwrap_or(DEFAULT_CONTACT_STIFFNESS)
        } else {
            0.0
        }
    }

    fn rigid_friction(&self) -> Option<Directional> {
        Some(self.dynamic_force)
    }

    fn damping_of_curve(&self) -> Option<f64> {
        self.curve().map(|_| self.viscous.greatest())
    }

    fn behind_block(&self, block: &BlockSetup) -> Box<dyn Surface> {
        match (self.curve(), self.rises()) {
            (None, false) => self.rigid(block, self.dynamic_force, ConstantLimit),
            (None, true) => self.rigid(block, self.dynamic_force, RisingLimit::new(self.rising_rate)),
            (Some(curve), false) => self.rigid(block, curve, ConstantLimit),
            (Some(curve), true) => self.rigid(block, curve, RisingLimit::new(self.rising_rate)),
        }
    }

    fn on_device(&self) -> Box<dyn Surface> {
        let rising = || RisingLimit::new(self.rising_rate);
        match (self.curve(), self.rises()) {
            (None, false) => Box::new(DeviceSurface::new(self.contact(self.dynamic_force, ConstantLimit))),
            (None, true) => Box::new(DeviceSurface::new(self.contact(self.dynamic_force, rising()))),
            (Some(curve), false) => Box::new(DeviceSurface::new(self.contact(curve, ConstantLimit))),
            (Some(curve), true) => Box::new(DeviceSurface::new(self.contact(curve, rising()))),
        }
    }
}
