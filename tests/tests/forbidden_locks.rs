//! No lock in what the real-time thread runs: clippy refuses the types, and this holds it to that.
//! An uncontended lock makes no system call, so that nothing which watches the running loop could
//! see it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use system_tests::stderr;

const DENIAL: &str = "#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]";

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(path: &str) -> String {
    let path = workspace().join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Files whose own attribute covers them and what lies in them as modules: all that runs between
/// reading a sample and writing a force.
const COVERED: [&str; 14] = [
    "crates/hapticd/src/rt/mod.rs",
    "crates/haptic-core/src/lib.rs",
    "crates/device-io/src/link/session.rs",
    "crates/device-io/src/link/device_clock.rs",
    "crates/device-io/src/link/health.rs",
    "crates/device-io/src/link/line.rs",
    "crates/device-io/src/link/link_device.rs",
    "crates/device-io/src/link/mailbox.rs",
    "crates/device-io/src/link/sent_messages.rs",
    "crates/device-io/src/link/serial.rs",
    "crates/device-io/src/link/hid.rs",
    "crates/device-io/src/link/wire.rs",
    "crates/device-io/src/link/writer.rs",
    "crates/device-boards/src/lib.rs",
];

// hazard: P16
#[test]
fn every_module_that_the_loop_passes_through_forbids_locks() {
    for path in COVERED {
        let denied = read(path).lines().any(|line| line == DENIAL);
        assert!(denied, "{path} does not say {DENIAL}");
    }
    // Calls that are allowed by name, with a reason, are not on the path of a sample.
    for file in fs::read_dir(workspace().join("crates/hapticd/src/rt")).expect("a folder") {
        let path = file.expect("a file").path();
        let text = fs::read_to_string(&path).unwrap_or_default();
        let excused = text.matches("clippy::disallowed_").count() - 2 * text.matches(DENIAL).count();
        let most = usize::from(path.ends_with("thread.rs"));
        assert!(excused <= most, "{}: {excused} exceptions", path.display());
    }
}

/// Programs that take a lock each, as somebody might write it.
const PLANTED: [(&str, &str); 6] = [
    (
        "std::sync::Mutex",
        "pub fn tick(of: &std::sync::Mutex<f64>) -> bool { of.is_poisoned() }",
    ),
    (
        "std::sync::Mutex",
        "use std::sync::Mutex as Cheap;\npub struct Tick { pub last: Cheap<f64> }",
    ),
    (
        "std::sync::RwLock",
        "pub static SCENE: std::sync::RwLock<f64> = std::sync::RwLock::new(0.0);",
    ),
    (
        "std::sync::OnceLock",
        "pub struct Tick { pub first: std::sync::OnceLock<f64> }",
    ),
    (
        "std::sync::Condvar",
        "pub fn wake(other: &std::sync::Condvar) { other.notify_one() }",
    ),
    (
        "std::sync::mpsc::channel",
        "pub fn ends() -> bool { std::sync::mpsc::channel::<u8>().1.recv().is_ok() }",
    ),
];

/// What clippy says of a library under the workspace's list of what is forbidden; nothing where
/// there is no clippy.
fn clippy_says(source: &str) -> Option<(bool, String)> {
    let directory = tempfile::tempdir().expect("a directory");
    let at = |name: &str| directory.path().join(name);
    fs::create_dir(at("src")).expect("a folder");
    fs::write(
        at("Cargo.toml"),
        "[package]\nname = \"planted\"\nversion = \"0.0.0\"\nedition = \"2024\"\n[workspace]\n[lints.clippy]\ndisallowed_types = \"allow\"\ndisallowed_methods = \"allow\"\n",
    )
    .expect("written");
    fs::write(at("src/lib.rs"), source).expect("written");
    let run = Command::new(env!("CARGO"))
        .args(["clippy", "--offline", "--quiet"])
        .current_dir(directory.path())
        .env("CARGO_TARGET_DIR", at("target"))
        .env("CLIPPY_CONF_DIR", workspace())
        .env_remove("RUSTFLAGS")
        .output()
        .expect("cargo runs");
    let message = stderr(&run);
    if message.contains("no such command") || message.contains("is not installed") {
        test_run::skip("clippy", "rustup component add clippy");
        return None;
    }
    Some((run.status.success(), message))
}

// hazard: P16
#[test]
fn a_lock_planted_in_such_a_module_is_refused_by_clippy() {
    let Some((passed, message)) = clippy_says(&format!("{DENIAL}\npub fn tick(force_n: f64) -> f64 {{ force_n }}\n"))
    else {
        return;
    };
    // The list itself must be one that clippy understands, and name nothing that is not there.
    assert!(passed && !message.contains("warning"), "{message}");
    // A module for each.
    let modules = |denial: &str| -> String {
        let module =
            |(number, (_, source)): (usize, &(&str, &str))| format!("pub mod m{number} {{\n{denial}\n{source}\n}}\n");
        PLANTED.iter().enumerate().map(module).collect()
    };
    let (passed, message) = clippy_says(&modules(DENIAL)).expect("it was there");
    assert!(!passed, "{message}");
    for (named, source) in PLANTED {
        // An error shows the line that it is about.
        let is_its = |error: &str| error.contains(named) && source.lines().any(|line| error.contains(line));
        let refused = message
            .split("\n\n")
            .any(|error| error.contains("disallowed") && is_its(error));
        assert!(refused, "{named} passed in {source}: {message}");
    }
    // Elsewhere it is fit.
    let (passed, message) = clippy_says(&modules("")).expect("it was there");
    assert!(passed, "{message}");
}
