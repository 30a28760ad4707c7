//! The version, which a report of a defect names. With a test of its own the program is built beside the other crates,
//! and not once more on its own for the first of the tests that start it.

use std::process::Command;

#[test]
fn version_is_name_and_version() {
    let output = Command::new(env!("CARGO_BIN_EXE_hapticd"))
        .arg("--version")
        .output()
        .expect("it starts");
    let expected = concat!("hapticd ", env!("CARGO_PKG_VERSION"), "\n");
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
}
