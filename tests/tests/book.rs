//! The documents as a book: every command in it does what the page shows, every link leads somewhere, and no page is
//! left out.

use crate::one_of_two;
use std::fs;
use std::path::{Path, PathBuf};
use system_tests::console::{Reader, Step, is_as_shown, steps};
use system_tests::fake_rig::FakeRig;
use system_tests::links::{anchors, dead_ends, links};
use system_tests::timed;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The pages of the book, by their paths in docs/.
fn pages() -> Vec<String> {
    let docs = root().join("docs");
    let mut found = Vec::new();
    let mut folders = vec![docs.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("it can be read").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "md") {
                let name = path.strip_prefix(&docs).expect("it lies in it");
                found.push(name.to_str().expect("a plain name").to_owned());
            }
        }
    }
    found.sort();
    found
}

/// What a page holds, by its path in docs/.
fn text(page: &str) -> String {
    fs::read_to_string(root().join("docs").join(page)).expect("a page")
}

/// Follows a page.
fn follow(page: &str) {
    if test_run::has(&["bash", "timeout"])
        && let Err(why) = Reader::new().follow(&text(page))
    {
        panic!("docs/{page}, {why}");
    }
}

#[test]
fn the_tutorial_leads_to_a_felt_block() {
    let _one = one_of_two();
    follow("tutorial.md");
}

/// With a fake rig that says what the Hapkit's firmware says.
#[test]
fn a_board_leads_to_a_felt_block() {
    let _one = one_of_two();
    // It is commissioned by pulses.
    timed("a board that leads to a felt block", || {
        let rig = FakeRig::start(&[
            "--firmware-name",
            "hapkit 0.2 magnet#5a3c01",
            "--force-limit-n",
            "5",
            "--resolution-mm",
            "0.016116",
            "--hand",
            "free",
            "--mass-kg",
            "0.2",
            "--friction-n",
            "0.3",
        ]);
        if test_run::has(&["bash", "timeout"])
            && let Err(why) = Reader::new().follow_board(rig.link())
        {
            panic!("docs/board.md, {why}");
        }
    });
}

#[test]
fn a_rig_is_steered_from_a_script() {
    if test_run::has(&["jq"]) {
        follow("how-to/script.md");
    }
}

#[test]
fn a_rig_is_steered_from_python() {
    if test_run::has(&["python3"]) {
        follow("how-to/python.md");
    }
}

#[test]
fn what_wants_a_port_is_as_it_should_be() {
    follow("how-to/ports.md");
}

#[test]
fn the_panel_is_opened() {
    follow("how-to/panel.md");
}

#[test]
fn a_surface_is_identified_and_compared() {
    follow("how-to/identify.md");
}

#[test]
fn a_study_is_run() {
    if !test_run::is_long_for("the how-to of studies") {
        return;
    }
    follow("how-to/study.md");
}

#[test]
fn a_firmware_is_tried() {
    let _one = one_of_two();
    // The page's fake board switches its motor off after 50 ms without a command.
    timed("a firmware that is tried under force", || {
        if test_run::has(&["python3"]) {
            follow("how-to/firmware.md");
        }
    });
}

#[test]
fn a_plane_is_felt() {
    let _one = one_of_two();
    follow("how-to/two-axes.md");
}

#[test]
fn recordings_are_made_replayed_and_collected() {
    follow("how-to/record.md");
}

#[test]
fn a_service_serves_many_rigs() {
    follow("how-to/service.md");
}

#[test]
fn the_protocol_is_spoken_by_hand() {
    if test_run::has(&["socat", "jq"]) {
        follow("control.md");
    }
}

#[test]
fn what_wants_an_oscilloscope_or_minutes_is_as_it_should_be() {
    follow("safety.md");
    follow("speed-vs-error.md");
}

#[test]
fn the_explanations_can_be_tried() {
    for page in pages().iter().filter(|page| page.starts_with("why/")) {
        follow(page);
    }
}

#[test]
fn the_person_at_the_handle_can_stop_the_rig() {
    follow("handle.md");
}

