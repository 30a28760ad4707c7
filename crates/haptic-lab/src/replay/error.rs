//! Why a recording cannot be replayed.

use haptic_core::SceneError;
use haptic_core::snapshot::SnapshotError;
use haptic_recording::RecordingError;
use thiserror::Error;

/// Why a recording cannot be replayed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// It does not say how the servo was set up.
    #[error(
        "the recording does not hold the servo's settings ({server} did not record them), so its forces cannot be \
         recomputed"
    )]
    NoServo {
        /// Name and version of the daemon.
        server: String,
    },
    /// It was made by another version of the servo.
    #[error(
        "the recording was made by version {recorded} of the servo, and this is version {}: the rules of its limits and \
         of doubtful positions are others, so its forces cannot be given again to the last bit; they can be rendered \
         with --scene, --set or --scheme",
        haptic_core::servo::VERSION
    )]
    OtherVersion {
        /// The one that it was made by.
        recorded: u32,
    },
    /// Its rows are not all ticks.
    #[error(
        "the recording holds {rate_hz} of {loop_rate_hz} ticks a second: a force follows from every tick before it, so \
         only a recording of every tick can be replayed (record without --rate)"
    )]
    Thinned {
        /// Rows a second, Hz.
        rate_hz: f64,
        /// Ticks a second, Hz.
        loop_rate_hz: f64,
    },
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
