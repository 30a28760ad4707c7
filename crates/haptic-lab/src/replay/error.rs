//! Why a recording cannot be replayed.

use haptic_core::SceneError;
use haptic_core::snapshot::SnapshotError;
use haptic_recording::RecordingError;
use serde::Serialize;
use thiserror::Error;

/// Why a recording cannot be replayed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// It does not hold what a replay needs, or was made by another version of the servo.
    #[error("{0}")]
    Refused(String),
    /// A scene cannot be rendered.
    #[error("revision {revision}: {error}")]
    Scene {
        /// Its revision.
        revision: u64,
        /// Why.
        error: SceneError,
    },
    /// No servo goes on from a snapshot.
    #[error("before tick {tick}: {error}")]
    Snapshot {
        /// The tick that goes on from it.
        tick: u64,
        /// Why.
        error: SnapshotError,
    },
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

/// Why a row is not compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SkipReason {
    /// The servo has just begun: its estimate of velocity still depends on what came before.
    Settling,
    /// Force flowed when the recording began.
    BeganWithForce,
    /// Rows were lost before, and force has flowed since.
    RowsLost,
    /// Force began to flow before the servo had settled.
    ForceTooSoon,
    /// The recording does not hold the scene: a pulse, an excitation, or a scene from before it began.
    UnknownScene,
    /// What came before the recording decides: the device fell silent, or the clocks contradicted each other.
    NoSnapshot,
}

impl std::fmt::Display for SkipReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Settling => "the estimate of velocity still remembered what came before",
            Self::BeganWithForce => "the recording began while force flowed, without a snapshot of the servo",
            Self::RowsLost => "rows were lost before, and force has flowed without a snapshot since",
            Self::ForceTooSoon => "force began to flow before the estimate of velocity had settled",
            Self::UnknownScene => {
                "the scene is not in the recording (a pulse or an excitation, or one from before it began)"
            }
            Self::NoSnapshot => "the state before the recording decides, of which it holds no snapshot",
        })
    }
}
