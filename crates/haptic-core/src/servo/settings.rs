//! What stays the same from step to step.

use crate::compensation::Compensation;
use crate::limiter::Limits;
use crate::passivity::RigLosses;
use crate::velocity;

/// What stays the same from step to step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Settings {
    /// Nominal time between two steps, s (> 0).
    pub period_s: f64,
    /// Time in which force comes and goes, s (> 0).
    pub ramp_s: f64,
    /// Limits of force and motion.
    pub limits: Limits,
    /// What the rig itself takes up.
    pub losses: RigLosses,
    /// Largest force that the passivity controller may add, N (>= 0); zero only observes.
    #[cfg_attr(feature = "serde", serde(rename = "passivity_control_N"))]
    pub passivity_control_n: f64,
    /// How velocity is estimated.
    pub velocity: velocity::Method,
    /// Time for which a device may repeat its last sample, or the loop stand still while force
    /// flows, ns.
    pub stale_ns: u64,
    /// Button of the rig that stops it, by its bit.
    pub stop_button: Option<u8>,
    /// Button of the rig that must be held down for force to flow, by its bit.
    pub enable_button: Option<u8>,
    /// What is compensated of the rig's own friction.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub compensation: Option<Compensation>,
}
