//! Typed errors on the wire.

use haptic_core::Parameter;
use haptic_core::friction::SUDDEN_FALL_MPS;
use haptic_core::scene::SceneError;
use serde::{Deserialize, Serialize};

/// The end of a refusal of a scene that would chatter: how a command or a request accepts the scene.
pub const ANYWAY: &str = "; `--anyway` (`\"anyway\":true`) does it all the same";

/// Programs use the code. A refusal changes nothing, but a `stop` acts whatever its answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ErrorCode {
    /// Not JSON; nor are NaN and infinity.
    BadJson,
    /// More than 65536 bytes (`max`).
    LineTooLong,
    /// A field is missing, or has the wrong type.
    BadRequest,
    /// The `op` is unknown.
    UnknownOp,
    /// The field is unknown.
    UnknownField,
    /// The parameter is unknown.
    UnknownParameter,
    /// The parameter has one value for both directions.
    NotDirectional,
    /// The value, or the length of a name, is outside `min` to `max`.
    OutOfRange,
    /// The scene's file has an infinite number or NaN.
    NotFinite,
    /// A field, or a parameter by name and by symbol.
    GivenTwice,
    /// Stiffness and damping are both 0.
    NoCoupling,
    /// The scene's law lacks this parameter, or there is no block.
    NotApplicable,
    /// This combination of values.
    LawForbids,
    /// Block and coupling need each other.
    BlockAndCoupling,
    /// The block would oscillate or settle too fast.
    TooFastForRate,
    /// A person has stopped the rig: check that it is safe, then `reset`.
    Stopped,
    /// A check has taken the force away: fix the cause that `status` names, then `reset`.
    Faulted,
    /// The rig's state forbids it.
    WrongState,
    /// The scene has changed since `if_revision`: `get`, and try again.
    Conflict,
    /// Scheduled changes wait for their ticks.
    Scheduled,
    /// None has this name, or all of it is rendered.
    NoSuchSchedule,
    /// Nothing to undo.
    NothingToUndo,
    /// Nothing was undone, or the scene has changed since.
    NothingToRedo,
    /// The library lacks the name, or the revision is not kept.
    NoSuchScene,
    /// `replace` replaces a saved one.
    SceneExists,
    /// A name has at most 64 letters, digits, `-`, `_`, `.` and spaces, the first a letter or digit.
    BadName,
    /// It cannot be read or written, is irregular or too large, or its disk does not answer within 2 s.
    SceneFile,
    /// The record of the rig cannot be written.
    StateFile,
    /// It cannot be read, or has a wrong value.
    ConfigFile,
    /// The daemon serves neither your user nor your groups.
    NotPermitted,
    /// The watchers' socket only reads and stops.
    ReadOnly,
    /// All places are taken: you may only `stop`.
    TooManyClients,
    /// The rig is stopped, but no device is connected: if its motor pulls, cut its power.
    NoDevice,
    /// The rig is stopped, but the device has not confirmed within 100 ms that its motor is off: cut its power.
    NotConfirmed,
    /// The device reports a force limit of 0 N.
    NoForce,
    /// The device does not switch its motor off within 200 ms (`max`) when the daemon falls silent.
    NoWatchdog,
    /// The device lacks the button of `stop-button` or `enable-button`.
    NoButton,
    /// Many of the last round trips took longer than `stale-ms` and a sample period.
    CommandsLate,
    /// The device sends samples and confirms no command.
    CommandsIgnored,
    /// The rig was never commissioned, or its resolution or direction has changed since.
    NotCommissioned,
    /// The device has no serial number, or its hello has changed since the commissioning.
    MaybeAnotherRig,
    /// The device's time stamps stand still, run too fast or too slow, or jump.
    DeviceClock,
    /// The loop would oscillate by itself; `param` = `max`, if given, passes with a factor of 2.
    WouldChatter,
    /// `--compensate` needs the rig's own friction, which was never identified or has changed since.
    NotIdentified,
    /// A client commissions or identifies the rig; `stop` ends that.
    Commissioning,
    /// The rig is a real one, or a fake one without `--hand mouse`.
    NoHand,
    /// Another client has moved the hand within the last 200 ms.
    HandHeld,
    /// The real-time thread has not answered for a second: if the motor still pulls, cut its power.
    NotResponding,
    /// The server is of a later version and uses a code that this client does not know.
    #[serde(other)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unknown,
}

