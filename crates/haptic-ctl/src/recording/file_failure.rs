//! Failures to read or make a recording.

use crate::failure::Failure;
use haptic_recording::{CopyError, CreateError, RecordingError};
use std::path::Path;

/// The failure to read a recording, with its name.
pub(super) fn unreadable(path: &Path, error: &RecordingError) -> Failure {
    Failure::Usage(match error {
        // Its text has the name already.
        RecordingError::Open { .. } => error.to_string(),
        _ => format!("{}: {error}", path.display()),
    })
}

/// The failure to make a recording from another one.
pub(super) fn not_copied(error: &CopyError) -> Failure {
    match error {
        CopyError::Read { source, .. } if is_damage(source) => {
            Failure::Usage(format!("{error}; `haptic-ctl recording repair` keeps what can be read"))
        }
        _ => not_repaired(error),
    }
}

/// The same, where a repair has kept nothing.
pub(super) fn not_repaired(error: &CopyError) -> Failure {
    match error {
        CopyError::Create(CreateError::File { path, source }) => Failure::not_created(path, source),
        CopyError::Write { .. } => Failure::File(error.to_string()),
        CopyError::Read { source, .. } if is_damage(source) => {
            Failure::Usage(format!("{error}; nothing of it can be read"))
        }
        _ => Failure::Usage(error.to_string()),
    }
}

/// Whether a file is a recording, of which a part cannot be read.
fn is_damage(error: &RecordingError) -> bool {
    !matches!(
        error,
        RecordingError::Open { .. }
            | RecordingError::NotARecording { .. }
            | RecordingError::OtherProgram { .. }
            | RecordingError::Version { .. }
    )
}
