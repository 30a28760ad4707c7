//! Boards of the C library for firmwares that run on this computer: natively, and as machine code in QEMU. Each passes
//! the checker of firmwares, and each planted fault ends at zero force.

use system_tests::binary;
use system_tests::simulated_rig::{firmware_test, has_tools, make};

const NATIVE: [(&str, &str); 3] = [("python3", "python3"), ("make", "make"), ("cc", "gcc")];
const ARM: [(&str, &str); 2] = [
    ("arm-none-eabi-gcc", "gcc-arm-none-eabi libnewlib-arm-none-eabi"),
    ("qemu-system-arm", "qemu-system-arm"),
];

/// Where all is built.
const FOLDER: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/firmware-ports");

fn build(what: &str) {
    make(what, &[&format!("BUILD={FOLDER}")]);
}

// hazard: F6
#[test]
fn every_fault_of_the_native_board_ends_at_zero_force() {
    let _alone = crate::alone();
    if test_run::is_long_for("the native board in real time") && has_tools(&NATIVE) {
        build("native");
        for axes in ["1", "2"] {
            firmware_test("ports.py", &["native", FOLDER, axes]);
        }
    }
}

#[test]
fn every_fault_of_a_cortex_m_ends_at_zero_force() {
    let _alone = crate::alone();
    if test_run::is_long_for("a Cortex-M in QEMU") && has_tools(&NATIVE) && has_tools(&ARM) {
        build("cortexm");
        for (port, axes) in [("cortexm3", "1"), ("cortexm3", "2"), ("cortexm4", "2")] {
            firmware_test("ports.py", &[port, FOLDER, axes]);
        }
        // rp2040js is no package of Debian's: compiled here, and run on demand.
        build("rp2040");
    }
}

#[test]
fn the_library_and_the_fake_rig_answer_alike() {
    let _alone = crate::alone();
    if test_run::is_long_for("library and fake rig, compared in real time") && has_tools(&NATIVE) {
        build("native");
        let native = format!("{FOLDER}/native");
        firmware_test("alike.py", &[&native, &binary("fake-rig").display().to_string(), "10"]);
    }
}
