//! The hazard log as data: the rows of docs/safety.md, their proofs in tests/hazards.txt, the tests in the sources, and
//! whether they agree.
//!
//! A row is a heading of the third level with its id and the hazard, `### H3: ...`, followed by one item for each of
//! [`FIELDS`], `- **Cause:** ...`. Its proofs are the indented lines below its id, each `path: name`, or `none: ` and
//! why software cannot prove it. A planted fault has no row in the page: its text stands behind its id. Tests are
//! marked in the sources by a comment directly above their attributes, `// hazard: H3, P14`, or in Python above their
//! decorators, `# hazard: F4`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// What every section of the log says, in this order.
pub const FIELDS: [&str; 5] = ["Cause", "Detection", "Reaction", "Off after", "Remains"];

/// Letters that ids begin with: hazards seen by trying, further ones, planted faults, and what no
/// software can do.
const KINDS: [char; 4] = ['H', 'F', 'P', 'S'];

/// A row of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HazardRow {
    /// As `H3`.
    pub id: String,
    /// The tests that prove it: a file and the name of a function.
    pub tests: Vec<Named>,
    /// Why there is none.
    pub none: Option<String>,
    /// What is wrong with the row itself.
    pub faults: Vec<String>,
}

/// A test, as a row names it or as it stands in the sources.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Named {
    /// File, from the root of the repository.
    pub path: String,
    /// Function.
    pub name: String,
}

/// A test in the sources.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Test {
    /// Where it is.
    pub named: Named,
    /// Ids of the rows that it is marked to prove.
    pub ids: Vec<String>,
}

fn is_id(text: &str) -> bool {
    let mut letters = text.chars();
    letters.next().is_some_and(|kind| KINDS.contains(&kind))
        && !letters.as_str().is_empty()
        && letters.as_str().chars().all(|digit| digit.is_ascii_digit())
}

/// A row of which nothing is known but its id.
fn row(id: &str) -> HazardRow {
    HazardRow {
        id: id.to_owned(),
        tests: Vec::new(),
        none: None,
        faults: Vec::new(),
    }
}

/// The rows of a log in their order, and then the planted faults, each with its proofs.
#[must_use]
pub fn rows(log: &str, proofs: &str) -> Vec<HazardRow> {
    let mut rows = sections(log);
    let mut proven = BTreeSet::new();
    let mut last = None;
    for line in proofs.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        match (line.strip_prefix("  "), last) {
            (Some(proof), Some(at)) => prove(&mut rows[at], proof),
            _ => {
                let (id, fault) = line.split_once(": ").unwrap_or((line, ""));
                let at = rows.iter().position(|row| row.id == id).unwrap_or_else(|| {
                    let mut row = row(id);
                    if !(is_id(id) && id.starts_with('P')) {
                        row.faults.push(format!("{id}: the page has no section of it"));
                    } else if fault.is_empty() {
                        row.faults.push(format!("{id}: it does not say which fault is planted"));
                    }
                    rows.push(row);
                    rows.len() - 1
                });
                if !proven.insert(id) {
                    rows[at].faults.push(format!("{id}: its proofs stand in two places"));
                }
                last = Some(at);
            }
        }
    }
    for row in rows.iter_mut().filter(|row| row.tests.is_empty() && row.none.is_none()) {
        row.faults.push(format!("{}: it names no test", row.id));
    }
    rows
}

/// Adds a proof to its row: a test, or why there is none.
fn prove(row: &mut HazardRow, proof: &str) {
    match proof.split_once(": ") {
        Some(("none", why)) => {
            if why.len() < 20 {
                row.faults.push(format!("{}: `none:` wants a reason", row.id));
            }
            row.none = Some(why.to_owned());
        }
        Some((path, name)) => row.tests.push(Named {
            path: path.to_owned(),
            name: name.to_owned(),
        }),
        None => row.faults.push(format!("{}: `{proof}` is not `path: name`", row.id)),
    }
}

/// The sections of the page, without their proofs.
fn sections(log: &str) -> Vec<HazardRow> {
    let mut rows: Vec<HazardRow> = Vec::new();
    // Labels that are still to come in the section that is being read.
    let mut missing: Vec<&str> = Vec::new();
    let close = |rows: &mut Vec<HazardRow>, missing: &mut Vec<&str>| {
        for field in missing.drain(..) {
            if let Some(row) = rows.last_mut() {
                row.faults.push(format!("{}: it has no {field}", row.id));
            }
        }
    };
    // An item continues in lines that are indented.
    for line in log.replace("\n  ", " ").lines() {
        if line.starts_with('#') {
            close(&mut rows, &mut missing);
            let title = line.trim_start_matches('#').trim_start();
            if let Some((id, hazard)) = title.split_once(':').filter(|(id, _)| is_id(id)) {
                let mut row = row(id);
                if hazard.trim().is_empty() {
                    row.faults.push(format!("{id}: its heading names no hazard"));
                }
                rows.push(row);
                missing = FIELDS.to_vec();
            }
        } else if let Some((label, text)) = line.strip_prefix("- **").and_then(|item| item.split_once(":** ")) {
            let Some(row) = rows.last_mut().filter(|_| !missing.is_empty()) else {
                continue;
            };
            if missing.first() != Some(&label) || text.trim().is_empty() {
                row.faults
                    .push(format!("{}: {label} stands where {} is expected", row.id, missing[0]));
            }
            missing.retain(|field| *field != label);
        }
    }
    close(&mut rows, &mut missing);
    rows
}

