//! No test is forgotten: each file beside this one is a module of one binary, what runs alone says so, and the
//! documents of a library are tested where an example is in them, and nowhere else.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use system_tests::hazards;

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
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let mut files: Vec<String> = fs::read_dir(folder)
        .expect("a folder")
        .filter_map(|file| {
            let name = file.expect("a file").file_name().into_string().expect("plain");
            name.strip_suffix(".rs").map(str::to_owned)
        })
        .collect();
    files.sort();
    assert_eq!(listed, files);
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

/// Whether a documentation comment has a block of code that rustdoc would run.
fn has_example(source: &str) -> bool {
    let fences = source.lines().filter_map(|line| {
        let comment = line.trim_start();
        let text = comment.strip_prefix("//!").or_else(|| comment.strip_prefix("///"))?;
        text.trim().strip_prefix("```")
    });
    // Every other one closes a block.
    fences.step_by(2).any(|language| language != "text")
}

#[test]
fn library_without_examples_has_no_doctests() {
    assert!(has_example("//! ```text\n//! ```\n/// ```\n/// f();\n/// ```"));
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut libraries: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (path, source) in hazards::sources(&root) {
        let Some((folder, _)) = path.split_once("/src/") else {
            continue;
        };
        if root.join(folder).join("src/lib.rs").exists() {
            let examples = libraries.entry(folder.to_owned()).or_default();
            examples.extend(has_example(&source).then_some(path));
        }
    }
    assert!(libraries.len() > 5, "{libraries:?}");
    for (folder, examples) in libraries {
        let manifest = fs::read_to_string(root.join(&folder).join("Cargo.toml")).expect("a manifest");
        match (manifest.contains("doctest = false"), examples.as_slice()) {
            (true, [path, ..]) => panic!("{path} has an example: remove `doctest = false` from {folder}/Cargo.toml"),
            (false, []) => panic!("{folder} has no example: add `doctest = false` to [lib] in its Cargo.toml"),
            _ => {}
        }
    }
}
