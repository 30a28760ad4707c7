//! How the tests run: in short or at length, what they skip, and the binaries that they start.
//!
//! | environment variable | effect |
//! |---|---|
//! | `HAPTICD_TEST_LONG=1` | long runs take their full [`extent`], and nothing is [left out](is_long_for) |
//! | `HAPTICD_TEST_MAY_SKIP=NEED,NEED` | a [`skip`] for any other need fails |
//! | `HAPTICD_TEST_BUILT=1` | the programs are up to date: [`binary`] does not wait for a cargo that works beside |

use std::collections::BTreeSet;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::Command;
use std::sync::{Mutex, OnceLock, PoisonError};

/// Begins the lines of what was skipped.
const SKIPPED: &str = "SKIPPED: ";

/// Begins the lines of what was left to the long run.
const LEFT_OUT: &str = "LEFT OUT: ";

/// Whether long runs take their full extent.
fn is_long() -> bool {
    is_set("HAPTICD_TEST_LONG")
}

/// Whether a variable of the environment is set, and not to 0.
fn is_set(variable: &str) -> bool {
    std::env::var_os(variable).is_some_and(|value| !value.is_empty() && value != "0")
}

/// The extent of a long run (seconds, cases, cycles): `full` with `HAPTICD_TEST_LONG=1`, else `short`.
#[must_use]
pub fn extent<T>(short: T, full: T) -> T {
    if is_long() { full } else { short }
}

/// Whether this is the long run, which alone proves `what`. The short one says, once, that the calling test left it
/// out.
#[must_use]
pub fn is_long_for(what: &str) -> bool {
    if !is_long() {
        note(&format!("{LEFT_OUT}{}: {what}\n", caller()));
    }
    is_long()
}

/// Says, once, that the calling test, or a part of it, was skipped for lack of `need`, and how to get that.
///
/// # Panics
/// `HAPTICD_TEST_MAY_SKIP` is set and does not list `need`.
pub fn skip(need: &str, remedy: &str) {
    let line = format!("{SKIPPED}{} needs {need} ({remedy})\n", caller());
    if let Ok(permitted) = std::env::var("HAPTICD_TEST_MAY_SKIP") {
        assert!(
            permitted.split(',').any(|each| each.trim() == need),
            "HAPTICD_TEST_MAY_SKIP does not list {need:?}: {line}"
        );
    }
    note(&line);
}

/// Whether there are programs that Debian packages of the same names bring; a [`skip`] for each that is not.
#[must_use]
pub fn has(programs: &[&str]) -> bool {
    let missing: Vec<_> = programs.iter().filter(|program| !is_there(program)).collect();
    for program in &missing {
        skip(program, &format!("Debian: apt install {program}"));
    }
    missing.is_empty()
}

/// Whether a program is in one of the folders of `PATH`.
#[must_use]
pub fn is_there(program: &str) -> bool {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&paths).any(|folder| folder.join(program).is_file())
}

/// The name of the calling test.
fn caller() -> String {
    std::thread::current().name().unwrap_or("a thread").to_owned()
}

/// Puts a line, once, on the terminal and into the summary.
///
/// The line reaches the terminal although the test passes: libtest captures what the print macros
/// write, and nothing else.
fn note(line: &str) {
    static NOTED: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    if !NOTED
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .insert(line.to_owned())
    {
        return;
    }
    // A test does not fail because nobody reads its standard error, or because its folder is read-only.
    drop(io::stderr().write_all(line.as_bytes()));
    drop(
        OpenOptions::new()
            .create(true)
            .append(true)
            .open(journal())
            .and_then(|mut journal| journal.write_all(format!("{} {line}", run()).as_bytes())),
    );
}

/// Prints what [`skip`] and [`is_long_for`] wrote in this run of `cargo test`, and takes it away, so that the next run
/// begins without it.
pub fn print_not_done() {
    let all = fs::read_to_string(journal()).unwrap_or_default();
    drop(fs::remove_file(journal()));
    let of_this_run = format!("{} ", run());
    for (kind, what) in [(SKIPPED, "skipped"), (LEFT_OUT, "left to HAPTICD_TEST_LONG=1")] {
        let lines = all
            .lines()
            .filter_map(|line| line.strip_prefix(&of_this_run)?.strip_prefix(kind));
        let lines: Vec<&str> = lines.collect();
        if lines.is_empty() {
            println!("\nnothing was {what}");
            continue;
        }
        println!("\n{} {what}:", lines.len());
        for line in lines {
            println!("  {line}");
        }
    }
}

