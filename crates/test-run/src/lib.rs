//! How the tests run: in short or at length, and what they skip.
//!
//! | environment variable | effect |
//! |---|---|
//! | `HAPTICD_TEST_LONG=1` | long runs take their full [`extent`] |
//! | `HAPTICD_TEST_MAY_SKIP=NEED,NEED` | a [`skip`] for any other need fails |

use std::collections::BTreeSet;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

/// Whether long runs take their full extent: `HAPTICD_TEST_LONG` is set, and not to 0.
#[must_use]
pub fn is_long() -> bool {
    std::env::var_os("HAPTICD_TEST_LONG").is_some_and(|value| !value.is_empty() && value != "0")
}

/// The extent of a long run (seconds, cases, cycles): `full` with `HAPTICD_TEST_LONG=1`, else `short`.
#[must_use]
pub fn extent<T>(short: T, full: T) -> T {
    if is_long() { full } else { short }
}

/// Says, once, that the calling test, or a part of it, was skipped for lack of `need`, and how to get that.
///
/// The line reaches the terminal although the test passes: libtest captures what the print macros
/// write, and nothing else.
///
/// # Panics
/// `HAPTICD_TEST_MAY_SKIP` is set and does not list `need`.
pub fn skip(need: &str, remedy: &str) {
    let thread = std::thread::current();
    let line = format!(
        "SKIPPED: {} needs {need} ({remedy})\n",
        thread.name().unwrap_or("a thread")
    );
    if let Ok(permitted) = std::env::var("HAPTICD_TEST_MAY_SKIP") {
        assert!(
            permitted.split(',').any(|each| each.trim() == need),
            "HAPTICD_TEST_MAY_SKIP does not list {need:?}: {line}"
        );
    }
    static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    if !SAID.lock().unwrap_or_else(PoisonError::into_inner).insert(line.clone()) {
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

/// Takes the lines that [`skip`] wrote in this run of `cargo test`, so that the next run begins without them.
#[must_use]
pub fn take_skipped() -> Vec<String> {
    let all = fs::read_to_string(journal()).unwrap_or_default();
    drop(fs::remove_file(journal()));
    let of_this_run = format!("{} ", run());
    all.lines()
        .filter_map(|line| line.strip_prefix(&of_this_run))
        .map(str::to_owned)
        .collect()
}

/// The process id of `cargo test`, the parent of every test binary.
fn run() -> u32 {
    std::os::unix::process::parent_id()
}

/// A file beside the test binaries.
fn journal() -> PathBuf {
    std::env::current_exe()
        .unwrap_or_default()
        .with_file_name("skipped-tests")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_skip_that_is_not_permitted_fails() {
        let skips = |permitted: Option<&str>| {
            let mut child = std::process::Command::new(std::env::current_exe().expect("a test has a path"));
            child
                .args(["--ignored", "--exact", "tests::skips"])
                .env("RUST_TEST_THREADS", "2");
            match permitted {
                Some(needs) => child.env("HAPTICD_TEST_MAY_SKIP", needs),
                None => child.env_remove("HAPTICD_TEST_MAY_SKIP"),
            };
            let output = child.output().expect("it starts");
            (
                output.status.success(),
                String::from_utf8_lossy(&output.stderr).into_owned(),
            )
        };
        for permitted in [None, Some("a rig, a moon"), Some("a moon")] {
            let (passed, said) = skips(permitted);
            assert!(passed, "{permitted:?}: {said}");
            // The test passed, and its line is not captured.
            assert_eq!(said, "SKIPPED: tests::skips needs a moon (wait for the night)\n");
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
}
