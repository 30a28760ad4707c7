//! Why a value, a scene, or a change to one is refused.

use super::parameter::ParameterKey;
use super::table::{Parameter, known_names, names};
use crate::nearest::suggestion;
use alloc::string::String;
use alloc::vec::Vec;
use thiserror::Error;

/// Why a scene, or a change to one, is refused.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SceneError {
    /// A value lies outside the accepted range.
    #[error("{param} = {value} {unit} is out of range: it must be from {min} to {max} {unit}")]
    OutOfRange {
        /// The parameter, with its direction where one was meant.
        param: ParameterKey,
        /// The value given.
        value: f64,
        /// The smallest value accepted.
        min: f64,
        /// The largest value accepted.
        max: f64,
        /// The unit of all three.
        unit: &'static str,
    },
    /// A value is not a finite number.
    #[error("{param} = {value} is not a finite number: it must be from {min} to {max} {unit}")]
    NotFinite {
        /// The parameter, with its direction where one was meant.
        param: ParameterKey,
        /// The value given.
        value: f64,
        /// The smallest value accepted.
        min: f64,
        /// The largest value accepted.
        max: f64,
        /// The unit of both.
        unit: &'static str,
    },
    /// No parameter has this name.
    #[error("unknown parameter `{name}`{} the parameters are {}", suggestion(*.nearest), known_names())]
    UnknownParameter {
        /// The name given.
        name: String,
        /// The name that was probably meant.
        nearest: Option<&'static str>,
    },
    /// A direction was given to a parameter that has none.
    #[error("`{given}`: {} has one value for both directions", param.info().name)]
    NotDirectional {
        /// The parameter.
        param: Parameter,
        /// The text given.
        given: String,
    },
    /// One request gives the same value twice.
    #[error("{param} is given twice in one change")]
    GivenTwice {
        /// The parameter, with its direction where one was meant.
        param: ParameterKey,
    },
    /// A parameter that the scene does not have.
    #[error("{param} does not apply here: {}; this scene has {}", reason.text(), names(has))]
    NotApplicable {
        /// The parameter, with its direction where one was meant.
        param: ParameterKey,
        /// Why it does not.
        reason: NotApplicable,
        /// Those that it has.
        has: Vec<Parameter>,
    },
    /// What a stuck spring is anchored to, where there is none.
    #[error(
        "reseat does not apply here: behind a block the law `karnopp` holds rigidly; it has a stuck spring on the \
         device itself only"
    )]
    ReseatBehindBlock,
    /// A block without a coupling.
    #[error("a [block] needs a [coupling] to the device, with stiffness (N/m) and damping (N s/m)")]
    BlockWithoutCoupling,
    /// A coupling without a block.
    #[error("a [coupling] holds a [block], and this scene has none: without one, friction acts on the device itself")]
    CouplingWithoutBlock,
    /// The law forbids a static limit below the dynamic one.
    #[error(
        "{param} = {static_force} N is below the dynamic force of {dynamic_force} N, which the law `{law}` forbids: \
         raise it to {dynamic_force} N or more"
    )]
    StaticBelowDynamic {
        /// The static limit, with its direction.
        param: ParameterKey,
        /// The law.
        law: &'static str,
        /// N.
        static_force: f64,
        /// N.
        dynamic_force: f64,
    },
    /// The law goes from the static to the dynamic limit over a velocity, and has none.
    #[error(
        "stribeck_velocity = {velocity} m/s is too small: the law `{law}` goes from the static to the dynamic force \
         over it, so it must be \
         {least} m/s or more, or the two forces equal"
    )]
    NoStribeckVelocity {
        /// The law.
        law: &'static str,
        /// m/s.
        velocity: f64,
        /// The smallest velocity accepted, m/s.
        least: f64,
    },
    /// A bristle's stiction is out of proportion.
    #[error(
        "{param} = {static_force} N is more than {most_ratio} times the dynamic force of {dynamic_force} N: the law \
         `{law}` holds the one with a bristle of the length that the other gives; lower it to {max} N"
    )]
    TooMuchStiction {
        /// The law.
        law: &'static str,
        /// The static limit, with its direction.
        param: ParameterKey,
        /// N.
        static_force: f64,
        /// N.
        dynamic_force: f64,
        /// The largest static limit accepted, N.
        max: f64,
        /// The same as a multiple of the dynamic force.
        most_ratio: f64,
    },
    /// A surface that differs by direction, in the plane.
    #[error("{0} differs by direction, and in the plane there is none: set `{0}` alone", param.info().name)]
    PlaneHasNoDirection {
        /// The parameter.
        param: Parameter,
    },
    /// What is for a rig of one axis.
    #[error("{what} is for a rig of one axis: {instead}")]
    OneAxisOnly {
        /// What it is.
        what: String,
        /// What there is in the plane.
        instead: &'static str,
    },
    /// Nothing holds the block to the device.
    #[error("stiffness = 0 N/m and damping = 0 N s/m: a block needs at least one of them above 0 to be held")]
    NoCoupling,
    /// No time passes from tick to tick.
    #[error("period = {period_s} s: a tick takes a finite time above 0 s")]
    NoPeriod {
        /// The period, s.
        period_s: f64,
    },
    /// The block would oscillate too fast for the rate at which it is rendered.
    #[error(
        "a block of {mass} kg on {stiffness} N/m turns {radians:.0} rad in one tick of {period_us:.1} us; the limit \
         is {limit} rad: \
         raise mass to {mass_needed:.3e} kg, or lower stiffness (with that of the contact) to {stiffness_allowed:.3e} \
         N/m"
    )]
    TooFast {
        /// Mass, kg.
        mass: f64,
        /// Stiffness, N/m.
        stiffness: f64,
        /// The tick, microseconds.
        period_us: f64,
        /// Phase that the free oscillation gains in a tick, rad.
        radians: f64,
        /// The limit, rad.
        limit: f64,
        /// A mass that is within it, kg.
        mass_needed: f64,
        /// A stiffness that is within it, N/m.
        stiffness_allowed: f64,
    },
    /// A block on a curved law would settle too fast for the rate at which it is rendered.
    #[error(
        "a block of {mass} kg under {damping} N s/m settles {decays:.0} times in one tick of {period_us:.1} us; the \
         limit of the law `{law}` is {limit}: raise mass to {mass_needed:.3e} kg, or lower the damping (of coupling, \
         contact and drag together) to {damping_allowed:.3e} N s/m"
    )]
    TooDamped {
        /// The law.
        law: &'static str,
        /// Mass, kg.
        mass: f64,
        /// All damping together, N s/m.
        damping: f64,
        /// The tick, microseconds.
        period_us: f64,
        /// Time constants in a tick.
        decays: f64,
        /// The limit.
        limit: f64,
        /// A mass that is within it, kg.
        mass_needed: f64,
        /// A damping that is within it, N s/m.
        damping_allowed: f64,
    },
}

