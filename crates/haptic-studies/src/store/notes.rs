//! Notes of the experimenter: a line each, with the subject and the tick at which it was taken.

use super::disk::{append, at};
use super::error::StoreError;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

const NOTES: &str = "notes.csv";

const COLUMNS: [&str; 4] = ["time_unix_s", "subject", "tick", "note"];

/// Takes a note on a study; it is on the disk when this returns. Returns the file of the notes.
///
/// # Errors
/// It cannot be written.
pub fn note(folder: &Path, subject: &str, tick: Option<u64>, text: &str) -> Result<PathBuf, StoreError> {
    let path = folder.join(NOTES);
    let length = fs::metadata(&path).map_or(0, |file| file.len());
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let tick = tick.map_or_else(String::new, |tick| tick.to_string());
    let mut lines = csv::Writer::from_writer(Vec::new());
    if length == 0 {
        lines.write_record(COLUMNS).map_err(at(&path))?;
    }
    let time = format!("{:.3}", since_1970.as_secs_f64());
    lines
        .write_record([time.as_str(), subject, &tick, text])
        .map_err(at(&path))?;
    let lines = lines.into_inner().map_err(|error| at(&path)(error.into_error()))?;
    append(&path, &lines, length)?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_are_kept_line_by_line_whatever_is_in_them() {
        let folder = tempfile::tempdir().expect("a folder");
        note(
            folder.path(),
            "01",
            Some(4711),
            "dropped the handle, \"twice\"\nand laughed",
        )
        .expect("a note");
        let path = note(folder.path(), "02", None, "late").expect("a note");
        let mut reader = csv::Reader::from_path(path).expect("notes");
        let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.expect("a row")).collect();
        let cells = |row: usize| rows[row].iter().skip(1).map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(cells(0), ["01", "4711", "dropped the handle, \"twice\"\nand laughed"]);
        assert_eq!(cells(1), ["02", "", "late"]);
    }
}
