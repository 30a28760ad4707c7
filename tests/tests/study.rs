//! `haptic-ctl study`: a whole study by simulated operators, killed and resumed.

use rustix::process::Signal;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use system_tests::{binary, ctl_offline, ctl_offline_refused, plain, process, stderr, text};

/// The program's own targeting task, of two conditions, two resistances and so many trials a segment.
pub(crate) fn small_plan(folder: &Path, trials: u32) -> PathBuf {
    let plan = text(&ctl_offline(&["study", "plan", "fitts"]).stdout);
    let plan = plan.replace("trials_per_segment = 8", &format!("trials_per_segment = {trials}"));
    let (head, rest) = plan
        .split_once("[[conditions]]\nname = \"3\"")
        .expect("a third condition");
    let (_, resistances) = rest.split_once("[[resistances]]").expect("resistances");
    let (two, _) = resistances.split_once("# 0.5 kg with").expect("a third resistance");
    let path = folder.join("small.toml");
    fs::write(&path, format!("{head}[[resistances]]{two}")).expect("written");
    path
}

fn study(plan: &str, out: &Path, more: &[&str]) -> Vec<String> {
    let two = ["--operator=simulated", "--subjects=2", "--seed=4"];
    let basic = ["study", "run", plan, two[0], two[1], two[2], "--out", plain(out)];
    [&basic, more].concat().into_iter().map(str::to_owned).collect()
}

fn start(arguments: &[String]) -> Child {
    Command::new(binary("haptic-ctl"))
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts")
}

/// The files of a folder, by their paths in it.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.expect("an entry").path();
        let name = PathBuf::from(path.file_name().expect("a name"));
        if path.is_dir() {
            found.extend(files(&path).into_iter().map(|(inner, bytes)| (name.join(inner), bytes)));
        } else if let Ok(bytes) = fs::read(&path) {
            found.insert(name, bytes);
        }
    }
    found
}

/// Bytes of rows.
fn rows(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(|entry| match entry.path() {
            path if is_table(&path) => entry.metadata().map_or(0, |file| file.len()),
            path if path.file_name().is_some_and(|name| name != "recordings") => rows(&path),
            _ => 0,
        })
        .sum()
}

fn is_table(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "csv")
}

#[test]
fn interrupt_ends_study_cleanly_and_second_program_is_refused() {
    let parent = tempfile::tempdir().expect("a folder");
    let folder = parent.path().join("study");
    let mut program = start(&study("perception", &folder, &["--no-recordings"]));
    let mut until_rows_in = |folder: &Path| {
        while rows(folder) == 0 {
            assert!(program.try_wait().expect("a state").is_none(), "it ended by itself");
            std::thread::yield_now();
        }
        program.id()
    };
    // Paused as soon as its folder can be found: a busy machine may start a program later than the study ends.
    let id = until_rows_in(&folder);
    process::signal(id, Signal::STOP);
    let second = ["study", "resume", plain(&folder)];
    ctl_offline_refused(&second, 2, &["another program is running this study\n"]);
    process::signal(id, Signal::CONT);
    until_rows_in(&folder.join("data"));
    let ended = process::end(program, Signal::INT);
    assert_eq!(ended.status.code(), Some(130), "{}", stderr(&ended));
    let printed = text(&ended.stdout);
    assert!(
        printed.contains("The study is interrupted; continue with `haptic-ctl study resume "),
        "{printed}"
    );
    let written = files(&folder);
    assert!(!written.contains_key(Path::new("trials.parquet")));
    for (path, bytes) in written.iter().filter(|(path, _)| is_table(path)) {
        assert!(bytes.ends_with(b"\n"), "{} ends within a row", path.display());
    }
}
