//! The documents as a book: every command in it does what the page shows, every link leads somewhere, and no page is
//! left out.

use crate::one_of_two;
use std::fs;
use std::path::{Path, PathBuf};
use system_tests::console::Reader;
use system_tests::fake_rig::FakeRig;
use system_tests::links::{dead_ends, links};
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
