//! Files that are on the disk when a call returns.

use super::error::StoreError;
use std::error::Error;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

/// Names the file of an error.
pub(super) fn at<E: Into<io::Error>>(path: &Path) -> impl Fn(E) -> StoreError {
    let path = path.to_owned();
    move |error| StoreError::File {
        path: path.clone(),
        source: error.into(),
    }
}

/// Names the file whose content is wrong.
pub(super) fn wrong<E: Error + Send + Sync + 'static>(path: &Path) -> impl Fn(E) -> StoreError {
    let path = path.to_owned();
    move |error| StoreError::Content {
        path: path.clone(),
        source: error.into(),
    }
}

/// Has a folder's list of files on the disk.
pub(super) fn sync_folder(path: &Path) -> Result<(), StoreError> {
    File::open(path).and_then(|folder| folder.sync_all()).map_err(at(path))
}

/// Creates a folder, and those above it that are missing.
pub(super) fn create_folder(path: &Path) -> Result<(), StoreError> {
    if path.is_dir() {
        return Ok(());
    }
    let parent = path.parent().unwrap_or(Path::new("."));
    create_folder(parent)?;
    match fs::create_dir(path) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(at(path)(error)),
        _ => {}
    }
    sync_folder(parent)
}

/// Writes a file that is not there.
pub(super) fn write_new(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let written = File::create_new(path).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()
    });
    written.map_err(at(path))
}

/// Writes a file in place of an earlier one, as open to others as the file `like`. Whoever reads it, and whenever the
/// program is killed: the one or the other is there as a whole.
pub(super) fn replace(
    path: &Path,
    like: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<(), StoreError> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(at(folder))?;
    // A temporary file is closed to everybody else.
    let permissions = fs::metadata(like).map_err(at(like))?.permissions();
    let written = file.as_file().set_permissions(permissions);
    let written = written.and_then(|()| write(file.as_file_mut()));
    written.and_then(|()| file.as_file().sync_all()).map_err(at(path))?;
    file.persist(path).map_err(|error| at(path)(error.error))?;
    sync_folder(folder)
}

/// Adds to a file of a length, which may be new.
pub(super) fn append(path: &Path, bytes: &[u8], length: u64) -> Result<(), StoreError> {
    let mut file = File::options().append(true).create(true).open(path).map_err(at(path))?;
    if let Err(error) = file.write_all(bytes).and_then(|()| file.sync_data()) {
        // A full disk: what got through is nothing whole.
        file.set_len(length).map_err(at(path))?;
        return Err(at(path)(error));
    }
    if length == 0 {
        sync_folder(path.parent().unwrap_or(Path::new(".")))?;
    }
    Ok(())
}

/// Length of the lines that have an end.
pub(super) fn whole_lines(bytes: &[u8]) -> usize {
    bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1)
}
