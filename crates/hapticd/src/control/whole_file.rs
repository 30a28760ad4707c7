//! Files that are written whole or not at all: a reader finds the old contents or the new ones.

use std::fs::Permissions;
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use tempfile::NamedTempFile;

/// Writes a file that others may read; an existing file is replaced only if `replace` is set.
///
/// # Errors
/// The system refuses, or the file exists and `replace` is not set.
pub(super) fn write(path: &Path, text: &str, replace: bool) -> io::Result<()> {
    let file = beside(path, text)?;
    file.as_file().sync_all()?;
    if replace {
        file.persist(path)?;
    } else {
        file.persist_noclobber(path)?;
    }
    Ok(())
}

/// Replaces a file that is written again and again: what it holds need not outlive a power failure, so the disk is
/// spared.
///
/// # Errors
/// The system refuses.
pub(crate) fn refresh(path: &Path, text: &str) -> io::Result<()> {
    beside(path, text)?.persist(path)?;
    Ok(())
}

/// Whether a file could be written: a page is, into the deepest directory of its path that is there, and is gone again.
///
/// # Errors
/// The system refuses.
pub(super) fn check(path: &Path) -> io::Result<()> {
    let is_there = |path: &&Path| path.parent().is_some_and(Path::exists);
    let first = path.ancestors().find(is_there).unwrap_or(path);
    beside(first, &"#".repeat(4096))?.as_file().sync_all()
}

/// A file with the text, which others may read, in the directory of the path.
fn beside(path: &Path, text: &str) -> io::Result<NamedTempFile> {
    let mut file = NamedTempFile::new_in(path.parent().unwrap_or(Path::new(".")))?;
    file.write_all(text.as_bytes())?;
    file.as_file().set_permissions(Permissions::from_mode(0o644))?;
    Ok(file)
}
