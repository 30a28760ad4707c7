//! Files that are written whole or not at all: a reader finds the old contents or the new ones.

use std::fs::Permissions;
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// Writes a file that others may read; an existing file is replaced only if `replace` is set.
///
/// # Errors
/// The system refuses, or the file exists and `replace` is not set.
pub(super) fn write(path: &Path, text: &str, replace: bool) -> io::Result<()> {
    let mut file = tempfile::NamedTempFile::new_in(path.parent().unwrap_or(Path::new(".")))?;
    file.write_all(text.as_bytes())?;
    file.as_file().sync_all()?;
    file.as_file().set_permissions(Permissions::from_mode(0o644))?;
    if replace {
        file.persist(path)?;
    } else {
        file.persist_noclobber(path)?;
    }
    Ok(())
}
