//! Machines of their own: a true kernel's USB drivers (`tests/qemu/run.sh` says how), and the packages on a minimal
//! Debian (`tests/debian/boot.sh`, `tests/debian/piuparts.sh`).

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Stdio};
use system_tests::{binary, package, stderr};

/// What a script that lacks a program ends with.
const SKIPPED: i32 = 77;

/// Runs a script of this folder that prints a line for each check. All must pass, and more than `most_of`: an empty
/// run is none.
fn run(script: &str, arguments: &[&OsStr], need: &str, most_of: usize) {
    let ran = Command::new(Path::new(env!("CARGO_MANIFEST_DIR")).join(script))
        .args(arguments)
        .env(
            "CARGO_TARGET_DIR",
            binary("hapticd").ancestors().nth(2).expect("the target folder"),
        )
        .stdin(Stdio::null())
        .output()
        .expect("bash runs");
    let printed = String::from_utf8_lossy(&ran.stdout);
    println!("{printed}{}", stderr(&ran));
    if ran.status.code() == Some(SKIPPED) {
        let why = printed.lines().rev().find(|line| line.starts_with("SKIPPED"));
        return test_run::skip(need, why.unwrap_or_default());
    }
    assert!(ran.status.success(), "{}", ran.status);
    let passed = printed.lines().filter(|line| line.starts_with("PASS ")).count();
    assert!(passed > most_of, "only {passed} checks were made");
}

#[test]
fn rigs_on_usb_are_found_driven_unplugged_and_found_again() {
    let _alone = crate::alone();
    // A kernel boots under emulation, for minutes.
    if !test_run::is_long_for("rigs behind a true kernel's USB drivers") {
        return;
    }
    let hapticd = binary("hapticd");
    let binaries = hapticd.parent().expect("it lies in a folder");
    run("qemu/run.sh", &["--binaries".as_ref(), binaries.as_ref()], "qemu", 60);
}

// hazard: H7
#[test]
fn booted_debian_handles_plugging_unplugging_and_sleep() {
    let _alone = crate::alone();
    if !test_run::is_long_for("the package on a booted Debian") {
        return;
    }
    let package = match package::hapticd() {
        Ok(package) => package,
        Err((need, remedy)) => return test_run::skip(need, &remedy),
    };
    let fake_rig = binary("fake-rig");
    let arguments: [&OsStr; 4] = [
        "--package".as_ref(),
        package.as_ref(),
        "--fake-rig".as_ref(),
        fake_rig.as_ref(),
    ];
    run("debian/boot.sh", &arguments, "mmdebstrap", 14);
}

#[test]
fn piuparts_finds_both_packages_leave_no_trace() {
    let _alone = crate::alone();
    if !test_run::is_long_for("the packages under piuparts") {
        return;
    }
    let packages = package::hapticd().and_then(|hapticd| Ok((hapticd, package::haptic_gui()?)));
    let (hapticd, haptic_gui) = match packages {
        Ok(both) => both,
        Err((need, remedy)) => return test_run::skip(need, &remedy),
    };
    run(
        "debian/piuparts.sh",
        &[hapticd.as_ref(), haptic_gui.as_ref()],
        "piuparts",
        1,
    );
}