/// The tests of a source file. Marks of no test are faults.
///
/// # Errors
/// A mark that does not stand above a test, or that names no id.
pub fn tests(path: &str, source: &str) -> Result<Vec<Test>, String> {
    if path.ends_with(".py") {
        return python_tests(path, source);
    }
    let mut tests = Vec::new();
    let mut marked: Vec<String> = Vec::new();
    let mut mark_line = 0;
    let mut is_test = false;
    for (number, line) in (1..).zip(source.lines()) {
        let line = line.trim();
        if let Some(text) = line.strip_prefix("// hazard:") {
            if !marked.is_empty() {
                return Err(format!("{path}:{mark_line}: the mark stands above no test"));
            }
            marked = ids(path, number, text)?;
            mark_line = number;
        } else if line.starts_with("#[") {
            // `#[test]`, `#[tokio::test]`, `#[tokio::test(start_paused = true)]`.
            let attribute = line.trim_start_matches("#[");
            let attribute = attribute.split([']', '(']).next().unwrap_or_default();
            is_test |= attribute == "test" || attribute.ends_with("::test");
        } else if let Some(name) = function(line) {
            if is_test {
                tests.push(Test {
                    named: Named {
                        path: path.to_owned(),
                        name,
                    },
                    ids: std::mem::take(&mut marked),
                });
            } else if !marked.is_empty() {
                return Err(format!(
                    "{path}:{mark_line}: the mark stands above {name}, which is no test"
                ));
            }
            is_test = false;
        } else if !(line.is_empty() || line.starts_with("//")) {
            // An attribute may go over several lines; anything else ends what stands above a test.
            let goes_on = is_test || !marked.is_empty();
            let of_attribute =
                line.ends_with([',', '(', '"']) || line.starts_with([')', ']', '"']) || line.contains('=');
            if goes_on && !of_attribute {
                if !marked.is_empty() {
                    return Err(format!("{path}:{mark_line}: the mark stands above no test"));
                }
                is_test = false;
            }
        }
    }
    if marked.is_empty() {
        Ok(tests)
    } else {
        Err(format!("{path}:{mark_line}: the mark stands above no test"))
    }
}

/// The ids of a mark.
fn ids(path: &str, line: usize, text: &str) -> Result<Vec<String>, String> {
    let ids: Vec<String> = text.split(',').map(|id| id.trim().to_owned()).collect();
    match ids.iter().find(|id| !is_id(id)) {
        Some(wrong) => Err(format!("{path}:{line}: {wrong:?} is no id of a hazard")),
        None => Ok(ids),
    }
}

/// The tests of a Python file: its functions whose names begin with `test_`.
fn python_tests(path: &str, source: &str) -> Result<Vec<Test>, String> {
    let mut tests = Vec::new();
    let mut mark: Option<(usize, Vec<String>)> = None;
    for (number, line) in (1..).zip(source.lines()) {
        if let Some(text) = line.strip_prefix("# hazard:") {
            mark = Some((number, ids(path, number, text)?));
            continue;
        }
        let function = line.trim_start_matches("async ").strip_prefix("def ");
        let name = function.and_then(|rest| rest.split_once('(')).map(|(name, _)| name);
        if let Some(name) = name.filter(|name| name.starts_with("test_")) {
            tests.push(Test {
                named: Named {
                    path: path.to_owned(),
                    name: name.to_owned(),
                },
                ids: mark.take().map_or_else(Vec::new, |(_, ids)| ids),
            });
        } else if let Some((mark_line, _)) = mark.as_ref().filter(|_| !line.starts_with('@')) {
            return Err(format!("{path}:{mark_line}: the mark stands above no test"));
        }
    }
    match mark {
        Some((mark_line, _)) => Err(format!("{path}:{mark_line}: the mark stands above no test")),
        None => Ok(tests),
    }
}

/// The name of the function that a line begins.
fn function(line: &str) -> Option<String> {
    let mut rest = line;
    for word in ["pub ", "pub(crate) ", "pub(super) ", "async ", "const ", "unsafe "] {
        rest = rest.strip_prefix(word).unwrap_or(rest);
    }
    let name = rest.strip_prefix("fn ")?;
    let end = name.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))?;
    Some(name[..end].to_owned())
}

/// Where the log and the tests do not agree, in sentences.
#[must_use]
pub fn disagreements(rows: &[HazardRow], tests: &[Test]) -> Vec<String> {
    let mut found: Vec<String> = rows.iter().flat_map(|row| row.faults.clone()).collect();
    let known: BTreeSet<&Named> = tests.iter().map(|test| &test.named).collect();
    let mut named: BTreeMap<&str, BTreeSet<&Named>> = BTreeMap::new();
    for row in rows {
        if named.insert(&row.id, row.tests.iter().collect()).is_some() {
            found.push(format!("{}: there are two rows of it", row.id));
        }
        for test in &row.tests {
            if !known.contains(test) {
                found.push(format!("{}: there is no test {} in {}", row.id, test.name, test.path));
            }
        }
    }
    for Test { named: test, ids } in tests {
        for id in ids {
            match named.get(id.as_str()) {
                None => found.push(format!(
                    "{} in {} is marked {id}, which has no row",
                    test.name, test.path
                )),
                Some(tests) if !tests.contains(test) => found.push(format!(
                    "{id}: it does not name {} in {}, which is marked as its proof",
                    test.name, test.path
                )),
                Some(_) => {}
            }
        }
    }
    found
}

/// All Rust files of the workspace's own crates and tests, and the tests of the Python package, from its root.
///
/// # Panics
/// They cannot be read.
#[must_use]
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
