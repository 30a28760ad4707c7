//! The C library for firmwares against the protocol's page. What is asked of it is in Python, so that an author of a
//! firmware can run it without Rust; here it is run.

use std::path::Path;
use std::process::Command;
use system_tests::simulated_rig::{firmware_folder, firmware_test, has_tools, is_there, make};

#[test]
fn the_library_does_as_the_protocols_page_says() {
    if !has_tools(&[("python3", "python3"), ("cc", "gcc")]) {
        return;
    }
    let library = Path::new(env!("CARGO_TARGET_TMPDIR")).join("haptic_device.so");
    let built = Command::new("cc")
        .args("-std=c99 -O1 -Wall -Wextra -Werror -Wpedantic -shared -fPIC -Isrc".split(' '))
        .args(["src/haptic_device.c", "-o"])
        .arg(&library)
        .current_dir(firmware_folder())
        .status()
        .expect("cc runs");
    assert!(built.success(), "the library is built");
    firmware_test(
        "property.py",
        &[&library.display().to_string(), test_run::extent("30", "200")],
    );
}

#[test]
fn faults_planted_in_the_library_are_seen() {
    if test_run::is_long_for("faults planted in the library for firmwares")
        && has_tools(&[("python3", "python3"), ("cc", "gcc")])
    {
        firmware_test("mutants.py", &[]);
    }
}

#[test]
fn the_library_compiles_for_an_esp32_c3s_core() {
    const RISC_V: [(&str, &str); 2] = [
        (
            "riscv64-unknown-elf-gcc",
            "gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf",
        ),
        ("make", "make"),
    ];
    if test_run::is_long_for("the library for firmwares, compiled for RISC-V") && has_tools(&RISC_V) {
        make(
            "rv32",
            &[concat!("BUILD=", env!("CARGO_TARGET_TMPDIR"), "/firmware-rv32")],
        );
    }
}

#[test]
fn sketches_for_an_uno_compile() {
    let core = "/usr/share/arduino/hardware/arduino/avr/cores/arduino/Arduino.h";
    if !test_run::is_long_for("Arduino sketches, compiled") || !has_tools(&[("avr-gcc", "gcc-avr")]) {
        return;
    }
    for (what, file) in [
        ("arduino-core-avr", core),
        ("avr-libc", "/usr/lib/avr/include/avr/io.h"),
    ] {
        if !is_there(what, what, Path::new(file).exists()) {
            return;
        }
    }
    // SimpleFOC's sketch needs its library, which is in no package of Debian's.
    for sketch in ["Hapkit", "TwoMotors"] {
        let compiled = Command::new(firmware_folder().join("tests/arduino-avr.sh"))
            .arg(firmware_folder().join(format!("examples/{sketch}/{sketch}.ino")))
            .arg(Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{sketch}.elf")))
            .status()
            .expect("sh runs");
        assert!(compiled.success(), "{sketch}");
    }
}
