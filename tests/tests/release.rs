//! The preparation of a release, up to what is compiled for minutes.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use system_tests::stderr;

const REPOSITORY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

fn run(program: &str, arguments: &[&str], folder: &Path) -> Output {
    Command::new(program)
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap_or_else(|error| panic!("{program}: {error}"))
}

fn ok(program: &str, arguments: &[&str], folder: &Path) -> String {
    let output = run(program, arguments, folder);
    assert!(output.status.success(), "{program} {arguments:?}: {}", stderr(&output));
    String::from_utf8(output.stdout).expect("text")
}

/// No version that this project ever has, so that its changelog names it nowhere.
const VERSION: &str = "999.0.0-rc.1";

/// What is unreleased in the clone, whatever is here.
const UNRELEASED: &str = "- What a test has changed.\n\n- And another thing.";

/// A clone of this repository with this tree's way to release and an unreleased change.
fn clone(folder: &Path) -> PathBuf {
    let clone = folder.join("hapticd");
    let to = clone.to_str().expect("a plain path");
    ok("git", &["clone", "--quiet", "--no-local", REPOSITORY, to], folder);
    for file in ["packaging/release.sh", "packaging/licences.py"] {
        fs::copy(Path::new(REPOSITORY).join(file), clone.join(file)).expect("it is there");
    }
    let changelog = clone.join("CHANGELOG.md");
    let text = fs::read_to_string(&changelog).expect("a changelog");
    let (before, rest) = text.split_once("\n## Unreleased\n").expect("what is unreleased");
    let released = rest.find("\n## ").map_or("", |at| &rest[at..]);
    let text = format!("{before}\n## Unreleased\n\n{UNRELEASED}\n{released}");
    fs::write(changelog, text).expect("it can be written");
    for (key, value) in [("user.name", "A test"), ("user.email", "test@localhost")] {
        ok("git", &["config", key, value], &clone);
    }
    ok(
        "git",
        &["commit", "--quiet", "--all", "--allow-empty", "--message=this tree"],
        &clone,
    );
    clone
}

fn refused(clone: &Path, arguments: &[&str]) -> String {
    let output = run("packaging/release.sh", arguments, clone);
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8(output.stderr).expect("text")
}

#[test]
fn release_is_prepared_in_clone_and_refused_if_incomplete() {
    if !test_run::is_long_for("the preparation of a release") {
        return;
    }
    let directory = tempfile::tempdir().expect("a directory");
    let clone = clone(directory.path());
    let out = directory.path().join("out");
    let arguments = [VERSION, "--dry-run", "--out", out.to_str().expect("a plain path")];

    assert!(refused(&clone, &[]).contains("a version is wanted"));
    assert!(refused(&clone, &["1.0"]).contains("version 1.0: expected one as in 1.0.0, 1.0.0-rc or 1.0.0-rc.1"));
    fs::write(clone.join("stray"), "").expect("written");
    assert!(refused(&clone, &arguments).contains("not committed:\n?? stray"));
    fs::remove_file(clone.join("stray")).expect("it is there");

    let tag = ok("packaging/release.sh", &arguments, &clone);
    assert_eq!(
        tag,
        fs::read_to_string(out.join("tag.txt")).expect("the text of the tag")
    );
    assert_eq!(tag.trim(), format!("hapticd {VERSION}\n\n{UNRELEASED}"));

    let source = out.join("source");
    let cut = fs::read_to_string(source.join("CHANGELOG.md")).expect("a changelog");
    assert!(cut.contains(&format!("## Unreleased\n\n## {VERSION}, 20")), "{cut}");
    for manifest in ["Cargo.toml", "python/core/Cargo.toml"] {
        let asked = format!("metadata --locked --offline --no-deps --format-version=1 --manifest-path {manifest}");
        let metadata = ok("cargo", &asked.split(' ').collect::<Vec<_>>(), &source);
        let metadata: serde_json::Value = serde_json::from_str(&metadata).expect("JSON");
        for package in metadata["packages"].as_array().expect("packages") {
            assert_eq!(package["version"], VERSION, "{}", package["name"]);
        }
    }
    // The lock file has followed, and cargo has nothing to add.
    ok("cargo", &["update", "--workspace", "--locked", "--offline"], &source);
    // Nothing is left over there, and nothing has changed here.
    for tree in [&source, &clone] {
        assert_eq!(ok("git", &["status", "--porcelain"], tree), "");
    }
    assert!(refused(&clone, &arguments).contains("exists: move it away"));
    let twice = format!("CHANGELOG.md has {VERSION} already");
    assert!(refused(&source, &[VERSION]).contains(&twice));

    let licences = ok("packaging/licences.py", &["Cargo.toml"], &source);
    for part in ["\nserialport ", "Mozilla Public License, v. 2.0", "\ntokio "] {
        assert!(licences.contains(part), "{part}");
    }
    assert!(
        !licences.contains("\nvt100 "),
        "what the tests alone want is in no program"
    );
}
