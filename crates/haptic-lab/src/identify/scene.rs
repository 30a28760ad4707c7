//! The scene that feels like what was identified.

use super::result::{Identified, ModelKind};
use haptic_core::Directional;
use haptic_core::scene::SceneFile;
use serde_json::{Value, json};

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
            assumptions.push("static friction was refused: it is set to the dynamic friction".to_owned());
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

fn at_least_zero(value: Directional) -> Directional {
    Directional {
        positive: value.positive.max(0.0),
        negative: value.negative.max(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
