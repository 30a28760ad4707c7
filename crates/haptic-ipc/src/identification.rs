//! The state of an identification: one client moves the rig by its own motor, and stores what it
//! found of the rig's friction.

use crate::error::{ErrorCode, WireError};
use crate::journal::Peer;
use crate::object::{Field, FieldValue, Limits, Object};
use haptic_core::rig_friction::RigFriction;
use haptic_core::{BoundError, Excitation};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Answer to `identify.*`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct IdentificationReply {
    /// The identifying client.
    pub by: Peer,
    /// The rig's serial number, else its address.
    pub rig: String,
    /// Its firmware.
    pub firmware: String,
    /// Whether an excitation is under way.
    pub moving: bool,
    /// Why it has ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<String>,
    /// Largest force of an excitation, N: half of the rig's force limit.
    #[serde(rename = "force_limit_N")]
    pub force_limit_n: f64,
    /// Travel of the handle between its ends, m.
    pub range_m: f64,
    /// Its place at the beginning, m.
    pub middle_m: f64,
    /// Largest travel of an excitation from there, m.
    pub travel_limit_m: f64,
    /// Friction that the commissioning found, N.
    #[serde(default, rename = "friction_N", skip_serializing_if = "Option::is_none")]
    pub friction_n: Option<f64>,
    /// What `identify.store` has stored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<RigFriction>,
    /// The resolution, m.
    pub resolution_m: f64,
    /// The ramp, ms.
    pub ramp_ms: f64,
    /// The position, m.
    pub position_m: f64,
    /// Ended excitations.
    pub excitations: u64,
    /// Time since the excitation under way began, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gone_s: Option<f64>,
    /// The newest ended excitation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last: Option<ExcitationReport>,
    /// File of the rig's own friction, after `identify.store`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<String>,
}

/// The report of an excitation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ExcitationReport {
    /// What ended it.
    pub end: ExcitationEnd,
    /// Its duration, s.
    pub duration_s: f64,
    /// Its first tick.
    pub first_tick: u64,
    /// Its last tick.
    pub last_tick: u64,
    /// Smallest position, m.
    pub least_m: f64,
    /// Largest position, m.
    pub greatest_m: f64,
    /// The largest speed, m/s.
    pub largest_speed_mps: f64,
    /// The largest force, N.
    #[serde(rename = "largest_force_N")]
    pub largest_force_n: f64,
}

/// How an excitation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ExcitationEnd {
    /// Its time.
    Time,
    /// Its travel.
    Travel,
    /// Its speed.
    Speed,
    /// The handle was held, or drawn away from the reference.
    Lag,
    /// The handle moved against the force from the beginning.
    WrongWay,
    /// The rig was stopped, faulted, released or disconnected.
    Interrupted,
    /// Some ticks were not recorded: the report is void.
    Unrecorded,
    /// Something that a later server knows.
    #[serde(other)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unknown,
}

impl Field for Excitation {
    fn expected(_: &str, _: Option<Limits>) -> String {
        "an object with a `course` and its bounds".to_owned()
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        read_object(given, &Self::expected(given.name, None))
    }
}

impl Field for RigFriction {
    fn expected(_: &str, _: Option<Limits>) -> String {
        "an object of what was identified of the rig".to_owned()
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        read_object(given, &Self::expected(given.name, None))
    }
}

fn read_object<T: DeserializeOwned>(given: &FieldValue<'_>, expected: &str) -> Result<T, WireError> {
    let Some(object) = Object::of(given) else {
        return Err(given.is_not(expected));
    };
    object.no_field_twice()?;
    serde_json::from_str(given.text).map_err(|error| {
        let why = error.to_string();
        let why = why.split(" at line ").next().unwrap_or_default();
        let code = if why.starts_with("unknown field") {
            ErrorCode::UnknownField
        } else {
            ErrorCode::BadRequest
        };
        WireError::new(code, format!("{}: {why}", given.path())).about(given.name)
    })
}

impl From<BoundError> for WireError {
    fn from(error: BoundError) -> Self {
        Self::new(ErrorCode::OutOfRange, error.to_string())
            .about(error.field)
            .within(error.value, error.min, error.max, error.unit)
    }
}