#[test]
fn every_page_with_commands_is_followed_by_a_test() {
    let tests = include_str!("book.rs");
    for page in pages() {
        let text = text(&page);
        let has_commands = text.lines().any(|line| line.starts_with("```console"));
        let is_followed =
            tests.contains(&format!("follow(\"{page}\")")) || page.starts_with("why/") || page == "board.md";
        assert!(
            is_followed || !has_commands,
            "docs/{page}: no test follows its commands"
        );
        let shell = text
            .lines()
            .find(|line| ["```sh", "```bash", "```shell"].contains(line));
        assert!(
            shell.is_none(),
            "docs/{page}: commands stand in blocks of the kind `console`, so that a test runs them"
        );
    }
}

#[test]
fn every_page_is_in_the_summary_once() {
    let summary = text("SUMMARY.md");
    let mut listed: Vec<String> = links(&summary).into_iter().map(|link| link.path).collect();
    listed.sort();
    let pages: Vec<String> = pages().into_iter().filter(|page| page != "SUMMARY.md").collect();
    assert_eq!(listed, pages);
}

#[test]
fn every_link_leads_somewhere() {
    let mut documents: Vec<PathBuf> = pages().iter().map(|page| root().join("docs").join(page)).collect();
    documents.extend(
        [
            "README.md",
            "CONTRIBUTING.md",
            "CHANGELOG.md",
            "firmware/README.md",
            "python/README.md",
            "python/core/README.md",
        ]
        .map(|name| root().join(name)),
    );
    let found: Vec<String> = documents
        .iter()
        .flat_map(|document| dead_ends(document, &fs::read_to_string(document).expect("a document")))
        .collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn a_link_that_leads_nowhere_is_found() {
    let page = "# One (1)\n[a](#one-1) [b](#two) `[c](none)`\n```text\n[d](none)\n```\n[e](page.md#one-1) [f](none.md#x) \
                [g](https://example.org/none)\n## Same\n## Same\n[h](#same-1)";
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("page.md");
    fs::write(&path, page).expect("it can be written");
    let found = dead_ends(&path, page);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].ends_with("page.md has no heading #two"), "{found:?}");
    assert!(found[1].ends_with(":6: there is no none.md"), "{found:?}");
    assert!(anchors(page).contains("same-1"));
}

#[test]
fn what_a_page_shows_is_told_from_what_it_does_not() {
    let shown = |lines: &[&str]| lines.iter().map(|line| (*line).to_owned()).collect::<Vec<_>>();
    for (lines, printed) in [
        (vec!["a", "b"], vec!["a", "b  "]),
        (vec!["a", "...", "d"], vec!["a", "b", "c", "d"]),
        (vec!["...", "d"], vec!["d"]),
        (vec!["at ... of ..."], vec!["at 7 ms of tick 9"]),
    ] {
        assert!(is_as_shown(&shown(&lines), &printed), "{lines:?}");
    }
    for (lines, printed) in [
        (vec!["a"], vec!["a", "b"]),
        (vec!["a", "b"], vec!["a"]),
        (vec![], vec!["a"]),
        (vec!["a", "...", "d"], vec!["a", "d", "e"]),
        (vec!["at ... of ..."], vec!["at 7 ms"]),
        (vec!["... ms"], vec!["7 ms late"]),
    ] {
        assert!(!is_as_shown(&shown(&lines), &printed), "{lines:?}");
    }
}

#[test]
fn a_page_that_shows_something_else_than_what_comes_is_found() {
    let follow = |page: &str| Reader::new().follow(page);
    let block = |remark: &str, body: &str| format!("{remark}\n```console\n{body}\n```\n");
    assert_eq!(follow(&block("", "$ echo one \\\n  two\none two\n$ true")), Ok(()));
    assert_eq!(follow(&block("<!-- exit code: 3 -->", "$ exit 3")), Ok(()));
    assert_eq!(
        follow(&block("<!-- not run: it wants a board -->", "$ make flash")),
        Ok(())
    );
    for (page, told) in [
        (
            block("", "$ echo one\ntwo"),
            "line 2: `echo one` is shown with\ntwo\nand prints\none",
        ),
        (block("", "$ false"), "instead of 0"),
        (block("<!-- keeps running -->", "$ echo one\ntwo"), "and prints\none"),
        ("<!-- Ctrl-C: hapticd -->".to_owned(), "no hapticd runs"),
    ] {
        let why = follow(&page).expect_err(told);
        assert!(why.contains(told), "{why}");
    }
    let steps = steps(&block("<!-- not run: it wants a board -->", "$ make flash"));
    assert!(matches!(&steps[..], [(2, Step::NotRun { why, .. })] if why == "it wants a board"));
}
