//! The Debian packages, of the binaries that the tests run.

use crate::binary;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// The package `hapticd`, or the need that this machine lacks, with its remedy.
///
/// # Errors
/// cargo-deb or dpkg is not there.
pub fn hapticd() -> Result<&'static Path, (&'static str, String)> {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    can_be_built()?;
    Ok(BUILT.get_or_init(|| build("hapticd", &["hapticd", "haptic-ctl"])))
}

/// The package `haptic-gui`.
///
/// # Errors
/// As of `hapticd`.
pub fn haptic_gui() -> Result<&'static Path, (&'static str, String)> {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    can_be_built()?;
    Ok(BUILT.get_or_init(|| build("haptic-gui", &["haptic-gui"])))
}

fn can_be_built() -> Result<(), (&'static str, String)> {
    let works = |program: &str, argument: &str| {
        let output = Command::new(program).arg(argument).output();
        output.is_ok_and(|output| output.status.success())
    };
    if !works("cargo-deb", "--version") {
        return Err(("cargo-deb", "cargo install --locked cargo-deb".to_owned()));
    }
    if !works("dpkg", "--version") {
        return Err(("dpkg", "a Debian system".to_owned()));
    }
    Ok(())
}

/// Packs binaries that exist: what a release compiles for minutes is not what these tests are about.
fn build(package: &str, binaries: &[&str]) -> PathBuf {
    let target = binary(binaries[0]).with_file_name("packages");
    fs::create_dir_all(target.join("release")).expect("a directory");
    for name in binaries {
        fs::copy(binary(name), target.join("release").join(name)).expect("it is built");
    }
    let generate = Command::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../packaging/generate.sh"))
        .arg(package)
        .arg(target.join("release"))
        .status();
    assert!(generate.expect("there is a shell").success());
    let output = Command::new("cargo-deb")
        .args([
            "deb",
            "--no-build",
            "--fast",
            "--locked",
            "--offline",
            "--package",
            package,
        ])
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .env("CARGO_TARGET_DIR", &target)
        .output()
        .expect("it was asked for its version");
    let (out, err) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert!(output.status.success(), "{out}{err}");
    // It prints where the package is.
    PathBuf::from(out.lines().last().expect("a path"))
}