/// Why a scene does not have a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotApplicable {
    /// It is one of the block or its coupling, and there is no block.
    NoBlock,
    /// The law does not have it.
    Law(&'static str),
    /// Behind a block the law's contact is rigid.
    RigidBehindBlock,
}

impl NotApplicable {
    fn text(self) -> String {
        match self {
            Self::NoBlock => String::from("there is no block, so friction acts on the device itself"),
            Self::Law(law) => alloc::format!("the law `{law}` does not have it"),
            Self::RigidBehindBlock => String::from(
                "behind a block the law `karnopp` holds rigidly; it has a stuck spring on the device itself only",
            ),
        }
    }
}

/// Whether a value lies in its parameter's range.
///
/// # Errors
/// [`SceneError::NotFinite`] or [`SceneError::OutOfRange`], about the parameter as `param` names
/// it.
pub(crate) fn check_range(param: ParameterKey, value: f64) -> Result<(), SceneError> {
    let info = param.parameter.info();
    let (min, max, unit) = (info.min, info.max, info.unit);
    if !value.is_finite() {
        return Err(SceneError::NotFinite {
            param,
            value,
            min,
            max,
            unit,
        });
    }
    if value < min || value > max {
        return Err(SceneError::OutOfRange {
            param,
            value,
            min,
            max,
            unit,
        });
    }
    Ok(())
}
