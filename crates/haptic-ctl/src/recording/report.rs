//! What is said of a recording that was written.

use crate::failure::Failure;
use crate::output;
use haptic_lab::recording::Totals;
use std::path::Path;

/// A recording that was written.
pub(crate) struct Report<'a> {
    pub(crate) file: &'a Path,
    pub(crate) totals: Totals,
    pub(crate) markers: u64,
    /// Whether it was ended on purpose.
    pub(crate) is_complete: bool,
}

impl Report<'_> {
    pub(crate) fn show(&self, json: bool) -> Result<(), Failure> {
        let totals = &self.totals;
        if json {
            return output::json(&serde_json::json!({
                "file": self.file,
                "rows": totals.rows,
                "lost": totals.lost,
                "missed": totals.missed,
                "markers": self.markers,
                "bytes": totals.bytes,
                "length_s": totals.length_s,
                "complete": self.is_complete,
            }));
        }
        let ending = if self.is_complete { "" } else { "; without an end" };
        let file = self.file.display();
        output::line(&format!("{file}: {}{ending}", shown(totals, self.markers)))
    }
}

/// Length, size and losses in a line.
pub(crate) fn shown(totals: &Totals, markers: u64) -> String {
    #[expect(clippy::cast_precision_loss, reason = "a size in megabytes")]
    let megabytes = totals.bytes as f64 * 1e-6;
    let mut text = format!(
        "{:.1} s, {} rows, {megabytes:.2} MB, {} lost, {} missed periods",
        totals.length_s, totals.rows, totals.lost, totals.missed
    );
    if markers > 0 {
        text.push_str(&format!(", {markers} markers"));
    }
    text
}
