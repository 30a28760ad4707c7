//! tests/hazards.txt names a test for every hazard of docs/safety.md, and every test that is marked as the proof of a
//! hazard.

use std::path::Path;
use system_tests::hazards::{disagreements, proofs, sections, sources, tests};

#[test]
fn hazard_rows_and_marked_tests_match() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let read = |path: &str| std::fs::read_to_string(root.join(path)).expect("it is there");
    let (page, rows) = (sections(&read("docs/safety.md")), proofs(&read("tests/hazards.txt")));
    let tests: Vec<_> = sources(&root)
        .iter()
        .flat_map(|(path, source)| tests(path, source))
        .collect();
    assert!(tests.len() > 500, "only {} tests were found", tests.len());
    let found = disagreements(&page, &rows, &tests);
    assert!(found.is_empty(), "{} disagreements:\n{}", found.len(), found.join("\n"));
    for (kind, most) in [('H', 20), ('P', 16)] {
        for number in 1..=most {
            assert!(
                rows.contains_key(&format!("{kind}{number}")),
                "{kind}{number} has no row"
            );
        }
    }
    // Only what no software can do has none.
    for (id, row) in rows {
        assert!(row.none.is_none() || id.starts_with('S'), "{id}: {row:?}");
    }
}
