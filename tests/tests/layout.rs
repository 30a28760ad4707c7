//! No test is forgotten: each file beside this one is a module of one binary, and what runs alone says so.

use std::fs;
use std::path::Path;
use system_tests::files;

fn read(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(name);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The modules of a binary, by name.
fn modules(binary: &str) -> Vec<String> {
    read(binary)
        .lines()
        .filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';'))
        .map(str::to_owned)
        .collect()
}

#[test]
fn every_file_is_a_module_of_one_binary() {
    let mut listed = [modules("system.rs"), modules("alone.rs")].concat();
    listed.extend(["alone", "system"].map(str::to_owned));
    listed.sort();
    let there = files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests"));
    let names = there.iter().filter_map(|file| file.file_stem()?.to_str());
    assert_eq!(listed, names.collect::<Vec<_>>());
}

#[test]
fn every_test_that_runs_alone_begins_with_its_guard() {
    for module in modules("alone.rs") {
        let source = read(&format!("{module}.rs"));
        for test in source.split("#[test]\n").skip(1) {
            let (signature, body) = test.split_once("{\n").expect("a function");
            assert!(
                body.trim_start().starts_with("let _alone = crate::alone();"),
                "{module}: {}",
                signature.trim()
            );
        }
    }
}
