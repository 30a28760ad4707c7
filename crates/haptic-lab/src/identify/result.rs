//! What an identification found and what it refused; the same as rows for people, and as the scene that feels like it.

use haptic_core::Directional;
use haptic_core::scene::SceneFile;
use haptic_ipc::quantity::{number, rounded};
use serde::ser::SerializeStruct;
use serde::{Deserialize, Serialize, Serializer};
use serde_json::{Value, json};
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

impl Refusal {
    pub(super) fn new(parameter: &str, reason: &str, instead: &str) -> Self {
        Self {
            parameter: parameter.to_owned(),
            reason: reason.to_owned(),
            instead: instead.to_owned(),
        }
    }
}

/// What was found. A parameter that was refused, or that the model has not, is absent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identified {
    /// The model that was fitted; never `auto`.
    pub model: ModelKind,
    /// Mass, kg.
    pub mass_kg: Option<f64>,
    /// Dynamic (Coulomb) friction by direction of motion, N (>= 0).
    #[serde(rename = "dynamic_force_N", serialize_with = "as_pair")]
    pub dynamic_force_n: Option<Directional>,
    /// Viscous friction by direction of motion, N s/m.
    #[serde(rename = "viscous_Ns_per_m", serialize_with = "as_pair")]
    pub viscous_ns_per_m: Option<Directional>,
    /// Static friction by direction of motion, N (>= 0).
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

    /// What the fit leaves, for people: `residual 0.017 N rms`; that there is none.
    #[must_use]
    pub fn residual(&self) -> String {
        if self.residual_rms_n == 0.0 {
            return "no fit".to_owned();
        }
        format!("residual {} N rms", number(rounded(self.residual_rms_n, 2)))
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

/// A value that was found or given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundValue {
    /// What it is, with its direction where it has one: `dynamic friction +`.
    pub what: String,
    /// The value, with the digits that its interval leaves.
    pub value: String,
    /// Its unit; empty for a number.
    pub unit: &'static str,
    /// Its 95 % interval, or `given`.
    pub interval: String,
}

/// Parameters by the names that they have in a result, with their unit, for people.
const NAMES: [(&str, &str, &str); 9] = [
    ("mass_kg", "mass", "kg"),
    ("dynamic_force_N", "dynamic friction", "N"),
    ("viscous_Ns_per_m", "viscous friction", "N s/m"),
    ("static_force_N", "static friction", "N"),
    ("offset_N", "offset", "N"),
    ("stiffness_N_per_m", "presliding stiffness", "N/m"),
    ("exponent", "Dahl's exponent", ""),
    ("stribeck_velocity_mps", "Stribeck velocity", "m/s"),
    ("bristle_damping_Ns_per_m", "bristle damping", "N s/m"),
];

/// The unit of a parameter of a result, for people; empty for a number.
pub(super) fn unit(parameter: &str) -> &'static str {
    let named = NAMES.iter().find(|(name, ..)| *name == parameter);
    named.map_or("", |(.., unit)| unit)
}

/// A parameter of a result in words: `static friction` for `static_force_N`. Another text is returned as it is.
#[must_use]
pub fn in_words(parameter: &str) -> &str {
    let named = NAMES.iter().find(|(name, ..)| *name == parameter);
    named.map_or(parameter, |(_, what, _)| what)
}

