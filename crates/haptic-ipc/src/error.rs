//! Typed errors on the wire.

use haptic_core::Parameter;
use haptic_core::friction::SUDDEN_FALL_MPS;
use haptic_core::scene::SceneError;
use serde::{Deserialize, Serialize};

/// What kind of refusal an error is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ErrorCode {
    /// The line is not JSON.
    BadJson,
    /// The line is longer than [`MAX_LINE_BYTES`](crate::MAX_LINE_BYTES).
    LineTooLong,
    /// A field is missing or has the wrong type.
    BadRequest,
    /// The operation does not exist.
    UnknownOp,
    /// The operation has no such field; `param` names it.
    UnknownField,
    /// No parameter has this name; `param` is the name.
    UnknownParameter,
    /// A direction was given to a parameter that has one value for both.
    NotDirectional,
    /// A parameter lies outside `min..max`.
    OutOfRange,
    /// A parameter is not a finite number.
    NotFinite,
    /// A line gives the same value twice, perhaps by name and by symbol.
    GivenTwice,
    /// Stiffness and damping of the coupling are both zero.
    NoCoupling,
    /// The scene does not have this parameter: its law lacks it, or there is no block.
    NotApplicable,
    /// The scene's law forbids this combination of values.
    LawForbids,
    /// A block without a coupling, or the other way round.
    BlockAndCoupling,
    /// The block would oscillate or settle too fast for the loop's rate.
    TooFastForRate,
    /// The rig is stopped, by a person: reset it first.
    Stopped,
    /// The rig is faulted, by a check: reset it first.
    Faulted,
    /// The rig's state does not allow the operation; the message says the state and the remedy.
    WrongState,
    /// The scene is not at the revision that `if_revision` names, which is `value`; `min` and `max`
    /// are the newest.
    Conflict,
    /// Scheduled changes wait for their tick, and this would come between; the message says whose.
    Scheduled,
    /// No schedule has this name, or all of it is rendered.
    NoSuchSchedule,
    /// There is no change to undo.
    NothingToUndo,
    /// There is no change to redo.
    NothingToRedo,
    /// No scene has this name or revision.
    NoSuchScene,
    /// The library already has a scene of this name.
    SceneExists,
    /// The name is not valid for a scene in the library.
    BadName,
    /// A scene's file cannot be read or written; the message says why.
    SceneFile,
    /// A file of the daemon's own cannot be written; the message says why.
    StateFile,
    /// The configuration file cannot be read, or a value in it is refused; nothing of it takes effect.
    ConfigFile,
    /// The daemon belongs to another user.
    NotPermitted,
    /// This socket only serves watching and `stop`.
    ReadOnly,
    /// The maximum of clients is connected.
    TooManyClients,
    /// The rig is stopped, and no device is connected to take the zero force.
    NoDevice,
    /// The device was sent the zero force, and has not confirmed in time that its motor is off.
    NotConfirmed,
    /// The device gives no force at all: its own limit is 0 N.
    NoForce,
    /// The device does not switch its motor off soon enough when the daemon falls silent; `value`
    /// is its time, `max` the longest allowed.
    NoWatchdog,
    /// The device lacks a button on which the configuration relies.
    NoButton,
    /// The device confirms commands later than force may be.
    CommandsLate,
    /// The device sends samples and confirms no command.
    CommandsIgnored,
    /// The rig was never commissioned, or has changed since.
    NotCommissioned,
    /// The device may be another than the one that was commissioned, and nobody has said that it is the same.
    MaybeAnotherRig,
    /// The device's clock does not run as ours does.
    DeviceClock,
    /// On this rig the scene would chatter: the loop would oscillate by itself. `anyway` in the request goes on.
    WouldChatter,
    /// `--compensate` needs the rig's own friction, which was never identified or has changed since.
    NotIdentified,
    /// A client is commissioning or identifying the rig; the message says who.
    Commissioning,
    /// No client moves the hand on this rig: it is a real device, or a fake one with another hand.
    NoHand,
    /// Another client moves the hand; the message says who.
    HandHeld,
    /// The real-time thread did not answer in time.
    NotResponding,
    /// The server is of a later version and uses a code that this client does not know.
    #[serde(other)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unknown,
}

/// An error as it stands on the wire.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WireError {
    /// What kind of refusal it is.
    pub code: ErrorCode,
    /// The whole error, for people.
    pub message: String,
    /// The parameter or field concerned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub param: Option<String>,
    /// The value refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The smallest value accepted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// The largest value accepted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// The unit of value and limits.
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
        match error {
            SceneError::OutOfRange {
                param,
                value,
                min,
                max,
                unit,
            } => Self::new(ErrorCode::OutOfRange, message)
                .about(param.to_string())
                .within(value, min, max, unit),
            SceneError::NotFinite {
                param,
                value,
                min,
                max,
                unit,
            } => Self::new(ErrorCode::NotFinite, message)
                .about(param.to_string())
                .within(value, min, max, unit),
            SceneError::UnknownParameter { name, .. } => Self::new(ErrorCode::UnknownParameter, message).about(name),
            SceneError::NotDirectional { given, .. } => Self::new(ErrorCode::NotDirectional, message).about(given),
            SceneError::GivenTwice { param } => Self::new(ErrorCode::GivenTwice, message).about(param.to_string()),
            SceneError::NoCoupling => Self::new(ErrorCode::NoCoupling, message).about("stiffness"),
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
