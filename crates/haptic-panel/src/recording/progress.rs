//! Progress of the recording that is being written.

use haptic_recording::Totals;
use std::path::PathBuf;

/// News of the recording that is being written.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordingNews {
    /// It is being written.
    Going {
        /// Its file.
        path: PathBuf,
        /// What it holds.
        totals: Totals,
    },
    /// The disk does not keep up, and samples, changes or markers are lost.
    Behind {
        /// Its file, or the folder while there is no file.
        path: PathBuf,
        /// Samples lost since it began.
        lost: u64,
        /// Changes and markers lost since it began.
        lost_changes: u64,
    },
    /// It was ended.
    Ended {
        /// Its file.
        path: PathBuf,
        /// What it holds.
        totals: Totals,
    },
    /// It could not be begun, or not be written to its end.
    Failed {
        /// Why, with the name of the file.
        why: String,
    },
}

/// Length and size of a recording in words.
pub(crate) fn amount(totals: &Totals) -> String {
    #[expect(clippy::cast_precision_loss, reason = "one decimal is shown")]
    let megabytes = totals.bytes as f64 / 1e6;
    let mut text = format!("{:.1} s, {megabytes:.1} MB", totals.length_s);
    if totals.lost > 0 {
        text += &format!(", {} samples missing", totals.lost);
    }
    if totals.lost_changes > 0 {
        text += &format!(", {} changes and markers missing", totals.lost_changes);
    }
    text
}
