//! tests/hazards.txt names a test for every hazard of docs/safety.md, and every test that is marked as the proof of a
//! hazard.

use std::path::Path;
use system_tests::hazards::{HazardRow, Test, disagreements, rows, sources, tests};

fn log() -> (Vec<HazardRow>, Vec<Test>) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let [log, proofs] = ["docs/safety.md", "tests/hazards.txt"]
        .map(|path| std::fs::read_to_string(root.join(path)).expect("the hazard log and its proofs"));
    let found = sources(&root)
        .iter()
        .flat_map(|(path, source)| tests(path, source).unwrap_or_else(|error| panic!("{error}")))
        .collect();
    (rows(&log, &proofs), found)
}

#[test]
fn hazard_rows_and_marked_tests_match() {
    let (rows, tests) = log();
    assert!(tests.len() > 500, "only {} tests were found", tests.len());
    let found = disagreements(&rows, &tests);
    assert!(found.is_empty(), "{} disagreements:\n{}", found.len(), found.join("\n"));
}

#[test]
fn log_lists_every_seen_hazard_and_planted_fault() {
    let (rows, _) = log();
    for (kind, most) in [('H', 20), ('P', 16)] {
        for number in 1..=most {
            let id = format!("{kind}{number}");
            let row = rows.iter().find(|row| row.id == id);
            let row = row.unwrap_or_else(|| panic!("{id} has no row"));
            assert!(row.none.is_none(), "{id} has no test: {row:?}");
        }
    }
    // Only what no software can do has none.
    for row in rows {
        assert!(row.none.is_none() || row.id.starts_with('S'), "{row:?}");
    }
}