impl Identified {
    /// The value of a parameter, by the name of its interval; absent where it was refused, or the model has none.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        let pair = |pair: Option<Directional>| {
            let is_negative = name.ends_with(".negative");
            pair.map(|pair| if is_negative { pair.negative } else { pair.positive })
        };
        match name.split('.').next()? {
            "mass_kg" => self.mass_kg,
            "dynamic_force_N" => pair(self.dynamic_force_n),
            "viscous_Ns_per_m" => pair(self.viscous_ns_per_m),
            "static_force_N" => pair(self.static_force_n),
            "offset_N" => self.offset_n,
            "stiffness_N_per_m" => self.stiffness_n_per_m,
            "exponent" => self.exponent,
            "stribeck_velocity_mps" => self.stribeck_velocity_mps,
            "bristle_damping_Ns_per_m" => self.bristle_damping_ns_per_m,
            _ => None,
        }
    }

    /// Refuses a parameter for the first reason that there is, and takes out what was found of it.
    pub(super) fn refuse(&mut self, refusal: Refusal) {
        let name = refusal.parameter.as_str();
        if self.refused.iter().any(|other| other.parameter == name) {
            return;
        }
        match name {
            "mass_kg" => self.mass_kg = None,
            "dynamic_force_N" => self.dynamic_force_n = None,
            "viscous_Ns_per_m" => self.viscous_ns_per_m = None,
            "static_force_N" => self.static_force_n = None,
            _ => {}
        }
        self.intervals.retain(|other, _| other.split('.').next() != Some(name));
        self.refused.push(refusal);
    }

    /// The values with their units and intervals.
    #[must_use]
    pub fn values(&self) -> Vec<FoundValue> {
        let mut values = Vec::new();
        for (parameter, what, unit) in NAMES {
            let directions = [(" +", ".positive"), (" -", ".negative")];
            let has_two = ["dynamic_force_N", "viscous_Ns_per_m", "static_force_N"].contains(&parameter);
            for (sign, direction) in if has_two { &directions[..] } else { &[("", "")] } {
                let name = format!("{parameter}{direction}");
                let Some(value) = self.value(&name) else { continue };
                let interval = self.intervals.get(&name);
                let digits = decimals(value, interval);
                // A zero has no sign.
                let text = |value: f64| {
                    let text = format!("{value:.digits$}");
                    let size = text.trim_start_matches('-');
                    let is_zero = size.chars().all(|letter| "0.".contains(letter));
                    if is_zero { size.to_owned() } else { text }
                };
                values.push(FoundValue {
                    what: format!("{what}{sign}"),
                    value: text(value),
                    unit,
                    interval: interval.map_or_else(
                        || "given".to_owned(),
                        |[low, high]| format!("{} to {}", text(*low), text(*high)),
                    ),
                });
            }
        }
        values
    }
}

/// Digits behind the point that the interval leaves: those of a tenth of its half width.
pub(crate) fn decimals(value: f64, interval: Option<&Interval>) -> usize {
    let scale = interval.map_or(value.abs() * 1e-2, |[low, high]| (high - low) / 2.0);
    if !(scale > 0.0 && scale.is_finite()) {
        return 4;
    }
    let first = -scale.log10().floor();
    // A scale of 0.03 has its first digit two places behind the point.
    #[expect(clippy::cast_sign_loss, reason = "it is clamped")]
    let decimals = (first + 1.0).clamp(0.0, 9.0) as usize;
    decimals
}

/// A scene, and what in it was not identified.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifiedScene {
    /// The scene, which leaves its coupling to the rig.
    pub scene: SceneFile,
    /// Values that are not the record's, and why.
    pub assumptions: Vec<String>,
}

impl Identified {
    /// Parameters that a scene of the model cannot do without, and that were not found.
    #[must_use]
    pub fn missing(&self) -> Vec<&'static str> {
        let is_presliding = self.model != ModelKind::Karnopp;
        let needed = [
            ("mass_kg", self.mass_kg.is_some(), true),
            ("dynamic_force_N", self.dynamic_force_n.is_some(), true),
            ("viscous_Ns_per_m", self.viscous_ns_per_m.is_some(), true),
            ("stiffness_N_per_m", self.stiffness_n_per_m.is_some(), is_presliding),
        ];
        let lacks = |(name, found, is_needed): (&'static str, bool, bool)| (is_needed && !found).then_some(name);
        needed.into_iter().filter_map(lacks).collect()
    }