/// The process id of `cargo test`, the parent of every test binary.
fn run() -> u32 {
    std::os::unix::process::parent_id()
}

/// A file beside the test binaries.
fn journal() -> PathBuf {
    std::env::current_exe().unwrap_or_default().with_file_name("not-done")
}

/// The panel, of whose libraries only its window has need: no other test waits until they are compiled.
const PANEL: &str = "haptic-gui";

/// The other programs.
const PROGRAMS: [&str; 4] = ["hapticd", "haptic-ctl", "fake-rig", "fake-board"];

/// The path of one of the workspace's binaries, built as the tests are if it is not up to date.
///
/// # Panics
/// It cannot be built.
#[must_use]
pub fn binary(name: &str) -> PathBuf {
    static PROGRAMS_BUILT: OnceLock<()> = OnceLock::new();
    static PANEL_BUILT: OnceLock<()> = OnceLock::new();
    // The test itself is target/PROFILE/deps/NAME-HASH.
    let test = std::env::current_exe().expect("a test has a path");
    let directory = test.ancestors().nth(2).expect("it lies in target/PROFILE/deps");
    let (built, programs) = if name == PANEL {
        (&PANEL_BUILT, &[PANEL][..])
    } else {
        (&PROGRAMS_BUILT, &PROGRAMS[..])
    };
    built.get_or_init(|| {
        if name != PANEL && is_set("HAPTICD_TEST_BUILT") {
            return;
        }
        // Past the capture of the test, which may seem to hang for minutes.
        _ = io::stderr().write_all(b"building the programs that the tests start\n");
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(["build", "--quiet"]);
        if !directory.ends_with("release") {
            // With the tests, so that the features are those of the whole test run and nothing is
            // compiled twice.
            cargo.args(["--workspace", "--tests"]);
        } else if name == PANEL {
            // A benchmark measures what users run.
            cargo.args(["--release", "--package", PANEL]);
        } else {
            cargo.arg("--release");
        }
        cargo.args(programs.iter().flat_map(|program| ["--bin", *program]));
        let built = cargo
            .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
            .status()
            .expect("cargo runs");
        assert!(built.success(), "the binaries are built");
    });
    directory.join(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs one of the tests below in a process of its own; whether it passed, and what it printed past the capture.
    fn run_alone(test: &str, variable: &str, value: Option<&str>) -> (bool, String) {
        let mut child = Command::new(std::env::current_exe().expect("a test has a path"));
        child.args(["--ignored", "--exact", test]).env("RUST_TEST_THREADS", "2");
        match value {
            Some(value) => child.env(variable, value),
            None => child.env_remove(variable),
        };
        let output = child.output().expect("it starts");
        (
            output.status.success(),
            String::from_utf8_lossy(&output.stderr).into_owned(),
        )
    }

    #[test]
    fn a_skip_that_is_not_permitted_fails() {
        let skips = |permitted| run_alone("tests::skips", "HAPTICD_TEST_MAY_SKIP", permitted);
        for permitted in [None, Some("a rig, a moon"), Some("a moon")] {
            let (passed, printed) = skips(permitted);
            assert!(passed, "{permitted:?}: {printed}");
            // The test passed, and its line is not captured.
            assert_eq!(printed, "SKIPPED: tests::skips needs a moon (wait for the night)\n");
        }
        for permitted in ["", "a rig", "moon"] {
            assert!(!skips(Some(permitted)).0, "{permitted}");
        }
    }

    #[test]
    #[ignore = "the test above runs it in a process of its own"]
    fn skips() {
        for _ in 0..2 {
            skip("a moon", "wait for the night");
        }
    }

    #[test]
    fn only_the_short_run_leaves_something_out_and_says_so() {
        let leaves_out = |long| run_alone("tests::leaves_out", "HAPTICD_TEST_LONG", long);
        for short in [None, Some(""), Some("0")] {
            let printed = "LEFT OUT: tests::leaves_out: a full moon\n".to_owned();
            assert_eq!(leaves_out(short), (true, printed), "{short:?}");
        }
        let (passed, printed) = leaves_out(Some("1"));
        assert!(!passed && !printed.contains("LEFT OUT"), "{printed}");
    }

    #[test]
    #[ignore = "the test above runs it in a process of its own"]
    fn leaves_out() {
        for _ in 0..2 {
            assert!(!is_long_for("a full moon"), "it is done");
        }
    }
}
