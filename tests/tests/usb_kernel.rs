//! Rigs behind a true kernel's USB drivers, in a virtual machine: `tests/qemu/run.sh` says how.

use std::path::Path;
use std::process::{Command, Stdio};
use system_tests::binary;

/// What a script that lacks a program ends with.
const SKIPPED: i32 = 77;

#[test]
fn rigs_on_usb_are_found_driven_unplugged_and_found_again() {
    // A kernel boots under emulation, for minutes.
    if !test_run::is_long_for("rigs behind a true kernel's USB drivers") {
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("qemu/run.sh");
    let hapticd = binary("hapticd");
    let binaries = hapticd.parent().expect("it lies in a folder");
    let ran = Command::new(script)
        .arg("--binaries")
        .arg(binaries)
        .env("CARGO_TARGET_DIR", binaries.parent().expect("the target folder"))
        .stdin(Stdio::null())
        .output()
        .expect("bash runs");
    let said = String::from_utf8_lossy(&ran.stdout);
    println!("{said}{}", String::from_utf8_lossy(&ran.stderr));
    if ran.status.code() == Some(SKIPPED) {
        let why = said.lines().rev().find(|line| line.starts_with("SKIPPED"));
        test_run::skip("qemu", why.unwrap_or_default());
        return;
    }
    assert!(ran.status.success(), "{}", ran.status);
    // An empty run is none.
    let passed = said.lines().filter(|line| line.starts_with("PASS ")).count();
    assert!(passed > 60, "only {passed} checks were made");
}
