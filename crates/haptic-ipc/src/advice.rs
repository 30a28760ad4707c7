//! Advice on the wire: what the user of a scene may not expect, and the bounds that it breaks.

use crate::rig_friction::LossSource;
use haptic_core::adviser;
use haptic_core::scene::Note;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A remark on an accepted scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Advice {
    /// The parameter concerned, or the one to change.
    pub param: String,
    /// The remark; of a bound that is kept, what happens beyond it.
    pub message: String,
    /// The check of a bound.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finding: Option<Finding>,
}

/// A bound on the scene, and how the scene keeps it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Finding {
    /// The check.
    pub check: String,
    /// Whether the scene keeps the bound.
    pub passes: bool,
    /// Absent where it is infinite.
    pub value: Option<f64>,
    /// The bound on it.
    pub bound: Option<f64>,
    /// Unit of both.
    pub unit: String,
    /// Ratio to the bound; below 1 it is broken.
    pub margin: Option<f64>,
    /// The value of `param` that would fix it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mending: Option<f64>,
}

impl From<adviser::Finding> for Advice {
    fn from(finding: adviser::Finding) -> Self {
        // JSON has no infinity.
        let number = |value: f64| value.is_finite().then_some(value);
        let concerned = finding.fix.map_or(finding.parameter, |fix| fix.parameter);
        Self {
            param: concerned.info().name.to_owned(),
            message: finding.to_string(),
            finding: Some(Finding {
                check: finding.check.name().to_owned(),
                passes: finding.passes,
                value: number(finding.value),
                bound: number(finding.bound),
                unit: finding.unit.to_owned(),
                margin: number(finding.margin),
                mending: finding.fix.map(|fix| fix.value),
            }),
        }
    }
}

impl From<Note> for Advice {
    fn from(note: Note) -> Self {
        Self {
            param: note.param.to_string(),
            message: note.to_string(),
            finding: None,
        }
    }
}

/// Answer to `advise`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AdviceReply {
    /// Revision of the checked scene.
    pub revision: u64,
    /// Every check and every remark, kept or broken.
    pub advice: Vec<Advice>,
    /// The facts behind it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub basis: Option<AdviceBasis>,
}

/// The facts of the rig that advice is based on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AdviceBasis {
    /// Time between ticks of the loop, us.
    pub period_us: f64,
    /// Time between two samples, us; absent if the device measures when it is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample_period_us: Option<f64>,
    /// Delay from a sample to its force on the motor, us.
    pub delay_us: f64,
    /// Whether it was measured.
    pub delay_measured: bool,
    /// Mass of the rig's moving part, kg; an absent one counts as heavy. Of two axes in the lightest direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<f64>,
    /// Uncompensated viscous damping of the rig, N s/m.
    #[serde(rename = "damping_Ns_per_m")]
    pub damping_ns_per_m: f64,
    /// Uncompensated Coulomb friction of the rig, N.
    #[serde(rename = "friction_N")]
    pub friction_n: f64,
    /// Source of the damping.
    #[serde(default)]
    pub damping_from: LossSource,
    /// Source of the friction.
    #[serde(default)]
    pub friction_from: LossSource,
    /// Compensated share of the identified friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compensated_share: Option<f64>,
    /// Distance between two counts of its encoder, m; 0 for a perfect one.
    pub resolution_m: f64,
    /// On two axes the mass in the heaviest direction, kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heaviest_mass_kg: Option<f64>,
    /// Where a commissioned rig of two axes is the lightest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_at: Option<WorstPlace>,
    /// Where it has the least friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction_at: Option<WorstPlace>,
    /// Where one count moves the hand of two axes farthest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolution_at: Option<WorstPlace>,
}

/// Where a property of a rig of two axes is the worst in its workspace.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WorstPlace {
    /// Position, m; absent where every place is alike.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x_m: Option<f64>,
    /// Position, m; absent where every place is alike.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y_m: Option<f64>,
    /// Direction, from the x axis to the left, degrees from -90 to 90.
    pub direction_deg: f64,
}

impl fmt::Display for WorstPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let (Some(x_m), Some(y_m)) = (self.x_m, self.y_m) {
            write!(f, "at x = {:.0} mm, y = {:.0} mm ", 1e3 * x_m, 1e3 * y_m)?;
        }
        write!(f, "along {:.0} degrees", self.direction_deg)
    }
}