    /// The scene of what was found.
    ///
    /// # Errors
    /// A parameter that the scene needs was refused, or lies out of the range that can be rendered.
    pub fn scene(&self, name: &str) -> Result<IdentifiedScene, String> {
        let missing = self.missing();
        if !missing.is_empty() {
            return Err(format!(
                "a scene needs {}, which the record does not determine",
                missing.join(", ")
            ));
        }
        let mut assumptions = vec!["the coupling is the rig's, and is not identified".to_owned()];
        let dynamic = self.dynamic_force_n.unwrap_or_default();
        let viscous = self.viscous_ns_per_m.unwrap_or_default();
        let mut friction = json!({ "dynamic_force": dynamic, "viscous": at_least_zero(viscous) });
        if viscous.positive.min(viscous.negative) < 0.0 {
            assumptions.push("viscous friction below 0 is rendered as 0".to_owned());
        }
        let mut set = |key: &str, value: Value| friction[key] = value;
        let largest = self.static_force_n.unwrap_or(dynamic);
        match self.model {
            ModelKind::Dahl => {
                set("law", json!("dahl"));
                set("contact_stiffness", json!(self.stiffness_n_per_m));
                set("exponent", json!(self.exponent.unwrap_or(1.0)));
            }
            ModelKind::Lugre => {
                set("law", json!("lugre"));
                set("static_force", json!(largest));
                set("contact_stiffness", json!(self.stiffness_n_per_m));
                set("contact_damping", json!(self.bristle_damping_ns_per_m.unwrap_or(0.0)));
                if let Some(velocity) = self.stribeck_velocity_mps {
                    set("stribeck_velocity", json!(velocity));
                }
            }
            ModelKind::Karnopp | ModelKind::Auto => {
                set("law", json!("karnopp"));
                set("static_force", json!(largest));
            }
        }
        if self.static_force_n.is_none() && self.model != ModelKind::Dahl {
            let Directional { positive, negative } = dynamic;
            assumptions.push(format!(
                "static friction was refused: it is set to the dynamic friction, {positive:.4} N in the positive and \
                 {negative:.4} N in the negative direction"
            ));
        }
        let scene: SceneFile = serde_json::from_value(json!({
            "name": name,
            "block": { "mass": self.mass_kg },
            "coupling": "rig",
            "friction": friction,
        }))
        .map_err(|error| error.to_string())?;
        scene.validate().map_err(|error| error.to_string())?;
        Ok(IdentifiedScene { scene, assumptions })
    }
}

/// A force or a friction that is nowhere below zero.
pub(super) fn at_least_zero(value: Directional) -> Directional {
    Directional::new(value.positive.max(0.0), value.negative.max(0.0))
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
        assert_eq!(value["dynamic_force_N"], json!({ "positive": 3.5, "negative": 3.5 }));
        assert!(value["static_force_N"].is_null() && value.get("exponent").is_none());
        assert_eq!(serde_json::from_value::<Identified>(value).expect("it reads"), found);
    }

    #[test]
    fn an_interval_leaves_its_digits_and_a_zero_has_no_sign() {
        let mut found = Identified::empty(ModelKind::Karnopp);
        let mut shown = |value, interval| {
            found.offset_n = Some(value);
            found.intervals.insert("offset_N".to_owned(), interval);
            let [only] = &found.values()[..] else {
                panic!("one value")
            };
            (only.value.clone(), only.interval.clone())
        };
        let text = |value: &str, interval: &str| (value.to_owned(), interval.to_owned());
        assert_eq!(shown(-0.3, [-19.2, 18.6]), text("0", "-19 to 19"));
        assert_eq!(shown(0.1234, [-0.004, 0.25]), text("0.12", "0.00 to 0.25"));
        assert_eq!(shown(-0.1234, [-0.13, -0.12]), text("-0.1234", "-0.1300 to -0.1200"));
    }

    #[test]
    fn a_scene_says_what_was_not_identified() {
        let found = Identified {
            mass_kg: Some(0.7),
            dynamic_force_n: Some(Directional::both(3.0)),
            viscous_ns_per_m: Some(Directional {
                positive: 2.0,
                negative: -0.01,
            }),
            ..Identified::empty(ModelKind::Karnopp)
        };
        let made = found.scene("mine").expect("a scene");
        assert!(made.scene.has_coupling_of_rig());
        let friction = serde_json::to_value(made.scene).expect("it writes")["friction"].clone();
        assert_eq!(
            (&friction["law"], &friction["static_force"]),
            (&json!("karnopp"), &json!(3.0))
        );
        assert_eq!(friction["viscous"], json!({ "positive": 2.0, "negative": 0.0 }));
        assert_eq!(made.assumptions.len(), 3, "{:?}", made.assumptions);
        let without = Identified { mass_kg: None, ..found };
        assert_eq!(without.missing(), ["mass_kg"]);
        assert!(without.scene("mine").expect_err("no mass").contains("mass_kg"));
    }
}
