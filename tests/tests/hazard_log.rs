//! docs/safety.md names a test for every hazard, and every test that is marked as the proof of a
//! hazard is named there.

use std::path::Path;
use system_tests::hazards::{Row, Test, disagreements, rows, sources, tests};

fn log() -> (Vec<Row>, Vec<Test>) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let log = std::fs::read_to_string(root.join("docs/safety.md")).expect("the hazard log");
    let found = sources(&root)
        .iter()
        // What is written here are marks of examples.
        .filter(|(path, _)| !path.ends_with("tests/hazard_log.rs"))
        .flat_map(|(path, source)| tests(path, source).unwrap_or_else(|error| panic!("{error}")))
        .collect();
    (rows(&log), found)
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
### H1: it kicks
- **Hazard:** the hand is kicked
- **Cause:** a lie
- **Detection:** a look
- **Reaction:** zero force
- **Zero force after:** 1 ms
- **Residual risk:** none that is known
- **Tests:** `tests/a.rs: it_does_not_kick`, `tests/a.rs: nor_does_it_pull`
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

const TABLE: &str = "
| id | fault | tests |
|---|---|---|
| P2 | it pulls | `tests/a.rs: nor_does_it_pull` |
";

const PYTHON: &str = "\
# hazard: H1
@pytest.mark.parametrize(\"end\", [1, 2])
def test_it_lets_go(end: int) -> None:
    pass


def test_of_no_hazard() -> None:
    pass
";

/// What is found wrong with a log and a source of one test file.
fn found(log: &str, path: &str, source: &str) -> Vec<String> {
    match tests(path, source) {
        Ok(tests) => disagreements(&rows(log), &tests),
        Err(error) => vec![error],
    }
}

#[test]
fn a_log_that_agrees_with_its_tests_is_taken() {
    let both = format!("{SECTION}{TABLE}");
    assert_eq!(found(&both, "tests/a.rs", SOURCE), [""; 0]);
    let rows = rows(&both);
    assert_eq!(rows.iter().map(|row| row.id.as_str()).collect::<Vec<_>>(), ["H1", "P2"]);
    assert_eq!(rows[0].tests.len(), 2);
    // A reason may stand in place of a test.
    let without = SECTION.rsplit_once("- **Tests:**").expect("its last item").0;
    let log = format!("{without}- **Tests:** none: the driver is a part of its own, which no program sees\n");
    assert_eq!(found(&log, "tests/a.rs", "#[test]\nfn a() {}\n"), [""; 0]);
}

#[test]
fn every_disagreement_of_log_and_tests_is_found() {
    let both = format!("{SECTION}{TABLE}");
    let tests = "`tests/a.rs: it_does_not_kick`, `tests/a.rs: nor_does_it_pull`";
    let python = SECTION.replace(tests, "`t.py: test_it_lets_go`");
    let more = |text: &str| format!("{SOURCE}{text}");
    assert_eq!(found(&python, "t.py", PYTHON), [""; 0]);
    for (log, path, source, told) in [
        // The log names what is not a test, or is one elsewhere.
        (
            both.clone(),
            "tests/a.rs",
            SOURCE.replace("it_does_not_kick", "it_never_kicks"),
            "no test it_does_not_kick",
        ),
        (
            both.clone(),
            "tests/a.rs",
            SOURCE.replacen("#[test]\n", "", 1),
            "which is no test",
        ),
        (
            both.replace("a.rs: it_does", "b.rs: it_does"),
            "tests/a.rs",
            SOURCE.to_owned(),
            "tests/b.rs",
        ),
        // A mark has no row, or its row does not name the test.
        (
            SECTION.to_owned(),
            "tests/a.rs",
            SOURCE.to_owned(),
            "is marked P2, which has no row",
        ),
        (
            both.replace(", `tests/a.rs: nor_does_it_pull`", ""),
            "tests/a.rs",
            SOURCE.to_owned(),
            "H1: it does not name nor_does_it_pull",
        ),
        (
            both.clone(),
            "tests/a.rs",
            more("// hazard: H1\nfn no_test_either() {}\n"),
            "which is no test",
        ),
        (
            both.clone(),
            "tests/a.rs",
            more("// hazard: H1\n\nstruct Nothing;\n"),
            "stands above no test",
        ),
        (
            both.clone(),
            "tests/a.rs",
            more("// hazard: H1\n"),
            "stands above no test",
        ),
        (
            both.clone(),
            "tests/a.rs",
            more("// hazard: the first\n#[test]\nfn a() {}\n"),
            "is no id of a hazard",
        ),
        // A row is not whole, or there are two.
        (
            both.replace(tests, "to come"),
            "tests/a.rs",
            SOURCE.to_owned(),
            "H1: it names no test",
        ),
        (
            both.replace(tests, "`it_does_not_kick`"),
            "tests/a.rs",
            SOURCE.to_owned(),
            "is not `path: name`",
        ),
        (
            both.replace(tests, "none: because"),
            "tests/a.rs",
            SOURCE.to_owned(),
            "wants a reason",
        ),
        (
            both.replace("- **Residual risk:** none that is known\n", ""),
            "tests/a.rs",
            SOURCE.to_owned(),
            "Residual risk",
        ),
        (
            both.replace("| it pulls |", "| |"),
            "tests/a.rs",
            SOURCE.to_owned(),
            "P2: a cell is empty",
        ),
        (
            format!("{both}{TABLE}"),
            "tests/a.rs",
            SOURCE.to_owned(),
            "P2: there are two rows of it",
        ),
        // The same in Python.
        (
            python.clone(),
            "t.py",
            PYTHON.replace("test_it_lets_go", "it_lets_go"),
            "stands above no test",
        ),
        (
            python.clone(),
            "t.py",
            PYTHON.replace("test_it_lets_go", "test_it_holds"),
            "no test test_it_lets_go in t.py",
        ),
        (
            python,
            "t.py",
            PYTHON.replace("def test_of", "# hazard: H1\ndef test_of"),
            "does not name test_of_no_hazard",
        ),
    ] {
        let all = found(&log, path, &source);
        assert!(
            all.iter().any(|each| each.contains(told)),
            "{told:?} is not found: {all:?}"
        );
    }
}
