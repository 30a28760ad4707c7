//! A scene as its file has it: with a coupling of its own, or with the one that the rig bears.

use super::{Block, Coupling, Scene, SceneError};
use crate::friction::Friction;
use alloc::string::String;
use core::fmt;
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserialize, Deserializer, MapAccess, Unexpected, Visitor};
use serde::{Serialize, Serializer};

/// The word for a coupling that the rig gives.
const OF_RIG: &str = "rig";

/// How the hand holds the block, as a scene's file says it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(untagged))]
pub enum FileCoupling {
    /// `"rig"`: the stiffest coupling that the commissioning found the rig to bear; without one 1000 N/m and 10 N s/m,
    /// or softer where the link takes more than 6 ms.
    #[cfg_attr(feature = "schema", schemars(with = "OfRig"))]
    Rig,
    /// The scene's own coupling.
    Own(Coupling),
}

#[cfg(feature = "schema")]
#[derive(schemars::JsonSchema)]
#[schemars(rename_all = "lowercase")]
enum OfRig {
    #[expect(dead_code, reason = "it is the schema's")]
    Rig,
}

/// A scene as its file has it. The fields are those of a [`Scene`].
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// What people call it.
    #[serde(default)]
    pub name: String,
    /// The block; without one, friction acts on the device itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub block: Option<Block>,
    /// How the hand holds the block.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coupling: Option<FileCoupling>,
    /// What it slides on.
    #[serde(deserialize_with = "super::friction_fields::read")]
    pub friction: Friction,
}

impl SceneFile {
    /// The scene on a rig whose coupling is `of_rig`; [`Coupling::CALM`] where none is known.
    #[must_use]
    pub fn on(self, of_rig: Option<Coupling>) -> Scene {
        Scene {
            name: self.name,
            block: self.block,
            coupling: self.coupling.map(|coupling| match coupling {
                FileCoupling::Rig => of_rig.unwrap_or(Coupling::CALM),
                FileCoupling::Own(coupling) => coupling,
            }),
            friction: self.friction,
        }
    }

    /// Checks that it can be rendered, on a rig of which no coupling is known.
    ///
    /// # Errors
    /// As [`Scene::validate`].
    pub fn validate(&self) -> Result<(), SceneError> {
        self.clone().on(None).validate()
    }

    /// Whether the rig gives its coupling.
    #[must_use]
    pub fn has_coupling_of_rig(&self) -> bool {
        self.coupling == Some(FileCoupling::Rig)
    }
}

impl From<Scene> for SceneFile {
    fn from(scene: Scene) -> Self {
        Self {
            name: scene.name,
            block: scene.block,
            coupling: scene.coupling.map(FileCoupling::Own),
            friction: scene.friction,
        }
    }
}

impl Serialize for FileCoupling {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Rig => serializer.serialize_str(OF_RIG),
            Self::Own(coupling) => coupling.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for FileCoupling {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WordOrTable)
    }
}

struct WordOrTable;

impl<'de> Visitor<'de> for WordOrTable {
    type Value = FileCoupling;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table with stiffness and damping, or the word \"rig\"")
    }

    fn visit_str<E: de::Error>(self, word: &str) -> Result<FileCoupling, E> {
        if word == OF_RIG {
            return Ok(FileCoupling::Rig);
        }
        Err(E::invalid_value(Unexpected::Str(word), &self))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<FileCoupling, A::Error> {
        Coupling::deserialize(MapAccessDeserializer::new(map)).map(FileCoupling::Own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::format;
    use alloc::string::ToString;

    const SURFACE: &str = "[block]\nmass = 0.5\n[friction]\nlaw = \"karnopp\"\nFs = 4\nFd = 3.5\n";

    fn read(coupling: &str) -> Result<SceneFile, String> {
        toml::from_str(&format!("{coupling}\n{SURFACE}")).map_err(|error| error.to_string())
    }

    #[test]
    fn a_scene_has_the_rigs_coupling_or_its_own() {
        let own = Coupling {
            stiffness: 300.0,
            damping: 2.0,
        };
        let of_rig = Coupling {
            stiffness: 4000.0,
            damping: 5.0,
        };
        for (text, on_this, on_any) in [
            ("coupling = \"rig\"", of_rig, Coupling::CALM),
            ("coupling = { K = 300, B = 2 }", own, own),
        ] {
            let file = read(text).expect(text);
            assert_eq!(file.has_coupling_of_rig(), on_this == of_rig);
            assert_eq!(file.clone().on(Some(of_rig)).coupling, Some(on_this), "{text}");
            let scene = file.clone().on(None);
            assert_eq!(scene.coupling, Some(on_any), "{text}");
            assert_eq!((scene.validate(), file.validate()), (Ok(()), Ok(())));
            let again: SceneFile = toml::from_str(&toml::to_string(&file).expect("writes")).expect("reads");
            assert_eq!(again, file);
        }
        let none = read("").expect("a scene").on(Some(of_rig));
        assert!(none.coupling.is_none() && none.validate().is_err());
    }

    #[test]
    fn a_coupling_that_is_neither_is_refused_where_it_stands() {
        for (text, what) in [
            ("coupling = \"rigs\"", "the word \"rig\""),
            ("coupling = 3", "the word \"rig\""),
            ("coupling = { K = 300, C = 2 }", "unknown field `C`"),
        ] {
            let error = read(text).expect_err(text);
            assert!(error.contains(what) && error.contains("line 1"), "{error}");
        }
    }
}
