//! The plots in a file: as drawn (PNG), for a paper (SVG), for further work (CSV).

mod csv;
mod png;
mod svg;

pub(crate) use csv::RowsInSight;
pub use csv::csv;
pub use png::png;
pub(crate) use svg::Picture;
pub use svg::svg;

use crate::files;
use crate::intent::Format;
use std::fs::{self, File, Permissions};
use std::io;
use std::os::unix::fs::PermissionsExt as _;
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

/// Writes an export into a new file in `folder`, which is removed if it cannot be written whole. Returns its path.
///
/// # Errors
/// Why it cannot be written, with the name of the folder or the file.
pub(crate) fn write_new(
    folder: &Path,
    format: Format,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<PathBuf, String> {
    let (path, mut file) = files::create(folder, "haptic-plot", format.extension())?;
    if let Err(error) = write(&mut file) {
        // What went into a pipe cannot be taken back.
        if file.metadata().is_ok_and(|made| made.is_file()) {
            drop(fs::remove_file(&path));
        }
        return Err(not_written(&path, &error));
    }
    Ok(path)
}

/// Writes an export in place of what is at `path`, which stays as it is if that fails. Returns its path.
///
/// # Errors
/// Why it cannot be written, with its name.
pub(crate) fn replace(path: PathBuf, write: impl FnOnce(&mut File) -> io::Result<()>) -> Result<PathBuf, String> {
    match replace_whole(&path, write) {
        Ok(()) => Ok(path),
        Err(error) => Err(not_written(&path, &error)),
    }
}

fn replace_whole(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    // A link stays one.
    let place = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    if place.metadata().is_ok_and(|found| !found.is_file()) {
        // Nothing takes the place of a pipe or a device.
        return write(&mut File::options().write(true).open(place)?);
    }
    let folder = place.parent().unwrap_or(Path::new("."));
    let readable = Permissions::from_mode(0o666);
    let mut file = tempfile::Builder::new().permissions(readable).tempfile_in(folder)?;
    if let Ok(replaced) = place.metadata() {
        // Who may read it stays, too.
        file.as_file().set_permissions(replaced.permissions())?;
    }
    write(file.as_file_mut())?;
    file.persist(place)?;
    Ok(())
}

fn not_written(path: &Path, error: &io::Error) -> String {
    format!("cannot write {}: {error}", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    #[test]
    fn an_export_overwrites_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let write_one = |folder: &Path, content: &[u8]| write_new(folder, Format::Csv, |file| file.write_all(content));
        let first = write_one(folder.path(), b"1").expect("written");
        let second = write_one(folder.path(), b"2").expect("written");
        assert_ne!(first, second);
        assert_eq!(std::fs::read(first).expect("there"), b"1");
        let missing = folder.path().join("none");
        let error = write_one(&missing, b"").expect_err("no such folder");
        assert!(error.contains("none/haptic-plot-1.csv"), "{error}");
    }
    /// Writes a little, and fails.
    fn break_off(file: &mut File) -> io::Result<()> {
        file.write_all(b"half")?;
        Err(io::Error::other("no room"))
    }

    #[test]
    fn an_export_that_fails_leaves_no_file_and_the_old_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let error = write_new(folder.path(), Format::Png, break_off).expect_err("no room");
        assert!(error.ends_with("haptic-plot-1.png: no room"), "{error}");
        let (old, link) = (folder.path().join("old.png"), folder.path().join("link.png"));
        fs::write(&old, "precious").expect("written");
        fs::set_permissions(&old, Permissions::from_mode(0o640)).expect("its owner");
        std::os::unix::fs::symlink(&old, &link).expect("a link");
        for path in [&old, &link] {
            let error = replace(path.clone(), break_off).expect_err("no room");
            assert!(error.contains(&path.display().to_string()), "{error}");
        }
        assert_eq!(fs::read(&old).expect("there"), b"precious");
        assert_eq!(replace(link.clone(), |file| file.write_all(b"new")), Ok(link.clone()));
        assert!(link.is_symlink());
        assert_eq!(fs::read(&old).expect("there"), b"new");
        assert_eq!(fs::metadata(&old).expect("there").permissions().mode() & 0o777, 0o640);
        assert_eq!(
            fs::read_dir(folder.path()).expect("a folder").count(),
            2,
            "nothing else is left"
        );
        let device = PathBuf::from("/dev/full");
        let error = replace(device, |file| file.write_all(b"much")).expect_err("it is full");
        assert!(error.contains("/dev/full"), "{error}");
    }
}
