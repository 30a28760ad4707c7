//! The parameter table on the wire.

use crate::SAMPLE_COLUMNS;
use haptic_core::friction::LAWS;
use haptic_core::parameters::{ParameterInfo, Scale, TABLE};
use haptic_core::{Directional, Scene};
use serde::{Deserialize, Serialize};

/// Answer to `describe`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Description {
    /// Its law.
    #[serde(default)]
    pub law: String,
    /// Names of all laws.
    #[serde(default)]
    pub laws: Vec<String>,
    /// The scene's parameters.
    pub parameters: Vec<ParameterDescription>,
    /// Columns of a sample.
    pub sample_columns: Vec<String>,
}

impl Description {
    /// The description of a scene.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        Self {
            law: scene.friction.law().to_owned(),
            laws: LAWS.iter().map(ToString::to_string).collect(),
            parameters: ParameterDescription::all_of(scene),
            sample_columns: SAMPLE_COLUMNS.iter().map(ToString::to_string).collect(),
        }
    }
}

/// A row of the parameter table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ParameterDescription {
    /// The name.
    pub name: String,
    /// Symbol in the paper.
    pub symbol: String,
    /// Other symbols.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub aliases: Vec<String>,
    /// SI unit.
    pub unit: String,
    /// Part of the scene.
    pub group: String,
    /// Smallest accepted value.
    pub min: f64,
    /// Largest accepted value.
    pub max: f64,
    /// Lower end of a slider.
    pub slider_min: f64,
    /// Upper end of a slider.
    pub slider_max: f64,
    /// Smallest useful step.
    pub step: f64,
    /// Whether its slider is logarithmic.
    pub logarithmic: bool,
    /// Whether it may differ by direction.
    pub directional: bool,
    /// What a larger value feels like.
    pub feel: String,
    /// The active value.
    pub value: Directional,
}

impl ParameterDescription {
    /// The rows of the parameters that a scene has, with their values.
    #[must_use]
    pub fn all_of(scene: &Scene) -> Vec<Self> {
        TABLE
            .iter()
            .filter_map(|row| Some(Self::new(row, scene.value(row.parameter)?)))
            .collect()
    }

    /// A row of the table with a value.
    #[must_use]
    pub fn new(info: &ParameterInfo, value: Directional) -> Self {
        Self {
            name: info.name.to_owned(),
            symbol: info.symbol.to_owned(),
            aliases: info.aliases.iter().map(ToString::to_string).collect(),
            unit: info.unit.to_owned(),
            group: info.group.to_owned(),
            min: info.min,
            max: info.max,
            slider_min: info.slider_min,
            slider_max: info.slider_max,
            step: info.step,
            logarithmic: info.scale == Scale::Logarithmic,
            directional: info.directional,
            feel: info.feel.to_owned(),
            value,
        }
    }
}
