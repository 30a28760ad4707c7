//! What a replay needs beside the rows of samples: how the servo was set up, and how each scene came
//! in. With both, [`haptic_core::servo::Servo`] gives the forces of the rows again.

use haptic_core::servo::Settings;
use haptic_core::snapshot::{self, FieldValue, Snapshot};
use haptic_core::{Scene, Scheme};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How the servo is set up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ServoSetup {
    /// The settings.
    pub settings: Settings,
    /// Integration of the block, as in `status`.
    pub scheme: Scheme,
    /// Resolution of the device, m.
    pub device_resolution_m: f64,
    /// Largest force of the device, N.
    #[serde(default, rename = "device_force_limit_N", skip_serializing_if = "Option::is_none")]
    pub device_force_limit_n: Option<f64>,
    /// Version of the servo: only the same one computes the same forces.
    #[serde(default = "first_version")]
    pub version: u32,
}

/// That of recordings from before versions were counted.
const fn first_version() -> u32 {
    1
}

/// How a scene took effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SceneArrival {
    /// The scene.
    pub scene: Scene,
    /// Its ramp.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp: Option<SceneRamp>,
}

/// The ramp to a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SceneRamp {
    /// Where it began, which may be within another ramp.
    pub from: Scene,
    /// Time that it takes, s.
    pub over_s: f64,
}

/// State of the servo between two ticks, for [`haptic_core::servo::Servo::restored`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ServoSnapshot {
    /// Version of the fields.
    pub version: u32,
    /// The scene that is rendered.
    pub scene: SnapshotScene,
    /// The scene whose force fades out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fading: Option<SnapshotScene>,
    /// Its fields by name: a number in the unit that the name ends in, a whole number, `inf`,
    /// `-inf` or `nan`.
    #[cfg_attr(feature = "schema", schemars(with = "BTreeMap<String, serde_json::Value>"))]
    pub fields: BTreeMap<String, FieldValue>,
}

impl ServoSnapshot {
    /// That of a servo, whose scenes `arrival` knows by their revisions; `None` where it does not.
    #[must_use]
    pub fn of(snapshot: &Snapshot, arrival: impl Fn(u64) -> Option<SceneArrival>) -> Option<Self> {
        let scene = |revision| {
            let arrival = arrival(revision)?;
            Some(SnapshotScene { revision, arrival })
        };
        Some(Self {
            version: snapshot::VERSION,
            scene: scene(snapshot.revision)?,
            fading: match snapshot.fading_revision {
                Some(revision) => Some(scene(revision)?),
                None => None,
            },
            fields: snapshot.fields().collect(),
        })
    }

    /// Whether a servo of this build goes on from it.
    #[must_use]
    pub fn is_of_this_version(&self) -> bool {
        self.version == snapshot::VERSION
    }
}

/// A scene of a snapshot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SnapshotScene {
    /// Its revision.
    pub revision: u64,
    /// The scene, and how it took effect.
    #[serde(flatten)]
    pub arrival: SceneArrival,
}
