//! What an identification found, and what it refused.

use haptic_core::Directional;
use serde::ser::SerializeStruct;
use serde::{Deserialize, Serialize, Serializer};
use std::collections::BTreeMap;

/// The law to identify.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModelKind {
    /// Static, dynamic and viscous friction (Karnopp 1985).
    Karnopp,
    /// Dahl's presliding law (Dahl 1976).
    Dahl,
    /// LuGre (Canudas de Wit et al. 1995).
    Lugre,
    /// The one that predicts best, by cross-validation.
    Auto,
}

impl ModelKind {
    /// Every model: the laws, the simplest first, and the choice among them.
    pub const ALL: [Self; 4] = [Self::Karnopp, Self::Dahl, Self::Lugre, Self::Auto];

    /// The word by which files and command lines name it.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Karnopp => "karnopp",
            Self::Dahl => "dahl",
            Self::Lugre => "lugre",
            Self::Auto => "auto",
        }
    }

    /// The model of a [`word`](Self::word).
    #[must_use]
    pub fn of_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|model| model.word() == word)
    }

    /// Its name in a text.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Karnopp => "Karnopp",
            Self::Dahl => "Dahl",
            Self::Lugre => "LuGre",
            Self::Auto => "Auto",
        }
    }

    /// What it holds, in one line.
    #[must_use]
    pub const fn summary(self) -> &'static str {
        match self {
            Self::Karnopp => "Static, dynamic and viscous friction",
            Self::Dahl => "Presliding: the contact gives way like a spring before it slides",
            Self::Lugre => "Presliding, with a static friction above the dynamic one",
            Self::Auto => "The one that predicts best; this takes longer",
        }
    }
}

/// 95 % interval of a parameter: lower and upper end, in the parameter's unit.
pub type Interval = [f64; 2];

/// A parameter that the record cannot determine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    /// The parameter, by its name in [`Identified`].
    pub parameter: String,
    /// Why the record cannot determine it, with the figures.
    pub reason: String,
    /// What to record instead.
    pub instead: String,
}

/// What was found. A parameter that was refused, or that the model has not, is absent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identified {
    /// The model that was fitted; never `auto`.
    pub model: ModelKind,
    /// Mass, kg.
    pub mass_kg: Option<f64>,
    /// Dynamic (Coulomb) friction by direction of motion, N (> 0).
    #[serde(rename = "dynamic_force_N", serialize_with = "as_pair")]
    pub dynamic_force_n: Option<Directional>,
    /// Viscous friction by direction of motion, N s/m.
    #[serde(rename = "viscous_Ns_per_m", serialize_with = "as_pair")]
    pub viscous_ns_per_m: Option<Directional>,
    /// Static friction by direction of motion, N (> 0).
    #[serde(rename = "static_force_N", serialize_with = "as_pair")]
    pub static_force_n: Option<Directional>,
    /// Constant force, N: what the sensor's zero or an incline adds.
    #[serde(rename = "offset_N")]
    pub offset_n: Option<f64>,
    /// Presliding stiffness at zero deflection, N/m.
    #[serde(rename = "stiffness_N_per_m", skip_serializing_if = "Option::is_none")]
    pub stiffness_n_per_m: Option<f64>,
    /// Exponent of Dahl's law.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exponent: Option<f64>,
    /// Stribeck velocity, m/s (LuGre).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stribeck_velocity_mps: Option<f64>,
    /// Bristle damping, N s/m (LuGre).
    #[serde(rename = "bristle_damping_Ns_per_m", skip_serializing_if = "Option::is_none")]
    pub bristle_damping_ns_per_m: Option<f64>,
    /// Root mean square of the force that the fit leaves, N.
    #[serde(rename = "residual_rms_N")]
    pub residual_rms_n: f64,
    /// Length of the windows by which the force is smoothed before the residual is taken, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_window_s: Option<f64>,
    /// 95 % intervals, by the parameter's name in this object; of a parameter with two directions, `NAME.positive`
    /// and `NAME.negative`.
    pub intervals: BTreeMap<String, Interval>,
    /// What the record cannot determine.
    pub refused: Vec<Refusal>,
    /// How much the position's clock was found to be behind the force's, s; of clocks that drift, in the middle of the
    /// record.
    pub shift_s: f64,
    /// How much faster the force's clock was found to run than the position's, parts in a million.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock_drift_ppm: Option<f64>,
    /// Why this model, where it was chosen.
    pub chosen_because: Option<String>,
    /// Remarks for people.
    pub notes: Vec<String>,
}

impl Identified {
    /// Nothing found yet.
    #[must_use]
    pub const fn empty(model: ModelKind) -> Self {
        Self {
            model,
            mass_kg: None,
            dynamic_force_n: None,
            viscous_ns_per_m: None,
            static_force_n: None,
            offset_n: None,
            stiffness_n_per_m: None,
            exponent: None,
            stribeck_velocity_mps: None,
            bristle_damping_ns_per_m: None,
            residual_rms_n: 0.0,
            residual_window_s: None,
            intervals: BTreeMap::new(),
            refused: Vec::new(),
            shift_s: 0.0,
            clock_drift_ppm: None,
            chosen_because: None,
            notes: Vec::new(),
        }
    }
}

/// Writes a pair even where both directions are alike, so that a script needs to know one form only.
fn as_pair<S: Serializer>(value: &Option<Directional>, serializer: S) -> Result<S::Ok, S::Error> {
    let Some(value) = value else {
        return serializer.serialize_none();
    };
    let mut pair = serializer.serialize_struct("Directional", 2)?;
    pair.serialize_field("positive", &value.positive)?;
    pair.serialize_field("negative", &value.negative)?;
    pair.end()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_word_of_a_model_is_the_one_in_json() {
        for model in ModelKind::ALL {
            assert_eq!(serde_json::to_value(model).expect("it writes"), model.word());
            assert_eq!(ModelKind::of_word(model.word()), Some(model));
        }
        assert_eq!(ModelKind::of_word("Karnopp"), None);
    }

    #[test]
    fn directions_are_a_pair_in_json_even_where_they_are_alike() {
        let found = Identified {
            dynamic_force_n: Some(Directional::both(3.5)),
            ..Identified::empty(ModelKind::Karnopp)
        };
        let value = serde_json::to_value(&found).expect("it writes");
        assert_eq!(
            value["dynamic_force_N"],
            serde_json::json!({ "positive": 3.5, "negative": 3.5 })
        );
        assert!(value["static_force_N"].is_null() && value.get("exponent").is_none());
        assert_eq!(serde_json::from_value::<Identified>(value).expect("it reads"), found);
    }
}
