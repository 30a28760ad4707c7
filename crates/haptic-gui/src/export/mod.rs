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

/// Writes an export into a new file in `folder`. Returns the path of the file.
///
/// # Errors
/// Why it could not be written, with the name of the folder or the file.
pub(crate) fn write(
    folder: &Path,
    format: Format,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<PathBuf, String> {
    let (path, mut file) = new_file::create(folder, "haptic-plot", format.extension())?;
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
        let write_one = |folder: &Path, content: &[u8]| write(folder, Format::Csv, |file| file.write_all(content));
        let first = write_one(folder.path(), b"1").expect("written");
        let second = write_one(folder.path(), b"2").expect("written");
        assert_ne!(first, second);
        assert_eq!(std::fs::read(first).expect("there"), b"1");
        let missing = folder.path().join("none");
        let error = write_one(&missing, b"").expect_err("no such folder");
        assert!(error.contains("none/haptic-plot-1.csv"), "{error}");
    }
}
