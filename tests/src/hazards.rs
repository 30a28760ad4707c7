//! The hazard log as data: the rows of docs/safety.md, their proofs in tests/hazards.txt, the tests in the sources, and
//! whether they agree.
//!
//! A row is a heading of the third level with its id and the hazard, `### H3: ...`, followed by one item for each of
//! `FIELDS`, `- **Cause:** ...`. Its proofs are the indented lines below its id, each `path: name`, or `none: ` and
//! why software cannot prove it. A planted fault has no row in the page: its text stands behind its id. Tests are
//! marked in the sources by a comment directly above their attributes, `// hazard: H3, P14`, or in Python above their
//! decorators, `# hazard: F4`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// What every section of the log says, in this order.
const FIELDS: [&str; 5] = ["Cause", "Detection", "Reaction", "Off after", "Remains"];

/// Letters that ids begin with: hazards seen by trying, further ones, planted faults, and what no
/// software can do.
const KINDS: [char; 4] = ['H', 'F', 'P', 'S'];

/// A row of the log: the proofs of an id.
#[derive(Debug, Default)]
pub struct HazardRow {
    /// The tests that prove it, each as `path: name`.
    pub tests: BTreeSet<String>,
    /// Why there is none.
    pub none: Option<String>,
}

/// A test in the sources.
#[derive(Debug)]
pub struct Test {
    /// As `path: name`.
    pub named: String,
    /// Ids of the rows that it is marked to prove.
    pub ids: Vec<String>,
}

fn is_id(text: &str) -> bool {
    let digits = text.strip_prefix(KINDS).unwrap_or_default();
    !digits.is_empty() && digits.chars().all(|digit| digit.is_ascii_digit())
}

/// The ids of the page's sections.
///
/// # Panics
/// A section does not say what every section says, or stands there twice.
pub fn sections(page: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for section in page.split("\n#").skip(1) {
        let title = section
            .lines()
            .next()
            .unwrap_or_default()
            .trim_start_matches('#')
            .trim_start();
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
///
/// # Panics
/// A line is none of an id, of a proof and of a remark.
pub fn proofs(text: &str) -> BTreeMap<String, HazardRow> {
    let mut rows: BTreeMap<String, HazardRow> = BTreeMap::new();
    let mut last = String::new();
    for line in text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        if let Some(proof) = line.strip_prefix("  ") {
            let row = rows.get_mut(&last).unwrap_or_else(|| panic!("of which id: {line}"));
            match proof.strip_prefix("none: ") {
                Some(why) => row.none = Some(why.to_owned()),
                None => drop(row.tests.insert(proof.to_owned())),
            }
        } else {
            last = line.split(": ").next().unwrap_or_default().to_owned();
            assert!(is_id(&last), "{last} is no id");
            // A planted fault is in no page: its text stands here.
            assert_eq!(last.starts_with('P'), line.contains(": "), "{line}");
            assert!(
                rows.insert(last.clone(), HazardRow::default()).is_none(),
                "{last} stands there twice"
            );
        }
    }
    rows
}

/// The tests of a source file.
///
/// # Panics
/// A mark stands above no test, or names no id.
pub fn tests(path: &str, source: &str) -> Vec<Test> {
    let is_python = path.ends_with(".py");
    let mark = if is_python { "# hazard:" } else { "// hazard:" };
    let mut tests = Vec::new();
    let (mut ids, mut is_test) = (Vec::new(), false);
    for (number, line) in (1..).zip(source.lines()) {
        let line = if is_python { line } else { line.trim() };
        let place = || format!("{path}:{number}: {line}");
        if let Some(text) = line.strip_prefix(mark) {
            ids = text.split(',').map(|id| id.trim().to_owned()).collect();
            assert!(ids.iter().all(|id: &String| is_id(id)), "{}", place());
        } else if let Some(name) = function(line) {
            is_test |= is_python && name.starts_with("test_");
            assert!(is_test || ids.is_empty(), "the mark stands above no test: {}", place());
            if is_test {
                let named = format!("{path}: {name}");
                tests.push(Test {
                    named,
                    ids: std::mem::take(&mut ids),
                });
            }
            is_test = false;
        } else if line.starts_with("#[test") || line.starts_with("#[tokio::test") {
            is_test = true;
        } else if line.is_empty() {
            assert!(ids.is_empty(), "the mark stands above no test: {}", place());
        }
    }
    tests
}

/// The name of the function that a line begins.
fn function(line: &str) -> Option<&str> {
    let mut rest = line;
    for word in ["pub ", "pub(crate) ", "pub(super) ", "async ", "const ", "unsafe "] {
        rest = rest.strip_prefix(word).unwrap_or(rest);
    }
    let name = rest.strip_prefix("fn ").or_else(|| rest.strip_prefix("def "))?;
    name.split(['(', '<']).next()
}

/// Where the page, the proofs and the tests do not agree, in sentences.
pub fn disagreements(page: &BTreeSet<String>, rows: &BTreeMap<String, HazardRow>, tests: &[Test]) -> Vec<String> {
    let mut found = Vec::new();
    for id in page.iter().filter(|id| !rows.contains_key(*id)) {
        found.push(format!("{id}: nothing proves it"));
    }
    let known: BTreeSet<&String> = tests.iter().map(|test| &test.named).collect();
    for (id, row) in rows {
        if !page.contains(id) && !id.starts_with('P') {
            found.push(format!("{id}: the page has no section of it"));
        }
        if row.tests.is_empty() && row.none.is_none() {
            found.push(format!("{id}: it names no test"));
        }
        for test in row.tests.iter().filter(|test| !known.contains(test)) {
            found.push(format!("{id}: there is no test {test}"));
        }
    }
    for Test { named, ids } in tests {
        for id in ids {
            if !rows.get(id).is_some_and(|row| row.tests.contains(named)) {
                found.push(format!("{id}: it does not name {named}, which is marked as its proof"));
            }
        }
    }
    found
}

/// All Rust files of the workspace's own crates and tests, and the tests of the Python package, from its root.
///
/// # Panics
/// They cannot be read.
pub fn sources(root: &Path) -> Vec<(String, String)> {
    let mut folders: Vec<PathBuf> = ["crates", "tests", "python/tests"]
        .map(|folder| root.join(folder))
        .to_vec();
    let mut sources = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path
                .extension()
                .is_some_and(|extension| extension == "rs" || extension == "py")
            {
                let text = std::fs::read_to_string(&path).expect("a source");
                let name = path.strip_prefix(root).expect("it lies below").display().to_string();
                sources.push((name, text));
            }
        }
    }
    sources.sort();
    sources
}
