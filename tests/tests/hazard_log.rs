//! tests/hazards.txt names a test for every hazard of docs/safety.md, and every test that is marked as the proof of a
//! hazard.
//!
//! A row of the page is a heading of the third level with its id and the hazard, `### H3: ...`, followed by one item
//! for each of `FIELDS`, `- **Cause:** ...`. Its proofs are the indented lines below its id, each `path: name`, or
//! `none: ` and why software cannot prove it. A planted fault has no row in the page: its text stands behind its id.
//! Tests are marked in the sources by a comment directly above their attributes, `// hazard: H3, P14`, or in Python
//! above their decorators, `# hazard: F4`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What every section of the log says, in this order.
const FIELDS: [&str; 5] = ["Cause", "Detection", "Reaction", "Off after", "Remains"];

/// Letters that ids begin with: hazards seen by trying, further ones, planted faults, and what no
/// software can do.
const KINDS: [char; 4] = ['H', 'F', 'P', 'S'];

fn is_id(text: &str) -> bool {
    let digits = text.strip_prefix(KINDS).unwrap_or_default();
    !digits.is_empty() && digits.chars().all(|digit| digit.is_ascii_digit())
}

/// The ids of the page's sections.
fn sections(page: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for section in page.split("\n#").skip(1) {
        let title = section.trim_start_matches(['#', ' ']);
        let Some((id, _)) = title.split_once(": ").filter(|(id, _)| is_id(id)) else {
            continue;
        };
        let items = section
            .lines()
            .filter_map(|line| line.strip_prefix("- **")?.split_once(":** "));
        let labels: Vec<&str> = items.map(|(label, _)| label).collect();
        assert_eq!(labels, FIELDS, "{id}");
        assert!(found.insert(id.to_owned()), "{id} has two sections");
    }
    found
}

/// The proofs of each id.
fn proofs(text: &str) -> BTreeMap<String, BTreeSet<String>> {
    let mut rows: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut last = String::new();
    for line in text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        if let Some(proof) = line.strip_prefix("  ") {
            let row = rows.get_mut(&last).unwrap_or_else(|| panic!("of which id: {line}"));
            row.insert(proof.to_owned());
        } else {
            last = line.split(": ").next().unwrap_or_default().to_owned();
            assert!(is_id(&last), "{last} is no id");
            assert_eq!(last.starts_with('P'), line.contains(": "), "{line}");
            let before = rows.insert(last.clone(), BTreeSet::new());
            assert!(before.is_none(), "{last} stands there twice");
        }
    }
    rows
}

/// The tests of a source file, each as `path: name`, with the ids that it is marked to prove.
fn tests(path: &str, source: &str) -> Vec<(String, Vec<String>)> {
    let is_python = path.ends_with(".py");
    let mark = if is_python { "# hazard:" } else { "// hazard:" };
    let mut tests = Vec::new();
    let (mut ids, mut is_test) = (Vec::new(), false);
    for (number, line) in (1..).zip(source.lines()) {
        let line = if is_python { line } else { line.trim() };
        if let Some(text) = line.strip_prefix(mark) {
            ids = text.split(',').map(|id| id.trim().to_owned()).collect();
            assert!(ids.iter().all(|id: &String| is_id(id)), "{path}:{number}: {line}");
        } else if let Some(name) = function(line) {
            if is_test || is_python && name.starts_with("test_") {
                tests.push((format!("{path}: {name}"), std::mem::take(&mut ids)));
            }
            is_test = false;
        } else {
            is_test |= line.starts_with("#[test") || line.starts_with("#[tokio::test");
        }
        let is_lost = !ids.is_empty() && (line.is_empty() || function(line).is_some());
        assert!(!is_lost, "the mark stands above no test: {path}:{number}: {line}");
    }
    tests
}

/// The name of the function that a line begins.
fn function(line: &str) -> Option<&str> {
    let (before, rest) = line.split_once("fn ").or_else(|| line.split_once("def "))?;
    let is_item = ["", "pub ", "pub(crate) ", "pub(super) ", "async ", "const ", "unsafe "].contains(&before);
    is_item.then(|| rest.split(['(', '<']).next())?
}

#[test]
fn hazard_rows_and_marked_tests_match() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let read = |path: &str| std::fs::read_to_string(root.join(path)).expect("it is there");
    let (page, rows) = (sections(&read("docs/safety.md")), proofs(&read("tests/hazards.txt")));
    let sources = system_tests::sources(&root);
    let tests: Vec<_> = sources.iter().flat_map(|(path, source)| tests(path, source)).collect();
    assert!(tests.len() > 500, "only {} tests were found", tests.len());
    let known: BTreeSet<&String> = tests.iter().map(|(test, _)| test).collect();
    let mut wrong = Vec::new();
    for id in page.iter().filter(|id| !rows.contains_key(*id)) {
        wrong.push(format!("{id}: nothing proves it"));
    }
    for (id, proofs) in &rows {
        if !page.contains(id) && !id.starts_with('P') {
            wrong.push(format!("{id}: the page has no section of it"));
        }
        if proofs.is_empty() {
            wrong.push(format!("{id}: it names no test"));
        }
        // Only what no software can do has none.
        let is_none = |proof: &str| id.starts_with('S') && proof.starts_with("none: ");
        for proof in proofs.iter().filter(|proof| !known.contains(proof) && !is_none(proof)) {
            wrong.push(format!("{id}: there is no test {proof}"));
        }
    }
    for (test, ids) in &tests {
        let is_named = |id: &&String| rows.get(*id).is_some_and(|proofs| proofs.contains(test));
        for id in ids.iter().filter(|id| !is_named(id)) {
            wrong.push(format!("{id}: it does not name {test}, which is marked as its proof"));
        }
    }
    assert!(wrong.is_empty(), "{} disagreements:\n{}", wrong.len(), wrong.join("\n"));
    for (kind, most) in [('H', 20), ('P', 16)] {
        for number in 1..=most {
            let id = format!("{kind}{number}");
            assert!(rows.contains_key(&id), "{id} has no row");
        }
    }
}
