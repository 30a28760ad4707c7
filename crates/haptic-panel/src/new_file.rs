//! New files for exports and recordings. Nothing is overwritten.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};

/// Most files of one kind in a folder.
const MAX_FILES: u32 = 9999;

/// Creates a file in `folder` under a new name. If `folder` is a named pipe, the pipe itself is opened,
/// for a program at its other end; that waits until there is one.
///
/// # Errors
/// Why it could not be created, with the name of the folder or the file.
pub(crate) fn create(folder: &Path, name: &str, extension: &str) -> Result<(PathBuf, File), String> {
    if folder.metadata().is_ok_and(|found| found.file_type().is_fifo()) {
        let pipe = OpenOptions::new().write(true).open(folder);
        let pipe = pipe.map_err(|error| format!("cannot write {}: {error}", folder.display()))?;
        return Ok((folder.to_path_buf(), pipe));
    }
    for number in 1..=MAX_FILES {
        let path = folder.join(format!("{name}-{number}.{extension}"));
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(file) => return Ok((path, file)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(format!("cannot write {}: {error}", path.display())),
        }
    }
    Err(format!(
        "{} has {MAX_FILES} files of this kind already: move them away",
        folder.display()
    ))
}
