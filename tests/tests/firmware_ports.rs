//! Boards of the C library for firmwares that run on this computer: natively, and as machine code in QEMU. Each passes
//! the checker of firmwares, and each planted fault ends at zero force.

use std::path::Path;
use std::process::Command;
use system_tests::binary;
use system_tests::simulated_rig::{firmware_folder, firmware_test, has_tools};

const NATIVE: [(&str, &str); 3] = [("python3", "python3"), ("make", "make"), ("cc", "gcc")];
const ARM: [(&str, &str); 2] = [
    ("arm-none-eabi-gcc", "gcc-arm-none-eabi libnewlib-arm-none-eabi"),
    ("qemu-system-arm", "qemu-system-arm"),
];

/// Builds what make calls by this name; returns the folder.
fn build(what: &str) -> String {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("firmware-ports")
        .display()
        .to_string();
    let built = Command::new("make")
        .args(["--silent", what])
        .arg(format!("BUILD={folder}"))
        .current_dir(firmware_folder())
        .status()
        .expect("make runs");
    assert!(built.success(), "{what} is built");
    folder
}

// hazard: F6
#[test]
fn every_fault_of_the_native_board_ends_at_zero_force() {
    let _alone = crate::alone();
    if test_run::is_long_for("the native board in real time") && has_tools(&NATIVE) {
        let folder = build("native");
        for axes in ["1", "2"] {
            firmware_test("ports.py", &["native", &folder, axes]);
        }
    }
}

#[test]
fn every_fault_of_a_cortex_m_ends_at_zero_force() {
    let _alone = crate::alone();
    if test_run::is_long_for("a Cortex-M in QEMU") && has_tools(&NATIVE) && has_tools(&ARM) {
        let folder = build("cortexm");
        for (port, axes) in [("cortexm3", "1"), ("cortexm3", "2"), ("cortexm4", "2")] {
            firmware_test("ports.py", &[port, &folder, axes]);
        }
        // rp2040js is no package of Debian's: compiled here, and run on demand.
        build("rp2040");
    }
}

#[test]
fn the_library_and_the_fake_rig_answer_alike() {
    let _alone = crate::alone();
    if test_run::is_long_for("library and fake rig, compared in real time") && has_tools(&NATIVE) {
        let native = format!("{}/native", build("native"));
        firmware_test("alike.py", &[&native, &binary("fake-rig").display().to_string(), "10"]);
    }
}
