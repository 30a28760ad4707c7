//! What the plots show, to keep: as drawn (PNG), for a paper (SVG), for further work (CSV).

mod csv;
mod png;
mod svg;

pub(crate) use csv::Rows;
pub use csv::csv;
pub use png::png;
pub use svg::svg;

use crate::intent::Format;
use std::fs::{File, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};

/// Writes an export into `folder` under a name that nothing has yet, and gives the file.
///
/// # Errors
/// Why it could not be written, naming the folder or the file.
pub fn write(folder: &Path, format: Format, content: &[u8]) -> Result<PathBuf, String> {
    write_with(folder, format, |file| file.write_all(content))
}

/// The same with what `write` writes.
pub(crate) fn write_with(
    folder: &Path,
    format: Format,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<PathBuf, String> {
    let (path, mut file) = open_new(folder, "haptic-plot", format.extension())?;
    write(&mut file).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    Ok(path)
}

/// Makes a file in `folder` whose name nothing has yet. A named pipe in the place of the folder is written to itself, for a program at its other end;
/// that waits until there is one.
pub(crate) fn open_new(folder: &Path, name: &str, extension: &str) -> Result<(PathBuf, File), String> {
    if folder.metadata().is_ok_and(|found| found.file_type().is_fifo()) {
        let pipe = OpenOptions::new().write(true).open(folder);
        let pipe = pipe.map_err(|error| format!("cannot write {}: {error}", folder.display()))?;
        return Ok((folder.to_path_buf(), pipe));
    }
    first_free(folder, name, extension)
}

/// Makes a file in `folder` whose name nothing has yet.
fn first_free(folder: &Path, name: &str, extension: &str) -> Result<(PathBuf, File), String> {
    for number in 1..10_000 {
        let path = folder.join(format!("{name}-{number}.{extension}"));
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(file) => return Ok((path, file)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(format!("cannot write {}: {error}", path.display())),
        }
    }
    Err(format!(
        "{} has 9999 files of this kind already: move them away",
        folder.display()
    ))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::model::Model;
    use crate::scope::tape::tests::at;
    use crate::update::Update;
    use haptic_ipc::{Event, SamplesEvent};

    /// Two seconds, with a spike of 42 N.
    pub(crate) fn with_samples() -> Model {
        let rows = (0..2000).map(|i| {
            let mut row = at(f64::from(i) * 1e-3);
            row.coupling_force_n = if i == 1500 { 42.0 } else { 0.0 };
            row
        });
        let batch = SamplesEvent {
            seq: 0,
            dropped: 0,
            rows: rows.collect(),
        };
        let mut model = Model::new();
        model.apply(Update::Event(Event::Samples(batch)));
        model
    }

    #[test]
    fn an_export_overwrites_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let first = write(folder.path(), Format::Csv, b"1").expect("written");
        let second = write(folder.path(), Format::Csv, b"2").expect("written");
        assert_ne!(first, second);
        assert_eq!(std::fs::read(first).expect("there"), b"1");
        let missing = folder.path().join("none");
        let error = write(&missing, Format::Svg, b"").expect_err("no such folder");
        assert!(error.contains("none/haptic-plot-1.svg"), "{error}");
    }
}
