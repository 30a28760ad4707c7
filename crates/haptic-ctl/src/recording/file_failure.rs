//! Failures to read or make a recording.

use crate::failure::Failure;
use haptic_recording::{CopyError, CreateError, RecordingError};
use std::path::Path;

/// The failure to read a recording, with its name.
pub(crate) fn unreadable(path: &Path, error: &RecordingError) -> Failure {
    Failure::Usage(match error {
        // Its text has the name already.
        RecordingError::Open { .. } => error.to_string(),
        _ => format!("{}: {error}{}", path.display(), error.remedy()),
    })
}

/// The failure to make a recording from another one.
pub(super) fn not_copied(error: &CopyError) -> Failure {
    match error {
        CopyError::Read { source, .. } if source.is_damage() => Failure::Usage(format!("{error}{}", source.remedy())),
        _ => not_repaired(error),
    }
}

/// The same, where a repair has kept nothing.
pub(super) fn not_repaired(error: &CopyError) -> Failure {
    match error {
        CopyError::Create(CreateError::File { path, source }) => Failure::not_created(path, source),
        CopyError::Write { .. } => Failure::File(error.to_string()),
        CopyError::Read { source, .. } if source.is_damage() => {
            Failure::Usage(format!("{error}; nothing of it can be read"))
        }
        _ => Failure::Usage(error.to_string()),
    }
}
