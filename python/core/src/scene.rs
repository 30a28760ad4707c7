//! A scene.

use crate::refused;
use haptic_core::nearest::meant_or_semicolon;
use haptic_core::scene::SceneFile;
use haptic_core::{ParameterKey, Scene as CoreScene};
use haptic_ipc::{BUILT_IN_SCENES, quantity};
use pyo3::prelude::*;

/// A scene, checked.
#[pyclass(frozen, eq, module = "hapticd_core._native")]
#[derive(PartialEq)]
pub(crate) struct Scene(pub(crate) CoreScene);

/// The value of a parameter: a number in its SI unit, or a text with its unit.
#[derive(FromPyObject)]
pub(crate) enum Value {
    Number(f64),
    Text(String),
}

impl Scene {
    fn checked(scene: CoreScene) -> PyResult<Self> {
        scene.validate().map_err(refused)?;
        Ok(Self(scene))
    }
}

#[pymethods]
impl Scene {
    /// Reads a scene as a library's file holds it. Where the rig gives its coupling, it is the one that a rig that was
    /// not commissioned has.
    #[staticmethod]
    fn from_toml(text: &str) -> PyResult<Self> {
        let file: SceneFile = toml::from_str(text).map_err(refused)?;
        Self::checked(file.on(None))
    }

    /// Reads a scene as it is on the wire and in a recording.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        Self::checked(serde_json::from_str(text).map_err(refused)?)
    }

    /// A scene that every library has.
    #[staticmethod]
    fn named(name: &str) -> PyResult<Self> {
        match BUILT_IN_SCENES.iter().find(|(other, _)| *other == name) {
            Some((_, text)) => Self::from_toml(text),
            None => {
                let names: Vec<&str> = BUILT_IN_SCENES.iter().map(|(name, _)| *name).collect();
                let meant = meant_or_semicolon(name, &names);
                Err(refused(format!(
                    "no built-in scene is called `{name}`{meant} there are {}",
                    names.join(", ")
                )))
            }
        }
    }

    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&self.0).map_err(refused)
    }

    /// Its parameters by name, as JSON.
    fn params_json(&self) -> PyResult<String> {
        serde_json::to_string(&haptic_ipc::params_of(&self.0)).map_err(refused)
    }

    /// The scene with other values, by names or symbols.
    fn with_values(&self, values: Vec<(String, Value)>) -> PyResult<Self> {
        let changes = values
            .into_iter()
            .map(|(name, value)| {
                let key = name.parse::<ParameterKey>().map_err(refused)?;
                let number = match value {
                    Value::Number(number) => number,
                    Value::Text(text) => quantity::parse(&text, key.parameter.info().unit)
                        .map_err(|error| refused(format!("{name} = {text:?}: {error}")))?,
                };
                Ok((key, number))
            })
            .collect::<PyResult<Vec<_>>>()?;
        self.0.with(&changes).map(Self).map_err(refused)
    }
}
