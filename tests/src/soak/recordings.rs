//! Recordings of a daemon, one after another in every format, each read and replayed when it has ended.

use super::Plan;
use crate::{ctl, plain, stderr};
use serde_json::Value;
use std::path::Path;
use std::time::Duration;

/// Shortest and longest recording.
const LENGTHS: [Duration; 2] = [Duration::from_secs(5), Duration::from_secs(60)];

/// Part of the soak that a recording takes.
const PART: u32 = 12;

/// What was found of the recordings of a daemon.
#[derive(Debug, Default)]
pub(super) struct Checked {
    pub(super) recordings: u64,
    pub(super) rows: u64,
    /// Ticks that were computed again and compared.
    pub(super) compared: u64,
    pub(super) with_force: u64,
    pub(super) differing: u64,
    /// Rows that are missing, as the recordings say.
    pub(super) lost: u64,
    /// What is wrong, with the file.
    pub(super) faults: Vec<String>,
}

/// Records until the soak is over.
pub(super) fn run(plan: &Plan, socket: &Path) -> Checked {
    let length = format!("{}ms", (plan.length / PART).clamp(LENGTHS[0], LENGTHS[1]).as_millis());
    let mut checked = Checked::default();
    for format in ["mcap", "csv", "parquet"].iter().cycle() {
        if plan.is_over() {
            break;
        }
        checked.recordings += 1;
        let file = plan.folder.join(format!("{}.{format}", checked.recordings));
        let recorded = ctl(socket, &["record", plain(&file), "--force", "--for", &length]);
        let checks = if recorded.status.success() {
            checked.check(plain(&file), socket)
        } else {
            Err(stderr(&recorded))
        };
        match checks {
            // One that something is wrong with is kept.
            Err(why) => checked.faults.push(format!("{}: {}", file.display(), why.trim())),
            Ok(()) => drop(std::fs::remove_file(file)),
        }
    }
    checked
}

impl Checked {
    /// Reads and replays a recording; says what is wrong with it.
    fn check(&mut self, path: &str, socket: &Path) -> Result<(), String> {
        let ask = |arguments: &[&str]| -> Result<Value, String> {
            let output = ctl(socket, arguments);
            serde_json::from_slice(&output.stdout).map_err(|_| stderr(&output))
        };
        let info = ask(&["--json", "recording", "info", path])?;
        let replayed = ask(&["--json", "replay", path])?;
        let number = |value: &Value| value.as_u64().unwrap_or(0);
        let (rows, lost, differing) = (
            number(&info["rows"]),
            number(&info["lost"]),
            number(&replayed["differing"]),
        );
        self.rows += rows;
        self.lost += lost;
        self.differing += differing;
        self.compared += number(&replayed["compared"]);
        self.with_force += number(&replayed["with_force"]);
        let ticks = number(&info["ticks"][1]) + 1 - number(&info["ticks"][0]);
        if rows == 0 || rows + lost < ticks {
            return Err(format!("{ticks} ticks, {rows} rows and {lost} reported lost"));
        }
        if differing > 0 {
            let first = &replayed["first_differing"];
            return Err(format!("{differing} ticks differ in the replay, first {first}"));
        }
        Ok(())
    }
}
