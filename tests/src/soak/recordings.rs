//! Recordings of a daemon, one after another in every format, each read and replayed when it has ended.

use super::plan::Plan;
use crate::process::{Killed, signal};
use crate::{binary, ctl};
use rustix::process::Signal;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Shortest and longest recording.
const LENGTHS: [Duration; 2] = [Duration::from_secs(5), Duration::from_secs(60)];

/// Part of the soak that a recording takes.
const PART: u32 = 12;

const FORMATS: [&str; 3] = ["mcap", "csv", "parquet"];

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
pub(super) fn run(plan: &Plan, rig: &'static str, socket: &Path) -> Checked {
    let length = (plan.length / PART).clamp(LENGTHS[0], LENGTHS[1]);
    let mut checked = Checked::default();
    for format in FORMATS.iter().cycle() {
        if plan.is_over() {
            break;
        }
        let name = format!("{}-{}.{format}", rig.replace(' ', "-"), checked.recordings + 1);
        let file = plan.folder.join(name);
        let ended = record(plan, &file, length, socket);
        let before = checked.faults.len();
        if !ended.is_ok_and(|ended| ended) {
            checked
                .faults
                .push(format!("{}: haptic-ctl record failed", file.display()));
        }
        checked.check(&file, socket);
        // One that something is wrong with is kept.
        if checked.faults.len() == before {
            drop(std::fs::remove_file(file));
        }
    }
    checked
}

/// Makes a recording; returns whether it has ended as it should.
fn record(plan: &Plan, file: &Path, length: Duration, socket: &Path) -> std::io::Result<bool> {
    let mut recorder = Killed(
        Command::new(binary("haptic-ctl"))
            .arg("record")
            .arg(file)
            .args(["--force", "--for", &format!("{}ms", length.as_millis()), "--socket"])
            .arg(socket)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()?,
    );
    let mut is_interrupted = false;
    let began = Instant::now();
    let ended: ExitStatus = loop {
        if let Some(ended) = recorder.try_wait()? {
            break ended;
        }
        // The first rows may not have arrived yet.
        if plan.is_over() && !is_interrupted && began.elapsed() > Duration::from_secs(2) {
            is_interrupted = true;
            signal(recorder.id(), Signal::INT);
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    Ok(ended.success() || is_interrupted)
}

impl Checked {
    fn check(&mut self, file: &Path, socket: &Path) {
        self.recordings += 1;
        let path = file.to_string_lossy();
        let ask = |arguments: &[&str]| -> Result<Value, String> {
            let output = ctl(socket, arguments);
            serde_json::from_slice(&output.stdout)
                .map_err(|_| format!("{path}: {}", String::from_utf8_lossy(&output.stderr).trim()))
        };
        let compared = ask(&["--json", "recording", "info", &path]).and_then(|info| {
            let replayed = ask(&["--json", "replay", &path])?;
            Ok((info, replayed))
        });
        match compared {
            Ok((info, replayed)) => self.add(&path, &info, &replayed),
            Err(why) => self.faults.push(why),
        }
    }

    fn add(&mut self, path: &str, info: &Value, replayed: &Value) {
        let number = |object: &Value, name: &str| object[name].as_u64().unwrap_or(0);
        let (rows, lost) = (number(info, "rows"), number(info, "lost"));
        let span = match (info["ticks"][0].as_u64(), info["ticks"][1].as_u64()) {
            (Some(first), Some(last)) => last - first + 1,
            _ => 0,
        };
        if rows == 0 {
            self.faults.push(format!("{path}: no rows"));
        }
        if rows + lost < span {
            let why = format!("{path}: {span} ticks, {rows} rows and {lost} reported lost");
            self.faults.push(why);
        }
        let differing = number(replayed, "differing");
        if differing > 0 {
            let first = &replayed["first_differing"];
            self.faults
                .push(format!("{path}: {differing} ticks differ in the replay, first {first}"));
        }
        self.rows += rows;
        self.lost += lost;
        self.differing += differing;
        self.compared += number(replayed, "compared");
        self.with_force += number(replayed, "with_force");
    }
}