/// An error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WireError {
    /// Why the request was refused.
    pub code: ErrorCode,
    /// The error with its remedy, for people.
    pub message: String,
    /// The parameter or field concerned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub param: Option<String>,
    /// The value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The smallest value accepted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// The largest value accepted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// The unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
}

impl WireError {
    /// An error that concerns no parameter.
    #[must_use]
    pub fn new(code: ErrorCode, message: impl Into<String>) -> Self {
        Self {
            code,
            message: message.into(),
            param: None,
            value: None,
            min: None,
            max: None,
            unit: None,
        }
    }

    /// The same error, naming the field that it concerns.
    #[must_use]
    pub fn about(mut self, param: impl Into<String>) -> Self {
        self.param = Some(param.into());
        self
    }

    /// The same error, with the value refused.
    #[must_use]
    pub fn given(mut self, value: f64) -> Self {
        // JSON has no NaN or infinity; the message names them.
        self.value = value.is_finite().then_some(value);
        self
    }

    /// The same error, with the value refused, the range accepted, and the unit of both.
    #[must_use]
    pub fn within(mut self, value: f64, min: f64, max: f64, unit: &str) -> Self {
        self = self.given(value);
        self.min = Some(min);
        self.max = Some(max);
        self.unit = Some(unit.to_owned());
        self
    }
}

impl std::fmt::Display for WireError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for WireError {}

impl From<SceneError> for WireError {
    fn from(error: SceneError) -> Self {
        let message = error.to_string();
        let code = match error {
            SceneError::NotFinite { .. } => ErrorCode::NotFinite,
            _ => ErrorCode::OutOfRange,
        };
        match error {
            SceneError::OutOfRange {
                param,
                value,
                min,
                max,
                unit,
            }
            | SceneError::NotFinite {
                param,
                value,
                min,
                max,
                unit,
            } => Self::new(code, message)
                .about(param.to_string())
                .within(value, min, max, unit),
            SceneError::UnknownParameter { name, .. } => Self::new(ErrorCode::UnknownParameter, message).about(name),
            SceneError::NotDirectional { given, .. } => Self::new(ErrorCode::NotDirectional, message).about(given),
            SceneError::PlaneHasNoDirection { param } => {
                Self::new(ErrorCode::NotApplicable, message).about(param.info().name)
            }
            SceneError::OneAxisOnly { what, .. } => Self::new(ErrorCode::NotApplicable, message).about(what),
            SceneError::GivenTwice { param } => Self::new(ErrorCode::GivenTwice, message).about(param.to_string()),
            SceneError::NoCoupling => Self::new(ErrorCode::NoCoupling, message).about("stiffness"),
            SceneError::NoPeriod { .. } => Self::new(ErrorCode::OutOfRange, message).about("period"),
            SceneError::TooFast { radians, limit, .. } => Self::new(ErrorCode::TooFastForRate, message)
                .about("mass")
                .within(radians, 0.0, limit, "rad"),
            SceneError::TooDamped { decays, limit, .. } => Self::new(ErrorCode::TooFastForRate, message)
                .about("mass")
                .within(decays, 0.0, limit, "1"),
            SceneError::NotApplicable { param, .. } => {
                Self::new(ErrorCode::NotApplicable, message).about(param.to_string())
            }
            SceneError::ReseatBehindBlock => Self::new(ErrorCode::NotApplicable, message).about("reseat"),
            SceneError::BlockWithoutCoupling => Self::new(ErrorCode::BlockAndCoupling, message).about("coupling"),
            SceneError::CouplingWithoutBlock => Self::new(ErrorCode::BlockAndCoupling, message).about("block"),
            SceneError::StaticBelowDynamic {
                param,
                static_force,
                dynamic_force,
                ..
            } => {
                let info = param.parameter.info();
                Self::new(ErrorCode::LawForbids, message)
                    .about(param.to_string())
                    .within(static_force, dynamic_force, info.max, info.unit)
            }
            SceneError::TooMuchStiction {
                param,
                static_force,
                dynamic_force,
                max,
                ..
            } => Self::new(ErrorCode::LawForbids, message)
                .about(param.to_string())
                .within(static_force, dynamic_force, max, param.parameter.info().unit),
            SceneError::NoStribeckVelocity { velocity, .. } => {
                let info = Parameter::StribeckVelocity.info();
                Self::new(ErrorCode::LawForbids, message).about(info.name).within(
                    velocity,
                    SUDDEN_FALL_MPS,
                    info.max,
                    info.unit,
                )
            }
        }
    }
}
