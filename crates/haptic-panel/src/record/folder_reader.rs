//! The recordings of a folder, read one by one.

use haptic_recording::{Ending, Entry, Format, Reader, RecordingError};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;

/// Entries after which a reading looks whether it is still wanted: a few milliseconds.
const ENTRIES_A_LOOK: usize = 1000;

/// A recording of a folder.
#[derive(Clone, Debug, PartialEq)]
pub struct Listed {
    /// Its file.
    pub path: PathBuf,
    /// Size of the file.
    pub bytes: u64,
    /// When the file was last written.
    pub modified: SystemTime,
    /// What it says of itself, or why it cannot be read.
    pub about: Result<About, String>,
}

/// What a recording says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Name of the scene that it began with.
    pub scene: String,
    /// Notes of the person who made it.
    pub notes: Option<String>,
    /// Length, s, and whether the end is missing; `None` before it is read to its end.
    pub length: Option<Length>,
}

/// Length of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Length {
    /// From the first sample to the last, s.
    pub length_s: f64,
    /// Whether it was ended on purpose.
    pub is_complete: bool,
}

impl Listed {
    /// Whether the file is as it was when `self` was read, to its end.
    fn is_still(&self, other: &Self) -> bool {
        let is_read = self.about.as_ref().is_ok_and(|about| about.length.is_some());
        is_read && (&self.path, self.bytes, self.modified) == (&other.path, other.bytes, other.modified)
    }

    /// The line that describes it.
    #[must_use]
    pub fn line(&self) -> String {
        let About { scene, notes, length } = match &self.about {
            Ok(about) => about,
            Err(why) => return why.clone(),
        };
        let mut text = match length {
            Some(Length { length_s, is_complete }) => {
                let broken_off = if *is_complete { "" } else { ", broken off" };
                format!("{}{broken_off}, scene {scene}", duration(*length_s))
            }
            None => format!("... s, scene {scene}"),
        };
        if let Some(notes) = notes {
            text += &format!(", {}", notes.replace('\n', " "));
        }
        text
    }
}

/// A length of time for people.
fn duration(length_s: f64) -> String {
    if length_s < 60.0 {
        return format!("{length_s:.1} s");
    }
    let minutes = (length_s / 60.0).floor();
    format!("{minutes} min {:.0} s", (length_s - 60.0 * minutes).floor())
}

/// Reads the recordings of a folder, the newest first: each is reported once with what stands at its beginning,
/// and once more with its length. What is in `known` and unchanged is not read again. A file of text that is
/// no recording is left out.
///
/// # Errors
/// The folder cannot be read.
pub(crate) fn list(
    folder: &Path,
    known: &[Listed],
    is_over: &AtomicBool,
    mut report: impl FnMut(Listed),
) -> Result<(), String> {
    let mut files = files(folder).map_err(|error| format!("cannot read {}: {error}", folder.display()))?;
    files.sort_by_key(|file| std::cmp::Reverse(file.modified));
    let mut unread = Vec::new();
    for mut file in files {
        if is_over.load(Ordering::Acquire) {
            return Ok(());
        }
        if let Some(same) = known.iter().find(|known| known.is_still(&file)) {
            report(same.clone());
            continue;
        }
        match haptic_recording::open_any(&file.path) {
            Ok(reader) => {
                file.about = Ok(beginning(&reader));
                report(file.clone());
                unread.push((file, reader));
            }
            Err(_) if Format::of(&file.path) == Ok(Format::Csv) => {}
            Err(error) => {
                file.about = Err(error.to_string());
                report(file);
            }
        }
    }
    for (mut file, reader) in unread {
        let about = beginning(&reader);
        file.about = match length(reader, is_over) {
            Ok(Some(length)) => Ok(About {
                length: Some(length),
                ..about
            }),
            Ok(None) => return Ok(()),
            Err(error) => Err(error.to_string()),
        };
        report(file);
    }
    Ok(())
}

