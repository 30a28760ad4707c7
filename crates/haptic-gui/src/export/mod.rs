//! The plots in a file: as drawn (PNG), for a paper (SVG), for further work (CSV).

mod csv;
#[cfg(test)]
mod fixture;
mod picture;
mod png;
mod svg;

pub(crate) use csv::Rows;
pub use csv::csv;
pub(crate) use picture::Picture;
pub use png::png;
pub use svg::svg;

use crate::intent::Format;
use crate::new_file;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// Where an export goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Destination {
    /// Into a new file in a folder. Nothing is overwritten.
    NewIn(PathBuf),
    /// Into the file that the user chooses in a dialog of the desktop, which asks before one is replaced.
    Asked {
        /// Where the dialog begins.
        near: PathBuf,
    },
}

/// Creates a new file in `folder`.
///
/// # Errors
/// Why it cannot be created, with the name of the folder or the file.
pub(crate) fn create(folder: &Path, format: Format) -> Result<(PathBuf, File), String> {
    new_file::create(folder, "haptic-plot", format.extension())
}

/// Creates a file that may replace another.
///
/// # Errors
/// Why it cannot be created, with its name.
pub(crate) fn replace(path: PathBuf) -> Result<(PathBuf, File), String> {
    let created = File::create(&path).map_err(|error| format!("cannot write {}: {error}", path.display()));
    created.map(|file| (path, file))
}

/// Writes an export. Returns the path of its file.
///
/// # Errors
/// Why it cannot be written, with the name of the file.
pub(crate) fn write(
    path: PathBuf,
    mut file: File,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<PathBuf, String> {
    write(&mut file).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    #[test]
    fn an_export_overwrites_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let write_one = |folder: &Path, content: &[u8]| {
            let (path, file) = create(folder, Format::Csv)?;
            write(path, file, |file| file.write_all(content))
        };
        let first = write_one(folder.path(), b"1").expect("written");
        let second = write_one(folder.path(), b"2").expect("written");
        assert_ne!(first, second);
        assert_eq!(std::fs::read(first).expect("there"), b"1");
        let missing = folder.path().join("none");
        let error = write_one(&missing, b"").expect_err("no such folder");
        assert!(error.contains("none/haptic-plot-1.csv"), "{error}");
    }
}
