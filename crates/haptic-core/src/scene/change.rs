//! A scene with some parameters changed.

use super::value::Scene;
use crate::directional::Direction;
use crate::parameters::{Parameter, ParameterKey, SceneError, check_range};
use alloc::vec::Vec;

impl Scene {
    /// The scene with some parameters changed: all of them, or none when one is refused.
    ///
    /// # Errors
    /// The first reason why the changed scene cannot be rendered, or [`SceneError::GivenTwice`].
    pub fn with(&self, changes: &[(ParameterKey, f64)]) -> Result<Self, SceneError> {
        let changed = self.with_unvalidated(changes)?;
        changed.validate()?;
        Ok(changed)
    }

    /// The same, but only the changed values are checked: for a scene that is compiled next, which
    /// validates it as a whole.
    ///
    /// # Errors
    /// A value is out of its range, does not apply to the scene, or is given twice.
    pub fn with_unvalidated(&self, changes: &[(ParameterKey, f64)]) -> Result<Self, SceneError> {
        let mut changed = self.clone();
        let mut seen: Vec<(Parameter, Direction)> = Vec::with_capacity(2 * changes.len());
        for &(key, value) in changes {
            for direction in Direction::BOTH {
                if key.direction.is_none_or(|only| only == direction) {
                    if seen.contains(&(key.parameter, direction)) {
                        return Err(SceneError::GivenTwice { param: key });
                    }
                    seen.push((key.parameter, direction));
                }
            }
            // Checked here, so that the message names the direction as the user gave it.
            check_range(key, value)?;
            changed.set_value(key, value)?;
        }
        Ok(changed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(feature = "serde")]
    use crate::directional::Directional;
    use alloc::string::ToString;

    fn key(text: &str) -> ParameterKey {
        text.parse().expect("a parameter")
    }

    #[test]
    fn a_change_is_all_or_nothing_and_names_the_limit() {
        let scene = Scene::paper();
        let error = scene
            .with(&[(key("Fs"), 5.0), (key("mass"), -1.0)])
            .expect_err("a negative mass");
        let message = error.to_string();
        for part in ["mass", "-1", "0.000001", "100", "kg"] {
            assert!(message.contains(part), "{message} lacks {part}");
        }
        assert_eq!(scene, Scene::paper());
    }

    #[test]
    fn directions_are_set_apart_and_only_once() {
        let scene = Scene::paper()
            .with(&[(key("Fs+"), 5.0), (key("Fs-"), 3.0)])
            .expect("both directions");
        let limits = scene.value(Parameter::StaticForce).expect("Karnopp has it");
        assert_eq!((limits.positive, limits.negative), (5.0, 3.0));
        let notes = scene.notes();
        assert_eq!(notes.len(), 1, "Fs- = 3 N lies below Fd = 3.5 N: {notes:?}");
        let twice = Scene::paper().with(&[(key("Fs"), 5.0), (key("static_force-"), 3.0)]);
        assert!(matches!(twice, Err(SceneError::GivenTwice { .. })));
    }

    #[test]
    fn what_cannot_be_rendered_is_refused() {
        let scene = Scene::paper();
        assert!(matches!(
            scene.with(&[(key("Fd"), f64::NAN)]),
            Err(SceneError::NotFinite { .. })
        ));
        assert_eq!(
            scene.with(&[(key("K"), 0.0), (key("B"), 0.0)]),
            Err(SceneError::NoCoupling)
        );
        assert!(scene.with(&[(key("K"), 0.0)]).is_ok(), "a damper alone holds the block");
        let fast = scene
            .with(&[(key("M"), 1e-6), (key("K"), 3e6), (key("B"), 0.0)])
            .expect("in range");
        let error = fast.validate_rate(1e-3).expect_err("1732 rad a tick");
        assert!(error.to_string().contains("raise mass"), "{error}");
        assert!(fast.validate_rate(1e-4).is_ok());
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_scene_file_reads_as_the_design_document_shows_it() {
        let text = r#"
            name = "simulated friction"
            [block]
            mass = 0.5
            [coupling]
            stiffness = 25000
            damping = 10
            [friction]
            law = "karnopp"
            static_force = { positive = 5.0, negative = 4 }
            dynamic_force = 3.5
        "#;
        let scene: Scene = toml::from_str(text).expect("a scene");
        assert_eq!(
            scene.value(Parameter::StaticForce).map(|limit| limit.negative),
            Some(4.0)
        );
        assert_eq!(scene.value(Parameter::Viscous), Some(Directional::both(0.0)));
        let again: Scene = toml::from_str(&toml::to_string(&scene).expect("writes")).expect("reads");
        assert_eq!(again, scene);
        let json = serde_json::to_string(&scene).expect("writes");
        assert_eq!(serde_json::from_str::<Scene>(&json).expect("reads"), scene);
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_scene_file_with_an_unknown_field_is_refused_by_its_name() {
        let mut value = serde_json::to_value(Scene::paper()).expect("writes");
        value["friction"]["colour"] = 1.into();
        let error = serde_json::from_value::<Scene>(value).expect_err("no such field");
        assert!(error.to_string().contains("colour"), "{error}");
    }
}
