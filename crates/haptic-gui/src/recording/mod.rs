//! Recordings: one that is being made of what the panel hears, and one that is looked at.

#[cfg(test)]
#[path = "../../tests/fixture/metadata.rs"]
mod fixture;
mod loaded;
mod taking;

pub use loaded::Loaded;
pub(crate) use loaded::Opened;
pub(crate) use taking::Recordings;

use haptic_lab::recording::Totals;
use std::path::PathBuf;

/// What becomes of the recording that is being made.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordingNews {
    /// It goes on.
    Going {
        /// Its file.
        path: PathBuf,
        /// How much it holds.
        totals: Totals,
    },
    /// The disk does not keep up: samples go missing.
    Behind {
        /// Its file, or the folder where that is not there yet.
        path: PathBuf,
        /// Samples that are missing since it began.
        lost: u64,
    },
    /// It was ended.
    Ended {
        /// Its file.
        path: PathBuf,
        /// How much it holds.
        totals: Totals,
    },
    /// It could not be begun, or not be written to the end.
    Failed {
        /// Why, naming the file.
        why: String,
    },
}

/// How much a recording holds, for people.
pub(crate) fn amount(totals: &Totals) -> String {
    #[expect(clippy::cast_precision_loss, reason = "one decimal is shown")]
    let megabytes = totals.bytes as f64 / 1e6;
    let mut text = format!("{:.1} s, {megabytes:.1} MB", totals.length_s);
    if totals.lost > 0 {
        text += &format!(", {} samples missing", totals.lost);
    }
    text
}
