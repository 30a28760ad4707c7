//! What is known of the rig's own friction, and what is done with it.

use haptic_core::rig_friction::RigFriction;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The rig's own friction, as `status` shows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RigFrictionStatus {
    /// Coulomb friction, N: the smaller of both directions.
    #[serde(rename = "friction_N")]
    pub friction_n: f64,
    /// Its source.
    pub friction_from: LossSource,
    /// Viscous damping likewise, N s/m.
    #[serde(rename = "damping_Ns_per_m")]
    pub damping_ns_per_m: f64,
    /// Its source.
    pub damping_from: LossSource,
    /// The identified friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identified: Option<RigFriction>,
    /// Why that is not used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
    /// Compensated share of the identified friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compensated_share: Option<f64>,
}

/// The source of a loss of the rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum LossSource {
    /// An option of the daemon.
    Option,
    /// What was identified of the rig.
    Identified,
    /// What the commissioning found.
    Commissioned,
    /// The default.
    #[default]
    Default,
    /// A name that only a later server knows.
    #[serde(other)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unknown,
}

impl fmt::Display for LossSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Option => "by option",
            Self::Identified => "identified",
            Self::Commissioned => "commissioned",
            Self::Default => "by default",
            Self::Unknown => "from elsewhere",
        })
    }
}
