//! tests/hazards.txt names a test for every hazard of docs/safety.md, and every test that is marked as the proof of a
//! hazard.

use std::path::Path;
use system_tests::hazards::{Row, Test, disagreements, rows, sources, tests};

fn log() -> (Vec<Row>, Vec<Test>) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let [log, proofs] = ["docs/safety.md", "tests/hazards.txt"]
        .map(|path| std::fs::read_to_string(root.join(path)).expect("the hazard log and its proofs"));
    let found = sources(&root)
        .iter()
        // What is written here are marks of examples.
        .filter(|(path, _)| !path.ends_with("tests/hazard_log.rs"))
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

const SECTION: &str = "\
### H1: the hand is kicked
- **Cause:** a lie
- **Detection:** a look
- **Reaction:** zero force
- **Off after:** 1 ms
- **Remains:** none that is known
";

const PROOFS: &str = "\
# A remark.
H1
  tests/a.rs: it_does_not_kick
  tests/a.rs: nor_does_it_pull

P2: it pulls; the hand is pulled
  tests/a.rs: nor_does_it_pull
";

const SOURCE: &str = "
    // hazard: H1
    #[test]
    fn it_does_not_kick() {
        assert!(true);
    }
    // hazard: H1, P2
    #[cfg(not(miri))]
    #[tokio::test(start_paused = true)]
    async fn nor_does_it_pull() {}
    #[test]
    fn of_no_hazard() {}
    fn no_test() {}
";

/// What is found wrong with a log, its proofs and a source of one test file.
fn found(log: &str, proofs: &str, source: &str) -> Vec<String> {
    match tests("tests/a.rs", source) {
        Ok(tests) => disagreements(&rows(log, proofs), &tests),
        Err(error) => vec![error],
    }
}

fn one(found: &[String], what: &str) {
    assert!(
        found.len() == 1 && found[0].contains(what),
        "expected one disagreement with {what:?}: {found:?}"
    );
}

#[test]
fn a_log_that_agrees_with_its_tests_is_taken() {
    assert_eq!(found(SECTION, PROOFS, SOURCE), [""; 0]);
    let rows = rows(SECTION, PROOFS);
    assert_eq!(rows.iter().map(|row| row.id.as_str()).collect::<Vec<_>>(), ["H1", "P2"]);
    assert_eq!(rows[0].tests.len(), 2);
}

#[test]
fn a_row_that_names_a_test_which_does_not_exist_is_found() {
    let renamed = SOURCE
        .replace("it_does_not_kick", "it_never_kicks")
        .replace("// hazard: H1\n", "\n");
    let missing = "no test it_does_not_kick in tests/a.rs";
    one(&found(SECTION, PROOFS, &renamed), missing);
    // A function of that name is no test.
    let plain = SOURCE.replacen("    // hazard: H1\n    #[test]\n", "", 1);
    one(&found(SECTION, PROOFS, &plain), missing);
    // Nor is one in another file.
    let elsewhere = PROOFS.replace("tests/a.rs: it_does_not_kick", "tests/b.rs: it_does_not_kick");
    let told = found(SECTION, &elsewhere, SOURCE);
    assert_eq!(
        told.len(),
        2,
        "not there, and the one that is there is not named: {told:?}"
    );
}

#[test]
fn a_marked_test_without_a_row_or_not_named_by_it_is_found() {
    let (of_h1, _) = PROOFS.split_once("\nP2").expect("the planted fault");
    one(
        &found(SECTION, of_h1, SOURCE),
        "nor_does_it_pull in tests/a.rs is marked P2, which has no row",
    );
    let unnamed = PROOFS.replacen("  tests/a.rs: nor_does_it_pull\n", "", 1);
    one(
        &found(SECTION, &unnamed, SOURCE),
        "H1: it does not name nor_does_it_pull",
    );
}

#[test]
fn a_row_without_a_test_a_field_or_a_section_is_found() {
    let rest = SOURCE.replace("// hazard: H1\n", "\n").replace("H1, P2", "P2");
    let with = |proof: &str| {
        let (_, planted) = PROOFS.split_once("\n\n").expect("the planted fault");
        format!("H1\n{proof}\n{planted}")
    };
    one(&found(SECTION, &with(""), &rest), "H1: it names no test");
    let told = found(SECTION, &with("  it_does_not_kick"), &rest);
    one(&told[..1], "is not `path: name`");
    one(&found(SECTION, &with("  none: because"), &rest), "wants a reason");
    let reason = with("  none: the driver is a part of its own, which no program sees");
    assert_eq!(found(SECTION, &reason, &rest), [""; 0]);
    let without_risk = SECTION.replace("- **Remains:** none that is known\n", "");
    one(&found(&without_risk, PROOFS, SOURCE), "it has no Remains");
    let nameless = SECTION.replace("### H1: the hand is kicked", "### H1:");
    one(&found(&nameless, PROOFS, SOURCE), "its heading names no hazard");
    let without_cause = SECTION.replace("- **Cause:** a lie\n", "");
    let told = found(&without_cause, PROOFS, SOURCE);
    assert!(told.iter().any(|told| told.contains("where Cause is")), "{told:?}");
    one(&found("", PROOFS, SOURCE), "H1: the page has no section of it");
    let empty = PROOFS.replace("P2: it pulls; the hand is pulled", "P2");
    one(&found(SECTION, &empty, SOURCE), "P2: it does not say which fault");
}

#[test]
fn a_test_in_python_is_named_and_marked_as_any_other() {
    let source = "\
# hazard: H1
@pytest.mark.parametrize(\"end\", [1, 2])
def test_it_lets_go(end: int) -> None:
    pass


def test_of_no_hazard() -> None:
    pass
";
    let rows = rows(SECTION, "H1\n  t.py: test_it_lets_go\n");
    let found = |source: &str| match tests("t.py", source) {
        Ok(tests) => disagreements(&rows, &tests),
        Err(error) => vec![error],
    };
    assert_eq!(found(source), [""; 0]);
    one(
        &found(&source.replace("test_it_lets_go", "it_lets_go")),
        "stands above no test",
    );
    one(
        &found(&source.replace("test_it_lets_go", "test_it_holds")[14..]),
        "no test test_it_lets_go in t.py",
    );
    one(
        &found(&source.replace("def test_of", "# hazard: H1\ndef test_of")),
        "does not name test_of_no_hazard",
    );
}

#[test]
fn two_rows_of_one_id_are_found() {
    let again = format!("{PROOFS}P2: once more\n  tests/a.rs: nor_does_it_pull\n");
    one(&found(SECTION, &again, SOURCE), "P2: its proofs stand in two places");
    let told = found(&format!("{SECTION}{SECTION}"), PROOFS, SOURCE);
    assert!(
        told.iter().any(|told| told.contains("H1: there are two rows")),
        "{told:?}"
    );
}

#[test]
fn a_mark_that_stands_above_no_test_or_names_no_id_is_found() {
    let more = |text: &str| found(SECTION, PROOFS, &format!("{SOURCE}{text}"));
    one(&more("// hazard: H1\nfn no_test_either() {}\n"), "which is no test");
    one(&more("// hazard: H1\n\nstruct Nothing;\n"), "stands above no test");
    one(&more("// hazard: H1\n"), "stands above no test");
    one(
        &more("// hazard: the first\n#[test]\nfn a() {}\n"),
        "is no id of a hazard",
    );
}