/// The files of a folder that are named as recordings.
fn files(folder: &Path) -> std::io::Result<Vec<Listed>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let path = entry.path();
        // A link leads to a file; a pipe would keep its reader waiting.
        let Ok(metadata) = path.metadata() else { continue };
        if metadata.is_file() && Format::of(&path).is_ok() {
            files.push(Listed {
                path,
                bytes: metadata.len(),
                modified: metadata.modified()?,
                about: Err(String::new()),
            });
        }
    }
    Ok(files)
}

fn beginning(reader: &Reader) -> About {
    About {
        scene: reader.metadata().scene.name.clone(),
        notes: reader.metadata().notes.clone(),
        length: None,
    }
}

/// Reads to the end; `None` if it is given up.
fn length(mut reader: Reader, is_over: &AtomicBool) -> Result<Option<Length>, RecordingError> {
    let mut ends: Option<[f64; 2]> = None;
    for (count, entry) in reader.by_ref().enumerate() {
        if count.is_multiple_of(ENTRIES_A_LOOK) && is_over.load(Ordering::Acquire) {
            return Ok(None);
        }
        if let Entry::Row(row, _) = entry? {
            let [first_s, _] = ends.unwrap_or([row.t_s; 2]);
            ends = Some([first_s, row.t_s]);
        }
    }
    Ok(Some(Length {
        length_s: ends.map_or(0.0, |[first_s, last_s]| last_s - first_s),
        is_complete: reader.ending() == Some(Ending::Complete),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::fixture::metadata;
    use crate::tape::tests::at;
    use haptic_ipc::{Event, SampleY, SamplesEvent};
    use haptic_recording::Metadata;

    fn record(path: &Path, seconds: u32, ends: bool, axes: u8) {
        let about = Metadata { axes, ..metadata() };
        let mut recorder = haptic_recording::create(path, &about, false).expect("a file");
        let rows: Vec<_> = (0..=seconds).map(|second| at(f64::from(second))).collect();
        let rows_y = vec![SampleY::default(); if axes == 2 { rows.len() } else { 0 }];
        recorder
            .event(&Event::Samples(SamplesEvent {
                rows,
                rows_y,
                ..SamplesEvent::default()
            }))
            .expect("written");
        if ends {
            recorder.finish().expect("written");
        }
    }

    fn listed(folder: &Path, known: &[Listed]) -> Vec<Listed> {
        let mut listed: Vec<Listed> = Vec::new();
        list(folder, known, &AtomicBool::new(false), |one| listed.push(one)).expect("a folder");
        listed
    }

    #[test]
    fn folder_lists_only_its_recordings_with_lengths() {
        let folder = tempfile::tempdir().expect("a folder");
        record(&folder.path().join("long.csv"), 90, true, 1);
        record(&folder.path().join("broken.csv"), 3, false, 1);
        record(&folder.path().join("plane.csv"), 2, true, 2);
        std::fs::write(folder.path().join("other.csv"), "t,x,f\n0,0,0\n").expect("written");
        std::fs::write(folder.path().join("torn.mcap"), "nothing").expect("written");
        let found = listed(folder.path(), &[]);
        let line = |name: &str| {
            let mut of = found.iter().filter(|listed| listed.path.ends_with(name));
            of.next_back().map(Listed::line)
        };
        for (name, length) in [
            ("long.csv", "1 min 30 s"),
            ("broken.csv", "3.0 s, broken off"),
            ("plane.csv", "2.0 s"),
        ] {
            assert_eq!(line(name), Some(format!("{length}, scene simulated friction")));
        }
        assert_eq!(line("other.csv"), None);
        assert!(line("torn.mcap").is_some_and(|why| !why.is_empty()));
        // What is known is reported once, and not read again.
        let known: Vec<Listed> = found
            .into_iter()
            .filter(|listed| listed.path.ends_with("long.csv"))
            .collect();
        let again = listed(folder.path(), &known);
        assert_eq!(
            again.iter().filter(|listed| listed.path.ends_with("long.csv")).count(),
            1
        );
        let missing = list(&folder.path().join("none"), &[], &AtomicBool::new(false), |_| {});
        assert!(missing.is_err_and(|why| why.contains("none")));
    }
}
