//! Counting instructions by callgrind.

use std::io;
use std::path::Path;
use std::process::{Command, Stdio};
use thiserror::Error;

/// Why instructions could not be counted.
#[derive(Debug, Error)]
pub enum CountError {
    /// There is no valgrind.
    #[error("valgrind is not installed, which counts instructions (Debian: apt install valgrind)")]
    NoValgrind,
    /// It could not be run, or its output not be read.
    #[error("callgrind: {0}")]
    Io(#[from] io::Error),
    /// The probe failed.
    #[error("callgrind failed: {0}")]
    Failed(String),
}

/// Counts the instructions of each call of [`measured_ticks`](super::measured_ticks) that `program` makes when it is
/// run with `arguments`. `directory` takes callgrind's files.
///
/// # Errors
/// There is no valgrind, the program fails under it, or a call is not counted.
pub fn count(program: &Path, arguments: &[&str], directory: &Path) -> Result<Vec<u64>, CountError> {
    // Whole: a pattern would do for the toggle, and not for the dump.
    const MEASURED: &str = "haptic_lab::cost::measured_ticks";
    let out = directory.join("callgrind.out");
    let ran = Command::new("valgrind")
        .arg("--tool=callgrind")
        .arg(format!("--toggle-collect={MEASURED}"))
        .arg(format!("--dump-after={MEASURED}"))
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(program)
        .args(arguments)
        .stdin(Stdio::null())
        .output();
    let ran = match ran {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Err(CountError::NoValgrind),
        ran => ran?,
    };
    if !ran.status.success() {
        return Err(CountError::Failed(String::from_utf8_lossy(&ran.stderr).into_owned()));
    }
    let mut totals = Vec::new();
    loop {
        // One file for each call, numbered from 1.
        let path = format!("{}.{}", out.display(), totals.len() + 1);
        let Ok(text) = std::fs::read_to_string(&path) else {
            break;
        };
        let total = text
            .lines()
            .find_map(|line| line.strip_prefix("totals: ").or_else(|| line.strip_prefix("summary: ")))
            .and_then(|total| total.trim().parse().ok())
            .filter(|total| *total > 0)
            .ok_or_else(|| CountError::Failed(format!("{path} has no total")))?;
        totals.push(total);
    }
    Ok(totals)
}
