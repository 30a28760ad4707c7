//! The documents as a book: every command in it does what the page shows, every link leads somewhere, and no page is
//! left out.

use crate::one_of_two;
use std::fs;
use std::path::{Path, PathBuf};
use system_tests::console::Reader;
use system_tests::fake_rig::FakeRig;
use system_tests::links::{dead_ends, links};
use system_tests::{files, plain, timed};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The pages of the book, by their paths in docs/.
fn pages() -> Vec<String> {
    let docs = root().join("docs");
    let pages = files(&docs)
        .into_iter()
        .filter(|file| file.extension().is_some_and(|ending| ending == "md"));
    pages
        .map(|page| plain(page.strip_prefix(&docs).expect("it lies in it")).to_owned())
        .collect()
}

/// What a page holds, by its path in docs/.
fn text(page: &str) -> String {
    fs::read_to_string(root().join("docs").join(page)).expect("a page")
}

/// Pages, and the programs that they use beside ours.
const PAGES: [(&str, &[&str]); 11] = [
    ("how-to/script.md", &["jq"]),
    ("how-to/python.md", &["python3"]),
    ("control.md", &["socat", "jq"]),
    ("how-to/ports.md", &[]),
    ("how-to/panel.md", &[]),
    ("how-to/identify.md", &[]),
    ("how-to/record.md", &[]),
    ("how-to/service.md", &[]),
    ("safety.md", &[]),
    ("speed-vs-error.md", &[]),
    ("handle.md", &[]),
];

/// Pages by which a block is felt.
const FELT: [(&str, &[&str]); 2] = [("tutorial.md", &[]), ("how-to/two-axes.md", &[])];

/// Pages of the long run: a study takes its time, and the fake board of the other switches its motor off after 50 ms
/// without a command.
const LONG: [(&str, &[&str]); 2] = [("how-to/study.md", &[]), ("how-to/firmware.md", &["python3"])];

/// Follows pages, each of them whatever became of those before it.
fn follow<'a>(pages: impl IntoIterator<Item = (&'a str, &'a [&'a str])>) {
    let failed = pages.into_iter().filter_map(|(page, programs)| {
        let is_followed = test_run::has(&[&["bash", "timeout"], programs].concat());
        let why = is_followed.then(|| Reader::begin().follow(&text(page)))?.err()?;
        Some(format!("docs/{page}, {why}"))
    });
    let failed: Vec<String> = failed.collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn every_page_does_what_it_shows() {
    let all = pages();
    let explanations = all.iter().filter(|page| page.starts_with("why/"));
    let explanations = explanations.map(|page| (page.as_str(), &[][..]));
    follow(PAGES.into_iter().chain(explanations));
}

#[test]
fn a_reader_comes_to_feel_a_block() {
    let _one = one_of_two();
    follow(FELT);
}

#[test]
fn a_study_is_run_and_a_firmware_tried() {
    let _one = one_of_two();
    timed("a study, and a firmware under force", || follow(LONG));
}

/// With a fake rig that says what the Hapkit's firmware says.
#[test]
fn a_board_leads_to_a_felt_block() {
    let _one = one_of_two();
    // It is commissioned by pulses.
    timed("a board that leads to a felt block", || {
        let rig = FakeRig::start(&[
            "--firmware-name=hapkit 0.2 magnet#5a3c01",
            "--force-limit-n=5",
            "--resolution-mm=0.016116",
            "--hand=free",
            "--mass-kg=0.2",
            "--friction-n=0.3",
        ]);
        let page = text("board.md").replace("/dev/ttyUSB0", plain(rig.link()));
        if test_run::has(&["bash", "timeout"])
            && let Err(why) = Reader::begin().follow(&page)
        {
            panic!("docs/board.md, {why}");
        }
    });
}

#[test]
fn every_page_with_commands_is_followed_by_a_test() {
    let followed: Vec<&str> = [&PAGES[..], &FELT, &LONG]
        .concat()
        .into_iter()
        .map(|(page, _)| page)
        .collect();
    for page in pages() {
        let is_followed = followed.contains(&&*page) || page.starts_with("why/") || page == "board.md";
        for line in text(&page).lines() {
            assert!(
                is_followed || !line.starts_with("```console"),
                "docs/{page}: no test follows its commands"
            );
            assert!(
                !["```sh", "```bash", "```shell"].contains(&line),
                "docs/{page}: commands stand in blocks of the kind `console`, so that a test runs them"
            );
        }
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
    let others = [
        "README.md",
        "CONTRIBUTING.md",
        "CHANGELOG.md",
        "firmware/README.md",
        "python/README.md",
        "python/core/README.md",
    ];
    let pages = pages().into_iter().map(|page| format!("docs/{page}"));
    let documents = pages.chain(others.map(str::to_owned)).map(|name| root().join(name));
    let found: Vec<String> = documents
        .flat_map(|document| dead_ends(&document, &fs::read_to_string(&document).expect("a document")))
        .collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}
