//! What is said of a recording that was written.

use crate::output::count;
use haptic_recording::Totals;
use serde_json::{Value, json};
use std::path::Path;

/// For programs.
pub(crate) fn as_json(file: &Path, totals: &Totals) -> Value {
    json!({
        "file": file,
        "rows": totals.rows,
        "lost": totals.lost,
        "lost_changes": totals.lost_changes,
        "missed": totals.missed,
        "bytes": totals.bytes,
        "length_s": totals.length_s,
    })
}

/// Length, size and losses, for people.
pub(crate) fn as_text(totals: &Totals) -> String {
    #[expect(clippy::cast_precision_loss, reason = "a size in megabytes")]
    let megabytes = totals.bytes as f64 * 1e-6;
    let lost_changes = match totals.lost_changes {
        0 => String::new(),
        changes => format!(" and {}", count(changes, "change")),
    };
    format!(
        "{:.1} s, {}, {megabytes:.2} MB, {}{lost_changes} lost, {}",
        totals.length_s,
        count(totals.rows, "row"),
        totals.lost,
        count(totals.missed, "missed period")
    )
}
