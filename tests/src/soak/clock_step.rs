//! Steps of the wall clock as one program sees it. Stepping the machine's own would step it for everybody, and no
//! namespace has a wall clock of its own, so a library between the program and the C library adds the step.

use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::process::Command;

const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/soak/clock_step.c");

/// The wall clock of one program.
#[derive(Debug)]
pub(super) struct ClockStep {
    step: File,
}

impl ClockStep {
    /// Lets the wall clock of a program be stepped that is yet to be started; says why where it cannot be.
    pub(super) fn of(program: &mut Command, folder: &Path) -> Result<Self, String> {
        let (library, step) = (folder.join("clock_step.so"), folder.join("clock_step"));
        let built = Command::new("cc")
            .args(["-shared", "-fPIC", "-O2", "-o"])
            .arg(&library)
            .arg(SOURCE)
            .output();
        match built {
            Ok(built) if built.status.success() => {}
            Ok(built) => return Err(String::from_utf8_lossy(&built.stderr).into_owned()),
            Err(error) => return Err(format!("cc: {error}")),
        }
        fs::write(&step, 0_i64.to_ne_bytes()).map_err(|error| error.to_string())?;
        program.env("LD_PRELOAD", &library).env("HAPTICD_SOAK_CLOCK", &step);
        Ok(Self {
            step: File::options()
                .write(true)
                .open(step)
                .map_err(|error| error.to_string())?,
        })
    }

    /// Sets how far its wall clock is ahead of the true one, s.
    pub(super) fn set(&self, ahead_s: i64) {
        self.step
            .write_all_at(&ahead_s.to_ne_bytes(), 0)
            .expect("a file of ours");
    }
}
